"""Clusters against the components of the neighbour pairs of `slow_reference`."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from slow_reference import pieces

from fem_seal.film import clusters

CONNECTIVITIES = ("4", "8", "triangulation")
masks = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=9))


@given(masks, st.sampled_from(CONNECTIVITIES), st.tuples(st.booleans(), st.booleans()))
def test_clusters_are_the_components_of_the_neighbour_pairs(mask, connectivity, periodic):
    labels, count = clusters.label(mask, connectivity, periodic)
    expected = pieces(mask, connectivity, periodic)[mask]
    assert np.array_equal(labels > 0, mask)
    assert count == len(np.unique(expected))
    # The two partitions are equal if the pairs of their labels form a one-to-one map.
    assert len(set(zip(labels[mask], expected, strict=True))) == count
    assert set(labels[mask]) == set(range(1, count + 1))


def test_sizes_and_largest():
    mask = np.array([[1, 0, 1, 1], [0, 0, 1, 0], [1, 1, 0, 0]], dtype=bool)
    labels, count = clusters.label(mask, "4")
    assert count == 3
    assert sorted(np.bincount(labels.ravel())[1:]) == [1, 2, 3]
    assert np.array_equal(np.argwhere(clusters.largest(labels, count)), [[0, 2], [0, 3], [1, 2]])
    assert not clusters.largest(*clusters.label(np.zeros((3, 4), bool), "8")).any()
