"""Leak rates from Persson's contact mechanics: Bruggeman's medium and the critical junction."""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.theory.bruggeman import (
    ELASTIC_THRESHOLD,
    effective_conductivity,
    effective_dimension,
)
from fem_seal.theory.persson import Interface, scatter_width

# Points of each normal distribution in Bruggeman's integral, and its extent in widths.
SAMPLES = 65
SPREAD = 8.0


@dataclass(frozen=True)
class CriticalJunction:
    """The last constriction a percolating channel passes, in Persson's picture.

    q : wavenumber seen when the open area percolates [1/m]
    gap : mean gap u1 of what opens there [m]
    conductance : gap³/(12 η), of one square constriction [m^3/(Pa s)]
    """

    q: float
    gap: float
    conductance: float


def critical_junction(
    state: Interface, *, viscosity: float, threshold: float = ELASTIC_THRESHOLD
) -> CriticalJunction | None:
    """Estimate the leak rate's order of magnitude: Q ≈ Δp u1(ζ_c)³ / (12 η), A(ζ_c) = A*.

    B. N. J. Persson and C. Yang, J. Phys.: Condens. Matter 20, 315011 (2008). A nominal contact
    of Ly/Lx squares has as many of them side by side.

    Parameters
    ----------
    state : from `persson.interface`
    viscosity : [Pa s]
    threshold : A*/A0 at which contact percolates

    Returns
    -------
    CriticalJunction, or None where the contact percolates at every magnification: sealed.

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
    state: Interface,
    *,
    viscosity: float,
    threshold: float = ELASTIC_THRESHOLD,
    scatter: str = "almqvist",
) -> float:
    """Film conductivity by the letter's modified Bruggeman medium on Persson's gap distribution.

    Parameters
    ----------
    state : from `persson.interface`
    viscosity : [Pa s]
    threshold : A*/A0; 1/2 gives Bruggeman's own medium
    scatter : one of `persson.SCATTERS`

    Returns
    -------
    K [m^3/(Pa s)]; the leak rate is K Δp Ly/Lx. Exactly 0 where the contact area reaches the
    threshold.

    Raises
    ------
    InvalidInput
        For an unknown scatter or a threshold out of range.
    """
    contact = float(state.area[-1])
    dimension = effective_dimension(contact, threshold)
    s = scatter_width(state, scatter)
    # |u1 + s z| with z normal is distributed as the two bells of P(u) together.
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
