"""Bounds of the conductivity of a film that slips, over all pressures between those of its ends."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil, log

import numpy as np

from fem_seal.errors import Inconsistent
from fem_seal.film.law import Conductivity, FilmLaw
from fem_seal.fluid import Slip
from fem_seal.rarefied import PoiseuilleCoefficient

_RATIO = 1.05  # ratio of neighbouring gaps in a table of extremes if c has no kinks


@dataclass(frozen=True, eq=False)
class PressureWeight:
    """w(p) > 0 in φ = ∫ w dp, piecewise linear between the pressures of outlet and inlet."""

    #: gap g₀, in units of the largest one; w is proportional to c(g₀ p/B), or close to it
    reference: float
    #: (n,), kinks of w, the first one p_out, the last one p_in [Pa], and w there
    pressures: np.ndarray
    values: np.ndarray

    def __post_init__(self) -> None:
        if not ((np.diff(self.pressures) > 0).all() and (self.values > 0).all()):
            raise Inconsistent("a weight w(p) is positive, at ascending pressures")

    @classmethod
    def of_gap(cls, slip: Slip, largest_gap: float, reference: float) -> "PressureWeight":
        """w(p) = c(g₀ p/B): where the gap is g₀, κ then does not depend on p.

        g₀ = ∞ stands for w(p) = p; the outlet pressure must then be positive.
        """
        ends = np.array([slip.outlet_pressure, slip.inlet_pressure])
        if np.isinf(reference):
            return cls(reference, ends, ends)
        gap = largest_gap * reference
        pressures = slip.kinks_and_ends(gap)
        return cls(reference, pressures, slip.coefficient(gap * pressures / slip.product))

    def times(self, pressures: np.ndarray, logarithm: np.ndarray) -> "PressureWeight":
        """Multiply by the exponential of a function that is linear between pressures."""
        kinks = np.union1d(self.pressures, pressures)
        kinks = kinks[(kinks >= self.pressures[0]) & (kinks <= self.pressures[-1])]
        factor = np.exp(np.interp(kinks, pressures, logarithm))
        return PressureWeight(self.reference, kinks, self(kinks) * factor)

    def __call__(self, pressure: np.ndarray) -> np.ndarray:
        """Weight w at a pressure [Pa] between the two ends."""
        return np.interp(pressure, self.pressures, self.values)

    @cached_property
    def mean(self) -> float:
        """Mean of w over the pressures."""
        areas = np.diff(self.pressures) * (self.values[1:] + self.values[:-1]) / 2
        return float(areas.sum() / (self.pressures[-1] - self.pressures[0]))


def bounding_law(
    slip: Slip, largest_gap: float, upper: PressureWeight, lower: PressureWeight, unit: float
) -> FilmLaw:
    """Largest and smallest conductivity over all pressures.

    With φ(p) = ∫ w dp for any positive function w, the mass flux is -(M/(RT)) κ ∇φ with κ = B g²
    c(g p/B)/(12 η w(p)). Since p lies between the pressures of inlet and outlet and the flow grows
    with κ (Rayleigh), the linear problem with the largest κ has at least the true mass rate, and
    the one with the smallest κ at most. Each bound has a weight w of its own; `unit` is the value
    of κ/g² that becomes 1.

    For each gap c(g p/B)/w(p) is a ratio of two piecewise linear functions of p, monotone between
    their kinks. So its extremes over p lie at kinks or at the two pressures. The largest one is
    convex in g, as c is, and so at most its chords between the gaps of the table. The smallest one
    is at least its chords divided by 1 + `sag`, since c may have a kink between two gaps.
    """
    gaps, values = _extremes(slip, largest_gap, upper, np.max)
    largest = Conductivity(gaps, values / unit)
    gaps, values = _extremes(slip, largest_gap, lower, np.min)
    values = values / (1 + sag(slip.coefficient)) / unit
    slopes = np.diff(values) / np.diff(gaps)
    bends = np.append(np.diff(slopes), 0.0)
    convex = _from_right(gaps, np.maximum(bends, 0.0)) + values[-1] + slopes[-1] * (gaps - 1)
    smallest = Conductivity(gaps, convex, -_from_right(gaps, np.maximum(-bends, 0.0)))
    return FilmLaw(largest, smallest)


def _from_right(x: np.ndarray, bends: np.ndarray) -> np.ndarray:
    """Convex function with given changes of slope at x[1:], zero from the last one on."""
    slopes = -np.cumsum(bends[::-1])[::-1]
    return np.append(-np.cumsum((slopes * np.diff(x))[::-1])[::-1], 0.0)


def _extremes(
    slip: Slip, largest_gap: float, weight: PressureWeight, extreme: Callable[..., np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Gaps of a table, and the largest or the smallest κ/g² over all pressures at each."""
    gaps = gap_table(slip, largest_gap, weight.reference)
    kinks = slip.coefficient.kinks * (slip.product / largest_gap)
    p_out, p_in = slip.outlet_pressure, slip.inlet_pressure
    values = np.empty(len(gaps))
    for k, gap in enumerate(gaps):
        of_gap = kinks / gap if gap > 0 else kinks[:0]
        of_gap = of_gap[(of_gap > p_out) & (of_gap < p_in)]
        inside = np.concatenate([weight.pressures, of_gap])
        values[k] = extreme(conductivities(slip, largest_gap, weight, gap, inside))
    return gaps, values


def sag(c: PoiseuilleCoefficient) -> float:
    """Largest relative distance of c from its chord over a gap interval with one of its kinks."""
    if not len(c.kinks):
        return 0.0
    bends = np.diff(np.diff(c.c) / np.diff(c.t))
    ratio = c.kinks[1] / c.kinks[0]
    return float(np.max(bends * c.kinks / c(c.kinks))) * (ratio - 1) / 4


def gap_table(slip: Slip, largest_gap: float, reference: float) -> np.ndarray:
    """Gaps from 0 to 1 for a table of extremes; c(g p/B) has at most one kink between two of them.

    The smallest gap above 0 is so small that c has no kink below it at any of the pressures. If c
    has no kinks at all, slip carries a thousand times the viscous flow at this gap. The reference
    g₀ is one of the gaps if it is not above 1.
    """
    kinks = slip.coefficient.kinks
    start, ratio = (kinks[0], kinks[1] / kinks[0]) if len(kinks) else (1e-3, _RATIO)
    first = start * slip.product / (largest_gap * slip.inlet_pressure)
    gaps = [0.0, 1.0]
    if first < 1:
        gaps += list(np.geomspace(first, 1.0, 2 + ceil(log(1 / first) / log(ratio))))
    return np.unique([*gaps, min(reference, 1.0)])


def conductivities(
    slip: Slip,
    largest_gap: float,
    weight: PressureWeight,
    gaps: np.ndarray | float,
    pressures: np.ndarray,
) -> np.ndarray:
    """κ/g² at gaps and pressures that broadcast, c(g p/B) over w(p), in units of the mean of w.

    The gaps are in units of the largest one.
    """
    t = gaps * (largest_gap / slip.product) * pressures
    return slip.coefficient(t) * (weight.mean / weight(pressures))
