"""Slices of large arrays, components of graphs, and a stable sort of integers in linear time."""

from collections.abc import Iterator

import numpy as np
from scipy.sparse import coo_array, csr_matrix
from scipy.sparse.csgraph import connected_components


def parts(begin: int, end: int, at_once: int) -> Iterator[slice]:
    """Cut the range from begin to end into slices of `at_once`; the last one may be shorter."""
    return (slice(k, min(k + at_once, end)) for k in range(begin, end, at_once))


def components(pairs: np.ndarray, count: int) -> np.ndarray:
    """Component number (count,) of each node of the graph with edges `pairs` (n, 2)."""
    graph = coo_array((np.ones(len(pairs), dtype=np.int8), tuple(pairs.T)), shape=(count, count))
    # Flag the matrix as canonical: SciPy then skips a sort that connected_components does not need.
    graph.has_canonical_format = True
    return connected_components(graph, directed=False)[1]


def stable_order(keys: np.ndarray, count: int) -> np.ndarray:
    """Indices (n,) int32 that sort keys (n,), 0 ≤ key < count; equal keys keep their order.

    Row i of a sparse matrix has its single entry in column keys[i]. SciPy converts it from row to
    column storage by a counting sort, which lists the rows by their keys.
    """
    n = len(keys)
    ones, starts = np.ones(n, dtype=np.int8), np.arange(n + 1, dtype=np.int32)
    by_row = csr_matrix((ones, np.asarray(keys, dtype=np.int32), starts), shape=(n, count))
    return by_row.tocsc().indices
