"""The law of the film: what the fluid makes of a gap.

The volume flux per width [m²/s] through a gap g under a pressure gradient is j = -K ∇p. The K of a
gas that slips at the walls depends on its pressure as well, which is known only to lie between
those of outlet and inlet. What the bounds of the flow need is the largest and the smallest K over
that interval (`FilmLaw`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil, log
from typing import TypeVar

import numpy as np

from fem_seal.fluid import Slip
from fem_seal.rarefied import PoiseuilleCoefficient

Gap = TypeVar("Gap", float, np.float64, np.ndarray)
Line = tuple[np.ndarray | float, np.ndarray | float]


def film_conductivity(gap: Gap, viscosity: float) -> Gap:
    """Film conductivity K = g³/(12 η) of a Newtonian fluid between parallel walls (Reynolds 1886).

    Parameters
    ----------
    gap : float, array or UFL expression [m]
    viscosity : float
        η [Pa s].

    Returns
    -------
    as `gap` [m³/(Pa s)]
    """
    return gap**3 / (12 * viscosity)


@dataclass(frozen=True, eq=False)
class Conductivity:
    """κ(g) = g² m(g), where m is the sum of a convex and a concave piecewise linear function.

    The gap is in units of the largest one, κ in units of that of the film as a whole. Without slip
    m = g. On an interval of gaps a convex function is at most its chord and at least its tangent in
    the middle, a concave one the other way round. That bounds κ by forms α g³ + β g², whose means
    over a triangle are known.

    Parameters
    ----------
    gaps : (n,) float
        From 0 to 1, the kinks of m between them.
    convex : (n,) float
        Convex part of m at these gaps.
    concave : (n,) float or None
        Concave part; None: zero.
    """

    gaps: np.ndarray
    convex: np.ndarray
    concave: np.ndarray | None = None

    @cached_property
    def is_cube(self) -> bool:
        """Whether κ = g³."""
        return len(self.gaps) == 2 and self.concave is None and self.convex[0] == 0

    def above(self, low: Gap, high: Gap) -> Line:
        """α and β of an upper bound for gaps between `low` and `high`, nowhere wider on a part.

        For conductivities without a concave part.
        """
        return _chord(self.gaps, self.convex, low, high)

    def below(self, low: Gap, high: Gap) -> Line:
        """α and β >= 0 of a positive lower bound for gaps between `low` and `high`.

        Where tangent and chord together are not positive, the least of m takes their place.
        """
        slope, start = _tangent(self.gaps, self.convex, low, high)
        if self.concave is not None:
            more = _chord(self.gaps, self.concave, low, high)
            slope, start = slope + more[0], start + more[1]
        positive = (start >= 0) & (start + slope * high > 0)
        return np.where(positive, slope, 0.0), np.where(positive, start, self._least)

    def of_gap(self, gap: Gap) -> Gap:
        """κ of a gap, exactly."""
        if self.is_cube:
            return gap**3
        return gap**2 * self.per_square(gap)

    def per_square(self, gap: Gap) -> Gap:
        """The function m of a gap."""
        per_square: Gap = np.interp(gap, self.gaps, self._values)  # type: ignore[assignment]
        return per_square

    @property
    def _values(self) -> np.ndarray:
        return self.convex if self.concave is None else self.convex + self.concave

    @cached_property
    def _least(self) -> float:
        return float(self._values.min())


def _chord(x: np.ndarray, y: np.ndarray, low: Gap, high: Gap) -> Line:
    """Slope of a piecewise linear function's chord from `low` to `high`, and its value at 0."""
    slopes = np.diff(y) / np.diff(x)
    if len(slopes) == 1:
        return slopes[0], y[0]
    first = np.clip(np.searchsorted(x, low, "right") - 1, 0, len(slopes) - 1)
    last = np.clip(np.searchsorted(x, high, "left") - 1, first, len(slopes) - 1)
    start, end = (y[k] + slopes[k] * (at - x[k]) for k, at in ((first, low), (last, high)))
    width = np.where(last > first, high - low, 1.0)
    # Between the slopes at both ends also where rounding spoils the difference of near values.
    ends = np.sort(np.stack(np.broadcast_arrays(slopes[first], slopes[last])), axis=0)
    slope = np.clip((end - start) / width, *ends)
    return slope, start - slope * low


def _tangent(x: np.ndarray, y: np.ndarray, low: Gap, high: Gap) -> Line:
    """Slope of its tangent in the middle of `low` and `high`, and the tangent's value at 0."""
    slopes = np.diff(y) / np.diff(x)
    if len(slopes) == 1:
        return slopes[0], y[0]
    k = np.clip(np.searchsorted(x, (low + high) / 2, "right") - 1, 0, len(slopes) - 1)
    return slopes[k], y[k] - slopes[k] * x[k]


@dataclass(frozen=True)
class FilmLaw:
    """Conductivities that bound that of the film: one from above, and one from below.

    Parameters
    ----------
    above, below : Conductivity
        The same if the conductivity is known.
    """

    above: Conductivity
    below: Conductivity


