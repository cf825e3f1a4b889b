"""The mean pressure at which a wanted share of the surface touches."""

from dataclasses import replace

import numpy as np

from fem_seal.contact.interface import Interface
from fem_seal.contact.methods import Stopping
from fem_seal.contact.state import ContactState
from fem_seal.errors import NotConverged
from fem_seal.surface.statistics import rms_slope

# Reached where the area counted in samples is this close, relative, or within half a sample.
AREA_TOLERANCE = 1e-3
# While searching: at this certificate the area is right to about 1e-5 of the nominal area.
SEARCH_TOLERANCE = 1e-4
# A jump of the area within this share of the first guess of the pressure is the surface's own.
SMALLEST_STEP = 1e-6
MAX_SOLVES = 60


def pressure_for_area(
    interface: Interface,
    area_fraction: float,
    stopping: Stopping,
    start: np.ndarray | None = None,
) -> ContactState:
    """Contact with a given raw area fraction in (0, 1).

    The area counted in samples is a step function of the pressure. The state returned has the
    wanted number of touching samples to 1 part in 1000 or half a sample, whichever is more; where
    the surface jumps over it (equal heights that touch together) the nearer side of the jump.

    The search is for the zero of Y(p) - Y(wanted) with Y = erfinv(A/A0), which Persson's theory
    has linear in the pressure: a secant step inside a bracket, else bisection.

    Raises
    ------
    NotConverged
        If a solve does not converge, or 60 solves do not bracket the area.
    """
    from scipy.special import erfinv

    samples = interface.heights.size
    within = max(AREA_TOLERANCE * area_fraction, 0.5 / samples) * (1 + 1e-9)
    rough = replace(stopping, tolerance=max(stopping.tolerance, SEARCH_TOLERANCE))
    wanted = float(erfinv(area_fraction))
    below, above = (0.0, 0.0), (np.inf, np.inf)
    nearest: ContactState | None = None
    pressure = _first_guess(interface, wanted, start)
    smallest_step = SMALLEST_STEP * pressure
    iterations, same_side, was_below = 0, 0, None
    for _ in range(MAX_SOLVES):
        state = interface.under_pressure(pressure, rough, start)
        iterations += state.iterations
        start = state.pressure.values
        miss = state.contact_area_fraction - area_fraction
        if nearest is None or abs(miss) < abs(nearest.contact_area_fraction - area_fraction):
            nearest = state
        here = (pressure, float(erfinv(state.contact_area_fraction)))
        below, above = (here, above) if miss < 0 else (below, here)
        jump = above[0] - below[0] < smallest_step
        if abs(miss) <= within or jump:
            return _polished(interface, nearest, stopping, rough, iterations)
        same_side = same_side + 1 if was_below == (miss < 0) else 0
        was_below = miss < 0
        pressure = _between(below, above, wanted, bisect=same_side >= 2)
    raise NotConverged(
        f"contact area fraction {area_fraction} not bracketed by {MAX_SOLVES} solves; the last "
        f"has {state.contact_area_fraction} at {pressure:.6e} Pa"
    )


def _first_guess(interface: Interface, wanted: float, start: np.ndarray | None) -> float:
    """Pressure of the start, else Persson's A/A0 = erf(√2 p / (E* h'rms)) [Pa]."""
    if start is not None and start.any():
        return float(start.mean())
    slope = rms_slope(interface.height)
    # A flat surface touches everywhere under any pressure.
    return (wanted * slope / 2**0.5 or 1e-9) * interface.contact_modulus


def _between(
    below: tuple[float, float], above: tuple[float, float], wanted: float, bisect: bool
) -> float:
    """Next pressure from the bracket's ends (pressure, Y)."""
    if not np.isfinite(above[0]):
        # Yet unbounded: straight on from the origin, a little further, at most fourfold.
        return below[0] * min(max(1.02 * wanted / max(below[1], 1e-300), 1.02), 4.0)
    # A secant that keeps hitting one side has met a jump.
    if bisect or not np.isfinite(above[1]) or above[1] <= below[1]:
        return (below[0] + above[0]) / 2
    share = (wanted - below[1]) / (above[1] - below[1])
    # Kept off the ends, so that the bracket shrinks from both sides.
    return below[0] + min(max(share, 0.05), 0.95) * (above[0] - below[0])


def _polished(
    interface: Interface,
    state: ContactState,
    stopping: Stopping,
    rough: Stopping,
    iterations: int,
) -> ContactState:
    """Bring the found state to the tolerance wanted, and count the whole search."""
    if stopping.tolerance < rough.tolerance:
        state = interface.under_pressure(state.mean_pressure, stopping, state.pressure.values)
        iterations += state.iterations
    return replace(state, iterations=iterations)
