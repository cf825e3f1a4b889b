"""Leak rate from Persson's contact mechanics by the modified Bruggeman medium.

Q = K Δp Ly/Lx, where K solves the equation of `bruggeman` with the local conductivities u³/(12 η)
of gaps u, scattered normally with width s about the gap u1 of the area that opens at each
magnification (`persson`) and folded at u = 0.
"""

import numpy as np

from fem_seal.theory.bruggeman import (
    ELASTIC_THRESHOLD,
    effective_conductivity,
    effective_dimension,
)
from fem_seal.theory.persson import PerssonState, scatter_width

# Samples of each normal distribution in Bruggeman's integral, and its extent in widths s.
SAMPLES = 65
SPREAD = 8.0


def effective_film_conductivity(
    state: PerssonState,
    *,
    viscosity: float,
    threshold: float = ELASTIC_THRESHOLD,
    scatter: str = "almqvist",
) -> float:
    """Film conductivity K of the letter's modified Bruggeman medium for Persson's gaps.

    Parameters
    ----------
    state : PerssonState
    viscosity : float
        η [Pa s].
    threshold : float
        A*/A0; 1/2 gives Bruggeman's own medium.
    scatter : "almqvist" or "afferrante"
        Width of the scatter of the gap, see `persson.SCATTERS`.

    Returns
    -------
    float [m^3/(Pa s)]; exactly 0 where the contact area reaches the threshold. The leak rate is
    K Δp Ly/Lx.

    Raises
    ------
    InvalidInput
        For an unknown scatter or a threshold out of range.
    """
    contact = float(state.area[-1])
    dimension = effective_dimension(contact, threshold)
    s = scatter_width(state, scatter)
    # With z standard normal, |u1 + s z| has the density of the two bells of P(u) together.
    z = np.linspace(-SPREAD, SPREAD, SAMPLES)
    u = np.abs(state.opened_gap[:, None] + s[:, None] * z)
    normal = np.exp(-0.5 * z**2)
    weights = state.opened_area[:, None] * normal / normal.sum()
    if contact >= threshold or not (weights > 0).any():
        return 0.0
    K = effective_conductivity(
        u.ravel() ** 3 / (12 * viscosity),
        weights=weights.ravel(),
        contact=contact,
        dimension=dimension,
        rtol=1e-9,
    )
    return float(K)
