"""Marking: the choice of cells to refine, from their error indicators."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Marks:
    """Marked cells of a mesh of C cells.

    Attributes
    ----------
    times : (C,) int8
        How often each cell is to be halved.
    least_indicator : float
        Smallest error indicator of a marked cell; infinite if none is marked.
    least_flux : float
        Smallest flux through a marked blocked cell; infinite if none is marked.
    """

    times: np.ndarray
    least_indicator: float
    least_flux: float


def doerfler(indicators: np.ndarray, theta: float) -> np.ndarray:
    """Mark the fewest cells that hold a part `theta` of the sum of the indicators (Dörfler 1996).

    At least one cell is marked if any indicator is positive.

    Parameters
    ----------
    indicators : (C,) float
        Error indicators, >= 0 up to rounding.
    theta : float
        Part of the sum, between 0 and 1.

    Returns
    -------
    (C,) bool
        Marked cells.
    """
    marked = np.zeros(len(indicators), dtype=bool)
    total = indicators.sum(where=indicators > 0)
    # Cells below 1 - θ of the mean hold less than 1 - θ of the sum, so only the others need
    # sorting.
    candidates = np.flatnonzero(indicators > (1 - theta) * total / max(len(indicators), 1))
    # A stable sort, so that all processes of a run mark the same cells.
    order = candidates[np.argsort(-indicators[candidates], kind="stable")]
    enough = np.searchsorted(np.cumsum(indicators[order]), theta * total)
    marked[order[: enough + 1]] = True
    return marked


def completed(marked: np.ndarray, indicators: np.ndarray, required: float) -> np.ndarray:
    """The fewest cells (C,) bool to add to `marked`, so that all hold the sum `required`."""
    rest = np.where(marked, 0.0, indicators)
    missing = required - (indicators.sum() - rest.sum())
    if missing <= 0:
        return np.zeros(len(marked), dtype=bool)
    return doerfler(rest, missing / rest.sum())


def halvings(indicators: np.ndarray, marked: np.ndarray, most: int = 4) -> np.ndarray:
    """How often to halve each cell (C,) before the next solve; 0 if it is not marked.

    Where the solution is smooth, half a cell has a quarter of its indicator. A cell with 4^k times
    the smallest marked indicator would be marked k more times, and is halved k times at once. This
    gains most at singular corners, where the indicators fall more slowly.
    """
    times = marked.astype(int)
    if marked.any():
        ratio = np.log(indicators[marked] / indicators[marked].min()) / np.log(4)
        times[marked] = np.clip(np.floor(ratio), 1, most)
    return times
