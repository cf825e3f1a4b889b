"""Euler characteristic: pieces minus holes, sum over both phases of a torus, simple shapes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from fem_seal.errors import InvalidInput
from fem_seal.film import clusters
from fem_seal.film.euler import euler_characteristic
from fem_seal.film.lattice import DUAL_CONNECTIVITY

CONNECTIVITIES = ("4", "8", "triangulation")
masks = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12))


@given(masks, st.sampled_from(CONNECTIVITIES))
def test_pieces_minus_holes(mask, connectivity):
    """Holes are the clusters of the complement, in the dual connectivity, but the outer one."""
    pieces = clusters.label(mask, connectivity)[1]
    # Two rows of padding keep the parity of the triangulation's diagonals.
    outside = np.pad(~mask, 2, constant_values=True)
    holes = clusters.label(outside, DUAL_CONNECTIVITY[connectivity])[1] - 1
    assert euler_characteristic(mask, connectivity) == pieces - holes


@given(masks, st.sampled_from(CONNECTIVITIES))
def test_two_phases_of_a_torus_cancel(mask, connectivity):
    """A torus has Euler characteristic 0, and so has the sum of the dual complexes on it.

    Even sides, so that the diagonals still alternate across the seams; at least four samples,
    so that no two neighbours are neighbours twice.
    """
    mask = np.tile(mask, (4, 4))
    total = euler_characteristic(mask, connectivity, (True, True)) + euler_characteristic(
        ~mask, DUAL_CONNECTIVITY[connectivity], (True, True)
    )
    assert total == 0


def test_disc_ring_torus_and_cheese():
    disc = np.ones((5, 5), bool)
    ring = disc.copy()
    ring[2, 2] = False
    cheese = np.ones((9, 9), bool)
    cheese[2::3, 2::3] = False
    for connectivity in CONNECTIVITIES:
        assert euler_characteristic(disc, connectivity) == 1
        assert euler_characteristic(ring, connectivity) == 0
        assert euler_characteristic(np.zeros((3, 3), bool), connectivity) == 0
        assert euler_characteristic(np.ones((4, 4), bool), connectivity, (True, True)) == 0
        assert euler_characteristic(np.ones((4, 4), bool), connectivity, (False, True)) == 0
    assert euler_characteristic(cheese, "4") < 0


def test_corner_neighbours_are_joined_by_8_only():
    corner = np.array([[1, 0], [0, 1]], bool)
    assert euler_characteristic(corner, "4") == 2
    assert euler_characteristic(corner, "8") == 1
    assert euler_characteristic(corner, "triangulation") == 1
    assert euler_characteristic(corner[::-1], "triangulation") == 2


def test_unknown_connectivity():
    with pytest.raises(InvalidInput, match="connectivity = '6'"):
        euler_characteristic(np.ones((2, 2), bool), "6")
