"""The mean pressure at which a prescribed fraction of the samples is in contact.

Solves Y(p) = Y0 for Y = erfinv(A/A0), which is linear in the pressure by Persson's theory
A/A0 = erf(√2 p / (E* h'rms)). Each trial pressure is the last one times Y0/Y. A trial ends as soon
as the certificate is so far below the miss of the area that the side of the miss is known: the
certificate, in units of the rms height, is about the relative error of the area. The next trial
starts with a uniform pressure more, or less, on the samples that touch. If `MOST_TRIALS` do not
reach the area, as where it jumps, all further contacts converge, and the pressures of two that
enclose the area approach each other.
"""

from dataclasses import replace
from itertools import count
from math import inf

import numpy as np

from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.methods import ContactStopping, iterates
from fem_seal.contact.state import ContactState
from fem_seal.errors import NotConverged
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
# Least and largest ratio of a trial pressure to the last one: far from the area Y is not linear,
# and it is 0 where nothing touches.
LEAST_FACTOR, MOST_FACTOR = 1 / 16, 4.0
MOST_AREA = 1 - 1e-9  # above it Y, which is infinite where all samples touch, is that of this area
COUNT_ROUNDING = 1e-9  # of a count of samples over their number, relative
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
    over it, since equal heights touch together, the state is next to the jump, on its nearer side.

    `iterations` of the returned state counts those of all trials.
    """
    pressed = np.zeros(pair.height.shape) if start is None else start
    first = pressure = _first_guess(pair, area_fraction, pressed)
    low, high = 0.0, inf  # pressures of converged contacts with too small and too large an area
    nearest: ContactState | None = None
    iterations = 0
    for trial in count(1):
        area = area_fraction  # for a contact that converges
        if trial <= MOST_TRIALS:
            area, pressed, spent = _trial(pair, area_fraction, pressure, stopping, pressed)
            iterations += spent
        if _reached(area, area_fraction, pressed.size):
            state = pair.under_pressure(pressure, stopping, pressed)
            iterations += state.iterations
            area, pressed = state.contact_area_fraction, state.pressure.values
            miss = abs(area - area_fraction)
            if nearest is None or miss <= abs(nearest.contact_area_fraction - area_fraction):
                nearest = state  # of equal areas the last, which is next to the jump
            low, high = (pressure, high) if area < area_fraction else (low, pressure)
            # At a jump the error budget counts the area that the nearest contact misses.
            jumps = high <= max(low * (1 + SMALLEST_STEP), LEAST_PRESSURE * first)
            if jumps or _reached(area, area_fraction, pressed.size):
                return replace(nearest, iterations=iterations)
        if low > HIGHEST_PRESSURE * first:
            break
        factor = _factor(_linear(area), _linear(area_fraction))
        before, pressure = pressure, _next(pressure, factor, low, high, max(trial - MOST_TRIALS, 0))
        pressed = _pressed_further(pressed, pressure / before)
    raise NotConverged(
        f"contact area fraction {area_fraction} is not reached at {low:.6e} Pa; ask for a smaller "
        "one"
    )


def _next(pressure: float, factor: float, low: float, high: float, past: int) -> float:
    """Pressure of the next trial, from Y0/Y and the number of trials past `MOST_TRIALS`.

    If there are any, Y jumps or is level: a bracket is halved at every other trial.
    """
    if low > 0 and high < inf:
        secant = past % 2 == 0 and low < factor * pressure < high
        return factor * pressure if secant else (low * high) ** 0.5
    # Beyond Y0, so that it is enclosed, and further each time.
    return pressure * min(max(factor ** (2 ** min(past, 8)), LEAST_FACTOR), MOST_FACTOR)


def _trial(
    pair: ContactPair,
    area_fraction: float,
    pressure: float,
    stopping: ContactStopping,
    start: np.ndarray,
) -> tuple[float, np.ndarray, int]:
    """Area under a pressure, only as exact as needed to tell on which side it misses.

    Returns the area, the last iterate's pressure (nx, ny) up to a factor, and the iterations, also
    at the limit of iterations: the area only leads to the next pressure, and no contact is returned
    that `under_pressure` has not solved. From a uniform pressure the contact shrinks: its area
    still loses about the certificate.
    """
    for iterate in iterates(*pair.loaded(pressure, start), stopping):
        area = np.count_nonzero(iterate.pressure) / iterate.pressure.size
        if not start.any():
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


def _reached(area: float, area_fraction: float, samples: int) -> bool:
    """Whether the area is the prescribed one to 1 part in 1000 or half a sample."""
    within = max(AREA_TOLERANCE * area_fraction, 0.5 / samples) * (1 + COUNT_ROUNDING)
    return abs(area - area_fraction) <= within


def _linear(area: float) -> float:
    """Y of an area, finite where all samples touch."""
    from scipy.special import erfinv

    return float(erfinv(min(area, MOST_AREA)))


def _factor(linear: float, target: float) -> float:
    """Y0/Y, by which a trial pressure is multiplied, between its limits."""
    return max(target / linear, LEAST_FACTOR) if linear * MOST_FACTOR > target else MOST_FACTOR


def _first_guess(pair: ContactPair, area_fraction: float, start: np.ndarray) -> float:
    """Mean pressure [Pa] of the start; of zeros `FIRST_GUESS` times that of Persson's law."""
    if start.any():
        return float(start.mean())
    # The law comes closer to simulations as the area grows: the factor rises by a third of it.
    part = FIRST_GUESS * (1 + area_fraction / 3)
    strain = part * _linear(area_fraction) * rms_slope(pair.height) / 2**0.5
    # A flat surface touches everywhere under any pressure, such as 1e-9 of the modulus.
    return (strain or 1e-9) * pair.solid.contact_modulus
