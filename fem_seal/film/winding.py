"""Widest path around a periodic cell.

Its tightest gap is the largest h at which the sites with g >= h wind around the cell, the periodic
counterpart of `film.constriction`; bisection over the values of the samples finds it.
"""

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.film.lattice import OPEN_CONNECTIVITY
from fem_seal.film.percolation import winds
from fem_seal.film.widest_path import highest_spanning
from fem_seal.grid import GridField
from fem_seal.registry import require_known


def periodic_sites(gap: GridField, representation: str) -> np.ndarray:
    """Gap at the sites of a cell that is periodic in both directions; every point is one site.

    Parameters
    ----------
    gap : gap [m], zero in contact
    representation : "linear" or "constant"

    Returns
    -------
    (nx, ny) float [m]
    """
    require_known(OPEN_CONNECTIVITY, representation, "representation")
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
    """Tightest gap of the widest closed path that goes around the cell along an axis.

    Parameters
    ----------
    gap : gap [m], zero in contact, periodic in both directions
    representation : "linear" or "constant"
    axis : 0 or 1

    Returns
    -------
    float [m]; 0 if the open part of the gap does not wind around the cell along this axis.
    """
    sites = periodic_sites(gap, representation)
    connectivity = OPEN_CONNECTIVITY[representation]
    return highest_spanning(sites[sites > 0], lambda h: winds(sites >= h, connectivity, axis))
