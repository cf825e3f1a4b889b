"""The mean pressure at which a wanted share of the surface touches."""

from dataclasses import replace

import numpy as np

from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.methods import Stopping
from fem_seal.contact.state import ContactState
from fem_seal.errors import NotConverged
from fem_seal.surface.statistics import rms_slope

# Reached where the area counted in samples is this close, relative, or within half a sample.
AREA_TOLERANCE = 1e-3
# While searching: at this certificate the area is right to about 1e-5 of the nominal area.
SEARCH_TOLERANCE = 1e-4
# The area jumps where it passes the wanted one within this share of the pressure.
SMALLEST_STEP = 1e-6
# An area that is still too large at this share of the first guess is that of first touch.
LEAST_PRESSURE = 1e-12
MAX_SOLVES = 100


def pressure_for_area(
    pair: ContactPair,
    area_fraction: float,
    stopping: Stopping,
    start: np.ndarray | None = None,
) -> ContactState:
    """Contact with a prescribed raw area fraction in (0, 1).

    The area counted in samples is a step function of the pressure. The state returned has the
    wanted number of touching samples to 1 part in 1000 or half a sample, whichever is more; where
    the surface jumps over it (equal heights that touch together) the nearer side of the jump.

    The search runs at a loose tolerance and is repeated at the wanted one where it ends at a jump,
    or where the area changes as the state is brought to that tolerance.

    Raises
    ------
    NotConverged
        If a solve does not converge, or 100 solves do not bracket the area.
    """
    search = replace(stopping, tolerance=max(stopping.tolerance, SEARCH_TOLERANCE))
    pressure = _first_guess(pair, area_fraction, start)
    state = _search(pair, area_fraction, search, pressure, start)
    if search.tolerance == stopping.tolerance:
        return state
    iterations = state.iterations
    if _reached(state, area_fraction):
        state = pair.under_pressure(state.mean_pressure, stopping, state.pressure.values)
        iterations += state.iterations
    if not _reached(state, area_fraction):
        start = state.pressure.values
        state = _search(pair, area_fraction, stopping, state.mean_pressure, start)
        iterations += state.iterations
    return replace(state, iterations=iterations)


def _search(
    pair: ContactPair,
    area_fraction: float,
    stopping: Stopping,
    pressure: float,
    start: np.ndarray | None,
) -> ContactState:
    """State with the wanted area, or on the nearer side of a jump; all iterations are counted.

    Solves Y(p) = Y(wanted) for Y = erfinv(A/A0), which Persson's theory has linear in the
    pressure: a secant step inside a bracket, else bisection.
    """
    from scipy.special import erfinv

    wanted = float(erfinv(area_fraction))
    below, above = (0.0, 0.0), (np.inf, np.inf)
    nearest: ContactState | None = None
    least = LEAST_PRESSURE * pressure
    iterations, same_side, was_below = 0, 0, None
    for _ in range(MAX_SOLVES):
        state = pair.under_pressure(pressure, stopping, start)
        iterations += state.iterations
        start = state.pressure.values
        miss = state.contact_area_fraction - area_fraction
        if nearest is None or abs(miss) < abs(nearest.contact_area_fraction - area_fraction):
            nearest = state
        here = (pressure, float(erfinv(state.contact_area_fraction)))
        below, above = (here, above) if miss < 0 else (below, here)
        jump = above[0] - below[0] < SMALLEST_STEP * above[0] or above[0] < least
        if jump or _reached(state, area_fraction):
            return replace(nearest, iterations=iterations)
        same_side = same_side + 1 if was_below == (miss < 0) else 0
        was_below = miss < 0
        pressure = _between(below, above, wanted, same_side)
    raise NotConverged(
        f"contact area fraction {area_fraction} not bracketed by {MAX_SOLVES} solves; the last "
        f"has {state.contact_area_fraction} at {pressure:.6e} Pa"
    )


def _reached(state: ContactState, area_fraction: float) -> bool:
    """Whether the area is the wanted one to 1 part in 1000 or half a sample."""
    within = max(AREA_TOLERANCE * area_fraction, 0.5 / state.contact.size) * (1 + 1e-9)
    return abs(state.contact_area_fraction - area_fraction) <= within


def _first_guess(pair: ContactPair, area_fraction: float, start: np.ndarray | None) -> float:
    """Pressure of the start, else Persson's A/A0 = erf(√2 p / (E* h'rms)) [Pa]."""
    from scipy.special import erfinv

    if start is not None and start.any():
        return float(start.mean())
    strain = float(erfinv(area_fraction)) * rms_slope(pair.height) / 2**0.5
    # A flat surface touches everywhere under any pressure.
    return (strain or 1e-9) * pair.contact_modulus


def _between(
    below: tuple[float, float], above: tuple[float, float], wanted: float, same_side: int
) -> float:
    """Next pressure from the bracket's ends (pressure, Y).

    same_side : how many of the last areas in a row missed on the side of the one before
    """
    if not np.isfinite(above[0]):
        # No upper end yet: along the line from the origin and a little farther, at most fourfold,
        # and farther each time in case the area does not grow.
        least = 1.02**4.0 ** min(same_side, 4)
        return below[0] * min(max(1.02 * wanted / max(below[1], 1e-300), least), 4.0)
    # A secant that misses on one side again and again has met a jump.
    if same_side >= 2 and below[0] == 0:
        return above[0] / 16
    if same_side >= 2 or not np.isfinite(above[1]) or above[1] <= below[1]:
        return (below[0] + above[0]) / 2
    share = (wanted - below[1]) / (above[1] - below[1])
    # Kept off the ends, so that the bracket shrinks from both sides.
    return below[0] + min(max(share, 0.05), 0.95) * (above[0] - below[0])
