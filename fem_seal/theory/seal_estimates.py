"""Leak rates from Persson's contact mechanics: critical junction and modified Bruggeman medium.

The critical junction gives the order of magnitude of the leak rate of a square,

    Q ≈ Δp u1(ζ_c)³ / (12 η)    with    A(ζ_c) = A*,

and the effective medium Q = K Δp Ly/Lx, where K solves the equation of `bruggeman` with local
conductivities u³/(12 η) of gaps u that have the density P(u) of `persson`.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.theory.bruggeman import (
    ELASTIC_THRESHOLD,
    effective_conductivity,
    effective_dimension,
)
from fem_seal.theory.persson import PerssonState, scatter_width

# Samples of each normal distribution in Bruggeman's integral, and its extent in widths s.
SAMPLES = 65
SPREAD = 8.0


@dataclass(frozen=True)
class CriticalJunction:
    """The tightest constriction of the first channel that percolates, in Persson's theory.

    Attributes
    ----------
    q : float
        Wavenumber ζ_c q0 at whose resolution the open area percolates [1/m].
    gap : float
        Mean gap u1(ζ_c) of the area that opens there [m].
    conductance : float
        u1³/(12 η) of one square constriction [m^3/(Pa s)].
    """

    q: float
    gap: float
    conductance: float


def critical_junction(
    state: PerssonState, *, viscosity: float, threshold: float = ELASTIC_THRESHOLD
) -> CriticalJunction | None:
    """Critical junction, which gives the order of magnitude of the leak rate.

    B. N. J. Persson and C. Yang, J. Phys.: Condens. Matter 20, 315011 (2008). A nominal contact of
    Ly/Lx squares has Ly/Lx such junctions side by side.

    Parameters
    ----------
    state : PerssonState
    viscosity : float
        η [Pa s].
    threshold : float
        A*/A0 at which contact percolates.

    Returns
    -------
    CriticalJunction, or None if contact percolates at full resolution: the seal is tight.

    Raises
    ------
    InvalidInput
        If the threshold is not in (0, 1).
    """
    if not 0 < threshold < 1:
        raise InvalidInput(f"the percolation threshold must lie in (0, 1), got {threshold}")
    if state.area[-1] >= threshold:
        return None
    # The first step of magnification that ends below the threshold holds the critical junction.
    step = int(np.argmax(state.area[1:] < threshold))
    above, below = state.area[step], state.area[step + 1]
    part = (above - threshold) / (above - below)
    q = state.q[step] ** (1 - part) * state.q[step + 1] ** part
    gap = float(state.opened_gap[step])
    return CriticalJunction(float(q), gap, gap**3 / (12 * viscosity))


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
