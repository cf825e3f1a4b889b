"""The mean pressure at which a prescribed fraction of the samples is in contact.

Solves Y(p) = Y0 for Y = erfinv(A/A0), which is linear in the pressure by Persson's theory
A/A0 = erf(√2 p / (E* h'rms)). Each trial pressure is the last one times Y0/Y. A trial ends as soon
as the certificate is so far below the miss of the area that the side of the miss is known: the
certificate, in units of the rms height, is about the relative error of the area. The next trial
starts with a uniform pressure more, or less, on the samples that touch. If the trials do not reach
the area, as where it jumps, Brent's method on converged contacts follows.
"""

from dataclasses import replace
from functools import cache

import numpy as np

from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.methods import ContactStopping, iterates
from fem_seal.contact.state import ContactState
from fem_seal.errors import NotConverged, present
from fem_seal.surface.statistics import rms_slope

# Relative tolerance of the area; half a sample is accepted in any case.
AREA_TOLERANCE = 1e-3
# Certificate below which no trial goes on: the area has its final value to AREA_TOLERANCE.
SEARCH_TOLERANCE = 1e-3
# A trial ends when the area's relative miss is this many times the certificate. On 512² samples,
# 1 to 40 % of contact, the search takes 1.1 to 1.5 times the transforms of one solve at the final
# pressure; with 2 up to 1.7 times, with 10 up to 1.5 times.
SIDE_KNOWN = 5
# The first iterates touch nearly everywhere: no trial ends above this certificate.
TRIAL_CERTIFICATE = 0.1
MOST_TRIALS = 8
# Relative width of the pressure bracket at which the area is taken to jump over the target.
SMALLEST_STEP = 1e-6
# Both over the pressure at which the search begins. Where the area is too large even at the least
# one, the search returns the contact with the nearest area; above the highest one it gives up.
LEAST_PRESSURE, HIGHEST_PRESSURE = 1e-12, 1e12
# Halving takes 82 iterations between both; Brent's method takes at most the square of that.
MOST_SEARCHED = 6800
# Least and largest ratio of a trial pressure to the last one: far from the area Y is not linear,
# and it is 0 where nothing touches.
LEAST_FACTOR, MOST_FACTOR = 1 / 16, 4.0
# A bracket goes so far beyond the pressure at which Y, if it were linear, would be reached.
BEYOND = 1.02
MOST_AREA = 1 - 1e-9  # above it Y, which is infinite where all samples touch, is that of this area
ROUNDING = 1e-9  # of a count of samples over their number, relative
# First pressure over that of Persson's area law, at light load. At light load the law's area is 1.6
# times p/(E* h'rms), that of simulations 2.1 to 2.2 times, and that of the samples that touch,
# which are counted whole, up to 3 times.
FIRST_GUESS = 0.7


def contact_of_area(
    pair: ContactPair,
    area_fraction: float,
    stopping: ContactStopping,
    start: np.ndarray | None = None,
) -> ContactState:
    """Contact with a prescribed raw area fraction in (0, 1).

    The number of samples in contact is a step function of the pressure. The returned state has the
    prescribed number to 1 part in 1000 or half a sample, whichever is more. Where the number jumps
    over it, since equal heights touch together, the state is on the nearer side of the jump.

    `iterations` of the returned state counts those of all trials.
    """
    pressure = _first_guess(pair, area_fraction, start)
    iterations = 0
    for _ in range(MOST_TRIALS):
        area, start, spent = _trial(pair, area_fraction, pressure, stopping, start)
        iterations += spent
        if _reached(area, area_fraction, start.size):
            state = pair.under_pressure(pressure, stopping, start)
            iterations += state.iterations
            area, start = state.contact_area_fraction, state.pressure.values
            if _reached(area, area_fraction, start.size):
                return replace(state, iterations=iterations)
        factor = _factor(_linear(area), _linear(area_fraction))
        pressure *= factor
        start = _pressed_further(start, factor)
    state = _search(pair, area_fraction, stopping, pressure, start)
    return replace(state, iterations=iterations + state.iterations)


