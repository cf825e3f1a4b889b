"""The widest ways around a periodic cell."""

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.topology.lattice import OPEN_CONNECTIVITY, choose
from fem_seal.topology.percolation import winds


def periodic_sites(gap: GridField, representation: str) -> np.ndarray:
    """Gap at each site of a cell that is periodic in both directions, every point once.

    Parameters
    ----------
    gap : gap [m]
    representation : "linear" or "constant"

    Returns
    -------
    (nx, ny) [m]

    Raises
    ------
    InvalidInput
        If the gap is not periodic.
    """
    choose(OPEN_CONNECTIVITY, representation, "representation")
    if gap.periodic:
        return gap.values
    values = gap.values
    repeats = np.array_equal(values[0], values[-1]) and np.array_equal(values[:, 0], values[:, -1])
    if representation == "linear" and repeats and min(values.shape) > 1:
        return values[:-1, :-1]
    raise InvalidInput(
        "a conductivity tensor needs a gap that is periodic in both directions: set periodic on it "
        "or repeat the first row and column of a linear gap at its end"
    )


def widest_winding(gap: GridField, representation: str, axis: int) -> float:
    """Height of the highest plate that can be carried around the cell along an axis [m].

    Parameters
    ----------
    gap : gap [m], periodic in both directions
    representation : "linear" or "constant"
    axis : 0 or 1

    Returns
    -------
    float; 0 if the open part of the gap does not wind around that way.
    """
    sites = periodic_sites(gap, representation)
    connectivity = OPEN_CONNECTIVITY[representation]
    heights = np.unique(sites[sites > 0])
    below, above = -1, len(heights)
    while above - below > 1:
        middle = (below + above) // 2
        if winds(sites >= heights[middle], connectivity, axis):
            below = middle
        else:
            above = middle
    return float(heights[below]) if below >= 0 else 0.0
