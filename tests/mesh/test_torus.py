"""Torus: its first mesh and guess, and the jumps of its functions."""

import numpy as np
import pytest
from nested_meshes import areas, refined

from fem_seal.flow.topology import jumps_across, jumps_along
from fem_seal.mesh.torus import LEAST_SQUARES, squares_across, uniform_torus


@pytest.mark.parametrize("squares", [(1, 1), (1, 3), (4, 8)])
def test_squares_of_the_first_mesh(squares):
    """At least LEAST_SQUARES, and never wider than asked for; they fill the cell."""
    mesh = uniform_torus(squares, 1)
    assert squares_across(mesh) == max(LEAST_SQUARES, min(squares))
    assert areas(mesh).sum() == squares[0] * squares[1]


def test_the_first_guess_jumps_by_one():
    """Of unit jumps in x and in y: at a copy of a vertex each is larger by the seams crossed."""
    mesh = refined(uniform_torus((5, 5), 1), seed=2)[-1][2].mesh
    for functions in mesh.first_guess():
        np.testing.assert_allclose(functions - functions[:, mesh.twin], mesh.copy.T, atol=1e-15)


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
