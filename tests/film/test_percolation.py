"""Clusters, spanning, winding and sealing: one of open and contact crosses; widest paths around."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from slow_reference import pieces

from fem_seal.film import clusters
from fem_seal.film.clusters import joins_ends
from fem_seal.film.lattice import DUAL_CONNECTIVITY
from fem_seal.film.winding import periodic_sites, widest_winding, winds
from fem_seal.grid import GridField

CONNECTIVITIES = ("4", "8", "triangulation")
masks = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12))


@settings(max_examples=40)
@given(masks, st.sampled_from(CONNECTIVITIES), st.tuples(st.booleans(), st.booleans()))
def test_clusters_are_the_components_of_the_neighbour_pairs(mask, connectivity, periodic):
    labels, count = clusters.label(mask, connectivity, periodic)
    expected = pieces(mask, connectivity, periodic)[mask]
    assert np.array_equal(labels > 0, mask)
    assert count == len(np.unique(expected))
    # The two partitions are equal if the pairs of their labels form a one-to-one map.
    assert len(set(zip(labels[mask], expected, strict=True))) == count
    assert set(labels[mask]) == set(range(1, count + 1))
    largest = clusters.largest(labels, count)
    assert len(np.unique(labels[largest])) == (count > 0)
    assert largest.sum() == np.bincount(labels[mask]).max(initial=0)


@settings(max_examples=60)
@given(masks, st.sampled_from(CONNECTIVITIES))
def test_either_open_or_contact_crosses(open_, connectivity):
    """Open from inlet to outlet, or contact from wall to wall; with periodic sides, contact all the
    way around the seal."""
    dual = DUAL_CONNECTIVITY[connectivity]
    contact = np.ascontiguousarray(~open_.T)
    assert joins_ends(open_, connectivity) != joins_ends(contact, dual)
    # Two open rows part the ends of the cell; of one the diagonals would change places.
    padded = np.pad(~open_, [(2, 0), (0, 0)])
    for cell, axis in ((padded, 1), (np.ascontiguousarray(padded.T), 0)):
        around = winds(cell, dual, axis)
        assert joins_ends(open_, connectivity, (False, True)) != around


def test_helix_on_the_torus_winds_both_ways():
    """A staircase that closes after once around x and twice around y: even windings count too."""
    n = 6
    mask = np.zeros((n, n), bool)
    for step in range(2 * n):
        mask[(step // 2) % n, step % n] = True
        mask[((step + 1) // 2) % n, step % n] = True
    assert winds(mask, "4", axis=0)
    assert winds(mask, "4", axis=1)
    for parted in ([(1, 0), (0, 0)], [(0, 0), (1, 0)]):
        assert not winds(np.pad(mask, parted), "4", axis=1)


@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_sites_wind_at_the_widest_gap_and_not_above_it(representation):
    values = np.random.default_rng(3).random((12, 14))
    gap = GridField(values, (1.0, 1.0), periodic=True)
    connectivity = {"linear": "triangulation", "constant": "4"}[representation]
    for axis in (0, 1):
        height = widest_winding(gap, representation, axis)
        assert winds(values >= height, connectivity, axis)
        assert not winds(values > height, connectivity, axis)


def test_every_point_is_one_site():
    values = np.random.default_rng(1).random((5, 6))
    gap = GridField(values, (1.0, 1.0), periodic=True)
    np.testing.assert_array_equal(periodic_sites(gap, "linear"), values)
    repeated = GridField(gap.vertices(), (1.0, 1.0))
    np.testing.assert_array_equal(periodic_sites(repeated, "linear"), values)
