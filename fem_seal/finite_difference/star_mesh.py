"""Elimination of nodes from networks of resistors without a subtraction.

Eliminating a node turns the star of its links c_a into a mesh: any two of its neighbours a, b gain
a link

    c_ab += c_a c_b / Σ_e c_e.

Positive numbers are added, multiplied and divided, but not subtracted: every link keeps its
relative accuracy at any contrast. This is the elimination of W. K. Grassmann, M. I. Taksar and
D. P. Heyman, Oper. Res. 33, 1107 (1985); its entrywise error bound is due to C. A. O'Cinneide,
Numer. Math. 65, 109 (1993).
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

# Number of nodes eliminated together; one matrix product then updates the links of all others.
PANEL = 128
# Up to this many nodes of a panel are eliminated one by one, more in two halves.
ONE_BY_ONE = 4
# Side of the blocks in which the matrix of links is updated; blocks below the diagonal are copied
# from those above it.
BLOCK = 256


def star_mesh(links: np.ndarray, eliminated: int) -> np.ndarray:
    """Eliminate the leading nodes of resistor networks; returns the links between the others.

    `links` (batch, N, N) are symmetric conductances >= 0; the diagonals are never read. They are
    overwritten, and the result is a view.
    """
    size = links.shape[1]
    for start in range(0, eliminated, PANEL):
        stop = min(start + PANEL, eliminated)
        width = stop - start
        rows = links[:, start:stop, start:].copy()
        ratios = np.zeros_like(rows)
        _eliminate_panel(rows, ratios, 0, width)
        columns = np.ascontiguousarray(rows[:, :, width:].transpose(0, 2, 1))
        for top, bottom in _blocks(stop, size):
            upper = columns[:, top - stop : bottom - stop]
            for left, right in _blocks(top, size):
                links[:, top:bottom, left:right] += (
                    upper @ ratios[:, :, left - start : right - start]
                )
    for top, bottom in _blocks(eliminated, size):
        links[:, bottom:, top:bottom] = links[:, top:bottom, bottom:].transpose(0, 2, 1)
    return links[:, eliminated:, eliminated:]


def _eliminate_panel(rows: np.ndarray, ratios: np.ndarray, first: int, last: int) -> None:
    """Eliminate the nodes `first` to `last` - 1 of a panel: in two halves, or one by one if few.

    `rows` (batch, width, N) are the links of its nodes to one another and to all later ones. Those
    from `first` on include the effect of all nodes before; those up to `last` are updated. `ratios`
    (batch, width, N) become links c_a over the sum of their star at its elimination.
    """
    if last - first > ONE_BY_ONE:
        middle = (first + last) // 2
        _eliminate_panel(rows, ratios, first, middle)
        columns = np.ascontiguousarray(rows[:, first:middle, middle:last].transpose(0, 2, 1))
        rows[:, middle:last, middle:] += columns @ ratios[:, first:middle, middle:]
        _eliminate_panel(rows, ratios, middle, last)
        return
    for a in range(first, last):
        star = rows[:, a, a + 1 :]
        total = star.sum(axis=1, keepdims=True)
        np.divide(star, total, out=ratios[:, a, a + 1 :], where=total > 0)
        for b in range(a + 1, last):
            rows[:, b, b + 1 :] += star[:, b - a - 1, None] * ratios[:, a, b + 1 :]


def _blocks(start: int, stop: int) -> Iterator[tuple[int, int]]:
    """Cut the range from start to stop into blocks, to update the upper triangle only.

    Blocks end at multiples of BLOCK wherever the range starts: the diagonal blocks are then the
    same at every step, and are always updated as a whole.
    """
    edges = [start, *range(start // BLOCK * BLOCK + BLOCK, stop, BLOCK), stop]
    yield from pairwise(edges)
