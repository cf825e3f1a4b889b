"""The law of the film: its conductivity as a function of the gap.

The volume flux per width [m²/s] through a gap g under a pressure gradient is j = -K ∇p. For a gas
that slips at the walls, K also depends on the local pressure, which is only known to lie between
the pressures of outlet and inlet. The bounds of the flow take the largest and the smallest K over
that interval (`FilmLaw`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil, log
from typing import TypeVar

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.fluid import Slip
from fem_seal.rarefied import PoiseuilleCoefficient

T = TypeVar("T", float, np.float64, np.ndarray)
# Smallest unit of leak rates [m³/s]: those of gaps over 60 decades, whose cubes span 180, are still
# floating-point numbers of full precision below it.
LEAST_UNIT = 1e-100
_RATIO = 1.05  # ratio of neighbouring gaps in a table of extremes if c has no kinks
Line = tuple[np.ndarray | float, np.ndarray | float]


def film_conductivity(gap: T, viscosity: float) -> T:
    """Film conductivity K = g³/(12 η) of a Newtonian fluid between parallel walls (Reynolds 1886).

    K [m³/(Pa s)] of a gap [m], which may be a UFL expression, at a viscosity η [Pa s].
    """
    return gap**3 / (12 * viscosity)


def leak_rate_of_square(largest_gap: float, viscosity: float, pressure_drop: float) -> float:
    """Leak rate [m³/s] of a square film of the largest gap [m], the unit of the solved problems."""
    with np.errstate(over="ignore", under="ignore"):
        unit = film_conductivity(np.float64(largest_gap), viscosity) * pressure_drop
    if not LEAST_UNIT < unit < 1 / LEAST_UNIT:
        raise InvalidInput(
            f"a gap of {largest_gap:.1e} m at {viscosity:.1e} Pa s and {pressure_drop:.1e} Pa has "
            "a leak rate beyond double precision; check the units"
        )
    return float(unit)


@dataclass(frozen=True, eq=False)
class Conductivity:
    """κ(g) = g² m(g), where m is the sum of a convex and a concave piecewise linear function.

    The gap is in units of the largest one, κ in the unit of the normalised problem. Without slip
    m = g. On an interval of gaps a convex function is at most its chord and at least its tangent in
    the middle; for a concave function it is the other way round. That bounds κ by forms
    α g³ + β g², whose means over a triangle are known.
    """

    gaps: np.ndarray  #: (n,): 0, the kinks of m in ascending order, and 1
    convex: np.ndarray  #: (n,), convex part of m at these gaps
    concave: np.ndarray | None = None  #: (n,), concave part; None: zero

    @cached_property
    def is_cube(self) -> bool:
        """Whether κ = g³."""
        return len(self.gaps) == 2 and self.concave is None and self.convex[0] == 0

    def above(self, low: T, high: T) -> Line:
        """α and β of an upper bound for gaps between `low` and `high`.

        For a part of the interval the bound is nowhere larger. κ must have no concave part.
        """
        return _chord(self.gaps, self.convex, low, high)

    def below(self, low: T, high: T) -> Line:
        """α and β >= 0 of a positive lower bound for gaps between `low` and `high`.

        Where the sum of tangent and chord is not positive, the smallest m replaces it.
        """
        slope, start = _tangent(self.gaps, self.convex, low, high)
        if self.concave is not None:
            more = _chord(self.gaps, self.concave, low, high)
            slope, start = slope + more[0], start + more[1]
        positive = (start >= 0) & (start + slope * high > 0)
        return np.where(positive, slope, 0.0), np.where(positive, start, self._least)

    def of_gap(self, gap: T) -> T:
        """κ of a gap, exactly."""
        if self.is_cube:
            return gap**3
        return gap**2 * self.per_square(gap)

    def per_square(self, gap: T) -> T:
        """The function m of a gap."""
        per_square: T = np.interp(gap, self.gaps, self._values)  # type: ignore[assignment]
        return per_square

    @property
    def _values(self) -> np.ndarray:
        return self.convex if self.concave is None else self.convex + self.concave

    @cached_property
    def _least(self) -> float:
        return float(self._values.min())


def _chord(x: np.ndarray, y: np.ndarray, low: T, high: T) -> Line:
    """Slope of a piecewise linear function's chord from `low` to `high`, and its value at 0."""
    slopes = np.diff(y) / np.diff(x)
    if len(slopes) == 1:
        return slopes[0], y[0]
    first = np.clip(np.searchsorted(x, low, "right") - 1, 0, len(slopes) - 1)
    last = np.clip(np.searchsorted(x, high, "left") - 1, first, len(slopes) - 1)
    start, end = (y[k] + slopes[k] * (at - x[k]) for k, at in ((first, low), (last, high)))
    width = np.where(last > first, high - low, 1.0)
    # Keep it between the slopes at both ends: rounding spoils differences of nearly equal values.
    ends = np.sort(np.stack(np.broadcast_arrays(slopes[first], slopes[last])), axis=0)
    slope = np.clip((end - start) / width, *ends)
    return slope, start - slope * low