def _trial(
    pair: ContactPair,
    area_fraction: float,
    pressure: float,
    stopping: ContactStopping,
    start: np.ndarray | None,
) -> tuple[float, np.ndarray, int]:
    """Area under a pressure, only as exact as needed to tell on which side it misses.

    Returns the area, the last iterate's pressure (nx, ny) up to a factor, and the iterations, also
    at the limit of iterations: the area only leads to the next pressure, and no contact is returned
    that `under_pressure` has not solved. From a uniform pressure the contact shrinks: its area
    still loses about the certificate.
    """
    for iterate in iterates(*pair.loaded(pressure, start), stopping):
        area = np.count_nonzero(iterate.pressure) / iterate.pressure.size
        if start is None:
            area *= 1 - min(iterate.certificate, TRIAL_CERTIFICATE)
        miss = abs(area / area_fraction - 1)
        if iterate.certificate <= max(min(TRIAL_CERTIFICATE, miss / SIDE_KNOWN), SEARCH_TOLERANCE):
            break
    return area, iterate.pressure, iterate.iteration


def _pressed_further(pressure: np.ndarray, factor: float) -> np.ndarray:
    """A pressure whose mean is larger by about a factor, each sample in contact by the same amount.

    As a start it takes about two thirds of the iterations that the multiplied pressure takes.
    """
    touches = pressure > 0
    rise = (factor - 1) * pressure.sum() / max(np.count_nonzero(touches), 1)
    return np.maximum(pressure + rise * touches, 0.0)


def _search(
    pair: ContactPair,
    area_fraction: float,
    stopping: ContactStopping,
    pressure: float,
    start: np.ndarray | None,
) -> ContactState:
    """State with the prescribed area, or on the nearer side of a jump; counts all iterations."""
    from scipy.optimize import brentq

    nearest: ContactState | None = None
    iterations, target = 0, _linear(area_fraction)

    @cache  # Brent's method asks for both ends of its bracket again
    def miss(pressure: float) -> float:
        """Y - Y0 at a pressure [Pa]; 0 once the area is reached."""
        nonlocal nearest, start, iterations
        if pressure == 0:
            return -target
        state = pair.under_pressure(pressure, stopping, start)
        iterations, start = iterations + state.iterations, state.pressure.values
        area = state.contact_area_fraction
        if nearest is None or abs(area - area_fraction) < abs(
            nearest.contact_area_fraction - area_fraction
        ):
            nearest = state
        reached = _reached(area, area_fraction, state.contact.size)
        return 0.0 if reached else _linear(area) - target

    low, high, beyond = 0.0, pressure, BEYOND
    while (short := miss(high)) < 0:
        if high > HIGHEST_PRESSURE * pressure:
            raise NotConverged(
                f"contact area fraction {area_fraction} is not reached at {high:.6e} Pa; ask for a "
                "smaller one"
            )
        # Further each time, in case nothing grows.
        low, high = high, high * min(beyond * _factor(short + target, target), MOST_FACTOR)
        beyond = min(beyond**2, MOST_FACTOR)
    # At a jump the nearest contact is the result; the error budget counts the missing area.
    least = LEAST_PRESSURE * pressure
    brentq(miss, low, high, xtol=least, rtol=SMALLEST_STEP, maxiter=MOST_SEARCHED)
    return replace(present(nearest, "contact of the search"), iterations=iterations)


def _reached(area: float, area_fraction: float, samples: int) -> bool:
    """Whether the area is the prescribed one to 1 part in 1000 or half a sample."""
    within = max(AREA_TOLERANCE * area_fraction, 0.5 / samples) * (1 + ROUNDING)
    return abs(area - area_fraction) <= within


def _linear(area: float) -> float:
    """Y of an area, finite where all samples touch."""
    from scipy.special import erfinv

    return float(erfinv(min(area, MOST_AREA)))


def _factor(linear: float, target: float) -> float:
    """Y0/Y, by which a trial pressure is multiplied, between its limits."""
    return max(target / linear, LEAST_FACTOR) if linear * MOST_FACTOR > target else MOST_FACTOR


def _first_guess(pair: ContactPair, area_fraction: float, start: np.ndarray | None) -> float:
    """Mean pressure [Pa] of the start; without one `FIRST_GUESS` times that of Persson's law."""
    if start is not None and start.any():
        return float(start.mean())
    # The law comes closer to simulations as the area grows: the factor rises by a third of it.
    part = FIRST_GUESS * (1 + area_fraction / 3)
    strain = part * _linear(area_fraction) * rms_slope(pair.height) / 2**0.5
    # A flat surface touches everywhere under any pressure, such as 1e-9 of the modulus.
    return (strain or 1e-9) * pair.solid.contact_modulus