_CUBE = Conductivity(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
CUBE = FilmLaw(_CUBE, _CUBE)


def mean_pressure_law(slip: Slip, highest: float) -> FilmLaw:
    """The film at the mean pressure: g² c(g p/B), in units of its largest gap and conductivity.

    Parameters
    ----------
    slip : Slip
    highest : float
        Largest gap [m].
    """
    c = slip.coefficient
    most = highest * slip.mean_pressure / slip.product
    kinks = c.kinks / most
    gaps = np.concatenate([[0.0], kinks[kinks < 1], [1.0]])
    known = Conductivity(gaps, c(gaps * most) / c(most))
    return FilmLaw(known, known)


def bounding_law(slip: Slip, highest: float, above: float, below: float, unit: float) -> FilmLaw:
    """Largest and smallest conductivity over all pressures.

    With φ(p) = ∫ w dp, w any positive function, the mass flux is -(M/(RT)) κ ∇φ, and
    κ = B g² c(g p/B)/(12 η w(p)). The linear problem with the largest κ has at least the true mass
    rate and that with the smallest κ at most: p lies between the two pressures, and the flow grows
    with κ (Rayleigh). Here w(p) = c(g₀ p/B), so that κ does not depend on p at the gap g₀.

    Parameters
    ----------
    slip : Slip
    highest : float
        Largest gap [m].
    above, below : float
        g₀ of either bound, in units of the largest gap. Infinite ones, w(p) = p, want an outlet
        pressure above 0.
    unit : float
        Coefficient c of the largest gap that is 1.

    Notes
    -----
    For each gap c(g p/B)/w(p) is a ratio of two piecewise linear functions of p, monotone between
    their kinks. So its extremes over p lie at kinks or at the two pressures. The largest is convex
    in g, as c is, and at most its chords between the gaps of the table. The smallest is at least
    its chords, divided by 1 + `_sag` for the kink that c may have between two of these gaps.
    """
    gaps, values = _extremes(slip, highest, above, np.max)
    largest = Conductivity(gaps, values / unit)
    gaps, values = _extremes(slip, highest, below, np.min)
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
    slip: Slip, highest: float, reference: float, of: Callable[..., np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Gaps of a table, and there the largest or the smallest κ/g² over all pressures."""
    gaps = gap_table(slip, highest, reference)
    kinks = slip.coefficient.kinks * (slip.product / highest)
    values = np.empty(len(gaps))
    for k, gap in enumerate(gaps):
        at = [gap_at for gap_at in (gap, reference) if 0 < gap_at < np.inf]
        inside = np.concatenate([np.array(slip.pressures), *(kinks / gap_at for gap_at in at)])
        inside = inside[(inside >= slip.outlet_pressure) & (inside <= slip.inlet_pressure)]
        values[k] = of(conductivities(slip, highest, reference, gap, inside))
    return gaps, values


def _sag(c: PoiseuilleCoefficient) -> float:
    """Largest relative distance of c from its chord over a gap interval with one of its kinks."""
    if not len(c.kinks):
        return 0.0
    bends = np.diff(np.diff(c.c) / np.diff(c.t))
    ratio = c.kinks[1] / c.kinks[0]
    return float(np.max(bends * c.kinks / c(c.kinks))) * (ratio - 1) / 4


def gap_table(slip: Slip, highest: float, reference: float) -> np.ndarray:
    """Gaps from 0 to 1 for a table of extremes, at most one kink of c(g p/B) between two.

    Parameters
    ----------
    slip, highest : Slip, float
    reference : float
        g₀, one of the gaps if it is not above 1.
    """
    kinks = slip.coefficient.kinks
    first = _first_kink(slip, highest)
    gaps = [0.0, 1.0]
    if first < 1:
        gaps += list(np.geomspace(first, 1.0, 2 + ceil(log(1 / first) / log(kinks[1] / kinks[0]))))
    return np.unique([*gaps, min(reference, 1.0)])


def _first_kink(slip: Slip, highest: float) -> float:
    """Gap, over the largest, below which c(g p/B) has no kink at any of the pressures."""
    kinks = slip.coefficient.kinks
    most = highest * slip.inlet_pressure / slip.product
    return float(kinks[0] / most) if len(kinks) else 1.0


def conductivities(
    slip: Slip, highest: float, reference: float, gaps: np.ndarray, pressures: np.ndarray
) -> np.ndarray:
    """κ/g² at gaps and pressures, (φ(p_in) - φ(p_out))/(p_in - p_out) c(g p/B)/w(p).

    Parameters
    ----------
    slip, highest, reference : as of `bounding_law`; g₀ may be infinite
    gaps, pressures : arrays that broadcast
        Gaps in units of the largest one, pressures [Pa].
    """
    c, per_pascal = slip.coefficient, highest / slip.product
    difference = slip.inlet_pressure - slip.outlet_pressure
    if np.isinf(reference):
        weight, mean = pressures, slip.mean_pressure
    else:
        low, high = (slip.potential(p, highest * reference) for p in slip.pressures)
        weight, mean = c(reference * per_pascal * pressures), (high - low) / difference
    return c(gaps * per_pascal * pressures) * (mean / weight)