def _tangent(x: np.ndarray, y: np.ndarray, low: T, high: T) -> Line:
    """Slope of the function's tangent midway between `low` and `high`, and its value at 0."""
    slopes = np.diff(y) / np.diff(x)
    if len(slopes) == 1:
        return slopes[0], y[0]
    k = np.clip(np.searchsorted(x, (low + high) / 2, "right") - 1, 0, len(slopes) - 1)
    return slopes[k], y[k] - slopes[k] * x[k]


@dataclass(frozen=True)
class FilmLaw:
    """Upper and lower bound of the conductivity of the film."""

    above: Conductivity  #: upper bound
    below: Conductivity  #: lower bound; the same object if the conductivity is known exactly


_CUBE = Conductivity(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
CUBE = FilmLaw(_CUBE, _CUBE)


def mean_pressure_law(slip: Slip, largest_gap: float) -> FilmLaw:
    """The film at the mean pressure: g² c(g p/B), in units of its largest gap and conductivity."""
    kinks = slip.coefficient.kinks * slip.product / (largest_gap * slip.mean_pressure)
    gaps = np.concatenate([[0.0], kinks[kinks < 1], [1.0]])
    known = Conductivity(
        gaps, slip.per_square_gap(gaps * largest_gap) / slip.per_square_gap(largest_gap)
    )
    return FilmLaw(known, known)


@dataclass(frozen=True, eq=False)
class PressureWeight:
    """w(p) > 0 in φ = ∫ w dp, piecewise linear between the pressures of outlet and inlet."""

    #: gap g₀, in units of the largest one; w is proportional to c(g₀ p/B), or close to it
    reference: float
    #: (n,), kinks of w, the first one p_out, the last one p_in [Pa], and w there
    pressures: np.ndarray
    values: np.ndarray

    @classmethod
    def of_gap(cls, slip: Slip, largest_gap: float, reference: float) -> "PressureWeight":
        """w(p) = c(g₀ p/B): where the gap is g₀, κ then does not depend on p.

        g₀ = ∞ stands for w(p) = p; the outlet pressure must then be positive.
        """
        ends = np.array(slip.pressures)
        if np.isinf(reference):
            return cls(reference, ends, ends)
        per_pascal = largest_gap * reference / slip.product
        kinks = slip.coefficient.kinks / per_pascal
        inside = kinks[(kinks > ends[0]) & (kinks < ends[1])]
        pressures = np.concatenate([ends[:1], inside, ends[1:]])
        return cls(reference, pressures, slip.coefficient(per_pascal * pressures))

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
    slip: Slip, largest_gap: float, above: PressureWeight, below: PressureWeight, unit: float
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
    is at least its chords divided by 1 + `_sag`, since c may have a kink between two gaps.
    """
    gaps, values = _extremes(slip, largest_gap, above, np.max)
    largest = Conductivity(gaps, values / unit)
    gaps, values = _extremes(slip, largest_gap, below, np.min)
    values = values / (1 + _sag(slip.coefficient)) / unit
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
    slip: Slip, largest_gap: float, weight: PressureWeight, of: Callable[..., np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Gaps of a table, and the largest or the smallest κ/g² over all pressures at each."""
    gaps = gap_table(slip, largest_gap, weight.reference)
    kinks = slip.coefficient.kinks * (slip.product / largest_gap)
    p_out, p_in = slip.pressures
    values = np.empty(len(gaps))
    for k, gap in enumerate(gaps):
        of_gap = kinks / gap if gap > 0 else kinks[:0]
        of_gap = of_gap[(of_gap > p_out) & (of_gap < p_in)]
        inside = np.concatenate([weight.pressures, of_gap])
        values[k] = of(conductivities(slip, largest_gap, weight, gap, inside))
    return gaps, values


def _sag(c: PoiseuilleCoefficient) -> float:
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
