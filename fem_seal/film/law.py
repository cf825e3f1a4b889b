"""The law of the film: what the fluid makes of a gap.

The volume flux per width [m²/s] through a gap g under a pressure gradient is j = -K ∇p.
"""

from typing import TypeVar

import numpy as np

Gap = TypeVar("Gap", float, np.float64, np.ndarray)


def film_conductivity(gap: Gap, viscosity: float) -> Gap:
    """Film conductivity K = g³/(12 η) of a Newtonian fluid between parallel walls (Reynolds 1886).

    Parameters
    ----------
    gap : float, array or UFL expression [m]
    viscosity : float
        η [Pa s].

    Returns
    -------
    as `gap` [m³/(Pa s)]
    """
    return gap**3 / (12 * viscosity)
