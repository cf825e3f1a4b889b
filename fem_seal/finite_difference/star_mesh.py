"""Elimination of nodes from networks of resistors without a subtraction.

Eliminating a node turns the star of its links c_a into a mesh: every two neighbours a, b gain a
link c_a c_b / sum(c). Only positive numbers are added, multiplied and divided, nothing is ever
subtracted, so that every link keeps its relative accuracy whatever the contrast: the rule of
W. K. Grassmann, M. I. Taksar and D. P. Heyman, Oper. Res. 33, 1107 (1985), whose entrywise error
bound is due to C. A. O'Cinneide, Numer. Math. 65, 109 (1993).
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

# Nodes eliminated together; their joint effect on the others is one matrix product.
PANEL = 128
# Within a panel, nodes eliminated one by one before the next ones hear of them.
FEW = 4
# Side of the blocks updated together; blocks below the diagonal are mirrored instead.
BLOCK = 256


def star_mesh(links: np.ndarray, eliminated: int) -> np.ndarray:
    """Eliminate the leading nodes of resistor networks.

    Parameters
    ----------
    links : (batch, N, N) float, >= 0
        Symmetric conductances; the diagonals are never read. Overwritten.
    eliminated : number of leading nodes to eliminate

    Returns
    -------
    (batch, N - eliminated, N - eliminated) float; a view into `links`.
    """
    size = links.shape[1]
    for start in range(0, eliminated, PANEL):
        stop = min(start + PANEL, eliminated)
        width = stop - start
        rows = links[:, start:stop, start:].copy()
        shares = np.zeros_like(rows)
        _eliminate_panel(rows, shares, 0, width)
        columns = np.ascontiguousarray(rows[:, :, width:].transpose(0, 2, 1))
        for top, bottom in _blocks(stop, size):
            upper = columns[:, top - stop : bottom - stop]
            for left, right in _blocks(top, size):
                links[:, top:bottom, left:right] += (
                    upper @ shares[:, :, left - start : right - start]
                )
    for top, bottom in _blocks(eliminated, size):
        links[:, bottom:, top:bottom] = links[:, top:bottom, bottom:].transpose(0, 2, 1)
    return links[:, eliminated:, eliminated:]


def _eliminate_panel(rows: np.ndarray, shares: np.ndarray, first: int, last: int) -> None:
    """Eliminate nodes first..last of a panel, halves of many, one by one if few.

    Parameters
    ----------
    rows : (batch, width, N) links of the panel's nodes to themselves and all that come after;
        those from `first` on know of all nodes before. Updated up to `last`.
    shares : (batch, width, N) links over the sum of their row, zero where not read; filled
    """
    if last - first > FEW:
        middle = (first + last) // 2
        _eliminate_panel(rows, shares, first, middle)
        seen = np.ascontiguousarray(rows[:, first:middle, middle:last].transpose(0, 2, 1))
        rows[:, middle:last, middle:] += seen @ shares[:, first:middle, middle:]
        _eliminate_panel(rows, shares, middle, last)
        return
    for a in range(first, last):
        own = rows[:, a, a + 1 :]
        total = own.sum(axis=1, keepdims=True)
        np.divide(own, total, out=shares[:, a, a + 1 :], where=total > 0)
        for b in range(a + 1, last):
            rows[:, b, b + 1 :] += own[:, b - a - 1, None] * shares[:, a, b + 1 :]


def star_mesh_in_step(links: np.ndarray, eliminated: int) -> np.ndarray:
    """Eliminate the leading nodes of many small networks, one node of all of them at a time.

    Parameters
    ----------
    links : (N, N, batch) float, >= 0, as in `star_mesh`

    Returns
    -------
    (N - eliminated, N - eliminated, batch) float; a view into `links`.
    """
    for a in range(eliminated):
        own = links[a, a + 1 :]
        total = own.sum(axis=0)
        shares = np.divide(own, total, out=np.zeros_like(own), where=total > 0)
        for b in range(len(own) - 1):
            links[a + 1 + b, a + 2 + b :] += own[b] * shares[b + 1 :]
    left = links[eliminated:, eliminated:]
    for a in range(len(left) - 1):
        left[a + 1 :, a] = left[a, a + 1 :]
    return left


def _blocks(start: int, stop: int) -> Iterator[tuple[int, int]]:
    """Cut start..stop into blocks of columns, for work on the upper triangle alone.

    Blocks end at multiples of BLOCK wherever they start: a diagonal block is then updated as a
    whole at every step, and what lies below the diagonal blocks is what has to be mirrored.
    """
    edges = [start, *range(start // BLOCK * BLOCK + BLOCK, stop, BLOCK), stop]
    yield from pairwise(edges)
