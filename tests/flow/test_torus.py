"""Pieces laid out in the plane, and the jumps that their windings leave."""

import numpy as np
import pytest

from fem_seal.film.winding import unwind
from fem_seal.flow.torus import jumps_across, jumps_along


def test_a_ring_of_pieces_winds():
    """Three pieces in a row, the last one beside the first across the seam x = Lx."""
    jump = np.array([[0, 0], [0, 0], [1, 0]])
    found = unwind(np.array([0, 1, 2]), np.array([1, 2, 0]), jump, 4)
    assert len(set(found.root[:3])) == 1
    assert found.root[3] == 3
    assert {tuple(np.abs(w)) for w in found.windings} == {(1, 0)}


def test_pieces_that_only_cross_a_seam_do_not_wind():
    found = unwind(np.array([0, 1]), np.array([1, 2]), np.array([[1, 0], [0, 1]]), 3)
    assert len(found.windings) == 0
    np.testing.assert_array_equal(found.offset[2] - found.offset[0], [1, 1])
    np.testing.assert_array_equal(found.offset[1] - found.offset[0], [1, 0])


@pytest.mark.parametrize(
    ("windings", "along", "across"),
    [
        ([], 0, 2),
        ([[1, 0]], 1, 1),
        ([[0, -1], [0, 1]], 1, 1),
        ([[1, 2], [-1, -2]], 1, 1),
        ([[2, 4]], 1, 1),
        ([[1, 0], [1, 1]], 2, 0),
    ],
)
def test_jumps(windings, along, across):
    """What flows along windings of the gap is what patches that wind so do not bar."""
    windings = np.array(windings, dtype=int).reshape(-1, 2)
    driving, allowed = jumps_along(windings), jumps_across(windings)
    assert (len(driving), len(allowed)) == (along, across)
    if along == 1:
        # The pressure jumps by one along the shortest winding of that direction.
        shortest = windings / np.gcd(*windings.T)[:, None]
        assert np.abs(shortest @ driving[0]) == pytest.approx(1, rel=1e-15)
        np.testing.assert_allclose(windings @ allowed.T, 0)
