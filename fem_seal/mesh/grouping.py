"""Sorting small whole numbers by counting, in linear time.

Meshes are built anew on every level, and most of that work is finding equal numbers.
"""

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


def consecutive(labels: np.ndarray, count: int) -> tuple[np.ndarray, int]:
    """Renumber labels (n,) < count to 0, 1, ... (int32) in their order; returns how many, too."""
    used = np.zeros(count, dtype=bool)
    used[labels] = True
    number = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return number[labels], int(np.count_nonzero(used))


def halves_of(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Halves of triangles that share nothing.

    Their vertices are all first corners, all second, all third, and the middles of the first sides.

    Returns
    -------
    (2 count, 3) int32, all halves (middle, a, b) and then all (middle, c, a)
    (count, 2) int32, the corners each middle lies between
    """
    a, b, c, middle = np.arange(4 * count, dtype=np.int32).reshape(4, -1)
    first, second = np.stack([middle, a, b], axis=1), np.stack([middle, c, a], axis=1)
    return np.concatenate([first, second]), np.stack([b, c], axis=1)
