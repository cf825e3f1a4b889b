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
from fem_seal.theory.persson import PerssonState

# Bruggeman's integral over a normal distribution: its extent in widths s, and its points
# z = z0 ± FINEST sinh v, with STEPS equal steps of v on either side of the gap u = 0. Near closing
# the narrowest gaps decide: of points at equal distances 65 erred by a factor of 3, 257 by a tenth.
SPREAD = 8.0
FINEST = 1e-6
STEPS = 100


def effective_film_conductivity(
    state: PerssonState,
    *,
    viscosity: float,
    threshold: float = ELASTIC_THRESHOLD,
) -> float:
    """Film conductivity K [m³/(Pa s)] of the letter's modified Bruggeman medium for Persson's gaps.

    Exactly 0 where the contact area reaches the threshold A*/A0; 1/2 gives Bruggeman's own medium.
    The leak rate is K Δp Ly/Lx.
    """
    contact = float(state.area[-1])
    dimension = effective_dimension(contact, threshold)
    s = state.unseen_rms
    # With z standard normal, |u1 + s z| has the density of the two bells of P(u) together.
    z, normal = _normal(-state.opened_gap / np.maximum(s, np.finfo(float).tiny))
    u = np.abs(state.opened_gap[:, None] + s[:, None] * z)
    weights = state.opened_area[:, None] * normal
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


def _normal(centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points z and weights of the standard normal distribution, graded towards a centre each."""
    z0 = np.clip(centre, -SPREAD, SPREAD)[:, None]
    v = np.linspace(-1, 1, 2 * STEPS + 1) * np.arcsinh(2 * SPREAD / FINEST)
    z = z0 + FINEST * np.sinh(v)
    weights = np.exp(-0.5 * z**2) * np.cosh(v)
    return z, weights / weights.sum(axis=1, keepdims=True)
