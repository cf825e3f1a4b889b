"""Arrays in parts, and sorting small whole numbers by counting, in linear time."""

from collections.abc import Iterator

import numpy as np
from scipy.sparse import csr_matrix


def parts(begin: int, end: int, at_once: int) -> Iterator[slice]:
    """Cut the range from begin to end into slices of `at_once`; the last one may be shorter."""
    return (slice(k, min(k + at_once, end)) for k in range(begin, end, at_once))


def stable_order(keys: np.ndarray, count: int) -> np.ndarray:
    """Indices (n,) int32 that sort `keys`, equal ones in the order given.

    Parameters
    ----------
    keys : (n,) int, 0 ≤ key < count

    Notes
    -----
    SciPy turns a matrix stored by rows into one stored by columns by counting; with one entry a
    row, in the column of its key, the row numbers then stand in the order wanted.
    """
    n = len(keys)
    ones, starts = np.ones(n, dtype=np.int8), np.arange(n + 1, dtype=np.int32)
    by_row = csr_matrix((ones, np.asarray(keys, dtype=np.int32), starts), shape=(n, count))
    return by_row.tocsc().indices
