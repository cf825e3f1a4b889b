"""Clusters against a flood fill over the neighbour pairs of `slow_reference`."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from slow_reference import edges

from fem_seal.film import clusters

CONNECTIVITIES = ("4", "8", "triangulation")
masks = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=9))


def flood_fill(mask, connectivity, periodic):
    """Labels and their number, as `clusters.label` defines them."""
    neighbours = {}
    for a, b in edges(mask.shape, connectivity, periodic):
        if mask[a] and mask[b]:
            neighbours.setdefault(a, []).append(b)
            neighbours.setdefault(b, []).append(a)
    labels = np.zeros(mask.shape, dtype=int)
    count = 0
    for start in zip(*np.nonzero(mask), strict=True):
        if labels[start]:
            continue
        count += 1
        labels[start] = count
        stack = [start]
        while stack:
            for site in neighbours.get(stack.pop(), []):
                if not labels[site]:
                    labels[site] = count
                    stack.append(site)
    return labels, count


@given(masks, st.sampled_from(CONNECTIVITIES), st.tuples(st.booleans(), st.booleans()))
def test_labels_are_those_of_a_flood_fill(mask, connectivity, periodic):
    labels, count = clusters.label(mask, connectivity, periodic)
    expected, expected_count = flood_fill(mask, connectivity, periodic)
    assert count == expected_count
    assert np.array_equal(labels > 0, mask)
    # The two partitions are equal if the pairs of their labels form a one-to-one map.
    pairs = {pair for pair in zip(labels.ravel(), expected.ravel(), strict=True) if pair[0]}
    assert len(pairs) == count
    assert set(labels.ravel()) - {0} == set(range(1, count + 1))


@given(masks)
def test_more_neighbours_never_make_more_clusters(mask):
    counts = [clusters.label(mask, c)[1] for c in ("4", "triangulation", "8")]
    assert counts == sorted(counts, reverse=True)


@given(masks, st.sampled_from(CONNECTIVITIES))
def test_transposed_mask_has_the_same_clusters(mask, connectivity):
    assert (
        clusters.label(mask, connectivity)[1]
        == clusters.label(np.ascontiguousarray(mask.T), connectivity)[1]
    )


def test_sizes_and_largest():
    mask = np.array([[1, 0, 1, 1], [0, 0, 1, 0], [1, 1, 0, 0]], dtype=bool)
    labels, count = clusters.label(mask, "4")
    assert count == 3
    assert sorted(np.bincount(labels.ravel())[1:]) == [1, 2, 3]
    assert np.array_equal(np.argwhere(clusters.largest(labels, count)), [[0, 2], [0, 3], [1, 2]])


def test_an_empty_mask_has_no_largest_cluster():
    labels, count = clusters.label(np.zeros((3, 4), bool), "8")
    assert count == 0
    assert not clusters.largest(labels, count).any()
