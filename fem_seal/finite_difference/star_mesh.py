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
PANEL = 32
# Columns updated together; blocks below the diagonal are mirrored instead.
COLUMNS = 256


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
        for a in range(width):
            total = rows[:, a, a + 1 :].sum(axis=1, keepdims=True)
            np.divide(rows[:, a, a + 1 :], total, out=shares[:, a, a + 1 :], where=total > 0)
            rows[:, a + 1 :] += rows[:, a, a + 1 : width, None] * shares[:, a, None]
        columns = np.ascontiguousarray(rows[:, :, width:].transpose(0, 2, 1))
        for left, right in _blocks(stop, size):
            links[:, stop:right, left:right] += (
                columns[:, : right - stop] @ shares[:, :, left - start : right - start]
            )
    for left, right in _blocks(eliminated, size):
        links[:, right:, left:right] = links[:, left:right, right:].transpose(0, 2, 1)
    return links[:, eliminated:, eliminated:]


def _blocks(start: int, stop: int) -> Iterator[tuple[int, int]]:
    """Cut start..stop into blocks of columns, for work on the upper triangle alone.

    Blocks end at multiples of COLUMNS wherever they start: a diagonal block is then updated as a
    whole at every step, and what lies below the diagonal blocks is what has to be mirrored.
    """
    edges = [start, *range(start // COLUMNS * COLUMNS + COLUMNS, stop, COLUMNS), stop]
    yield from pairwise(edges)
