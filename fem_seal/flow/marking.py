"""Which cells to refine."""

import numpy as np


def doerfler(shares: np.ndarray, theta: float) -> np.ndarray:
    """The fewest cells that together hold a part `theta` of the total (Dörfler 1996).

    Parameters
    ----------
    shares : (C,) ≥ 0 up to rounding
    theta : between 0 and 1

    Returns
    -------
    (C,) bool
    """
    order = np.argsort(shares)[::-1]
    running = np.cumsum(shares[order])
    marked = np.zeros(len(shares), dtype=bool)
    if len(shares) and running[-1] > 0:
        marked[order[: np.searchsorted(running, theta * running[-1]) + 1]] = True
    return marked
