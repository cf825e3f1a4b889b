"""Which cells to refine."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Marks:
    """Which cells of a mesh to halve.

    times : (C,) int8, how often
    least_share, least_flow : smallest share and throughflow of a marked cell, infinite if there
        was none
    """

    times: np.ndarray
    least_share: float
    least_flow: float


def doerfler(shares: np.ndarray, theta: float) -> np.ndarray:
    """The fewest cells that together hold a part `theta` of the total (Dörfler 1996).

    One at least, if any share is above zero.

    Parameters
    ----------
    shares : (C,) ≥ 0 up to rounding
    theta : between 0 and 1

    Returns
    -------
    (C,) bool
    """
    marked = np.zeros(len(shares), dtype=bool)
    total = shares.sum(where=shares > 0)
    # Cells below 1 - θ of the mean hold less than 1 - θ of the total: the others need no more.
    some = np.flatnonzero(shares > (1 - theta) * total / max(len(shares), 1))
    # Equal shares keep their order, on every machine of a run the same.
    order = some[np.argsort(-shares[some], kind="stable")]
    enough = np.searchsorted(np.cumsum(shares[order]), theta * total)
    marked[order[: enough + 1]] = True
    return marked


def completed(marked: np.ndarray, shares: np.ndarray, theta: float) -> np.ndarray:
    """The fewest cells (C,) bool to add to `marked` so that all hold `theta` of the shares (C,)."""
    rest = np.where(marked, 0.0, shares)
    missing = theta * shares.sum() - (shares.sum() - rest.sum())
    if missing <= 0:
        return np.zeros(len(marked), dtype=bool)
    return doerfler(rest, missing / rest.sum())


def halvings(shares: np.ndarray, marked: np.ndarray, most: int = 4) -> np.ndarray:
    """How often each marked cell (C,) is to be halved before the next solve, 0 if not marked.

    Where the solution is smooth a half has a quarter of the share of the whole, so that a cell of
    4^k times the smallest marked share would be marked k more times: it is halved k times at
    once. Singular corners, where shares fall much more slowly, gain the most.
    """
    times = marked.astype(int)
    if marked.any():
        ratio = np.log(shares[marked] / shares[marked].min()) / np.log(4)
        times[marked] = np.clip(np.floor(ratio), 1, most)
    return times
