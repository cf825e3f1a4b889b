"""The law of the film: its conductivity as a function of the gap.

The volume flux per width [m²/s] through a gap g under a pressure gradient is j = -K ∇p. For a gas
that slips at the walls, K also depends on the local pressure, which is only known to lie between
the pressures of outlet and inlet. The bounds of the flow take the largest and the smallest K over
that interval (`FilmLaw`, made in `slip_bounds`).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from fem_seal.errors import Inconsistent, InvalidInput
from fem_seal.fluid import Slip

T = TypeVar("T", float, np.float64, np.ndarray)
# Smallest unit of leak rates [m³/s]: those of gaps over 60 decades, whose cubes span 180, are still
# floating-point numbers of full precision below it.
LEAST_UNIT = 1e-100
TABLE_ROUNDING = 1e-12  # of a table of m, as a part of its largest value
Line = tuple[np.ndarray | float, np.ndarray | float]


def film_conductivity(gap: T, viscosity: float) -> T:
    """Film conductivity K = g³/(12 η) of a Newtonian fluid between parallel walls (Reynolds 1886).

    K [m³/(Pa s)] of a gap [m] at a viscosity η [Pa s]; of expressions of UFL as well, which the
    annotation leaves out: this half of the package runs without it.
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

    def __post_init__(self) -> None:
        widths = np.diff(self.gaps)
        if not ((widths > 0).all() and self.gaps[0] == 0 and self.gaps[-1] == 1):
            raise Inconsistent("the gaps of a conductivity do not ascend from 0 to 1")
        for part in [self.convex] if self.concave is None else [self.convex, -self.concave]:
            if part.shape != self.gaps.shape or not np.isfinite(part).all():
                raise Inconsistent("a conductivity has not one finite value at each of its gaps")
            bends = np.diff(np.diff(part) / widths)
            rounding = TABLE_ROUNDING * np.abs(part).max() / np.minimum(widths[1:], widths[:-1])
            if (bends < -rounding).any():
                raise Inconsistent("a part of a conductivity is not convex, or not concave")

    @cached_property
    def is_cube(self) -> bool:
        """Whether κ = g³."""
        return len(self.gaps) == 2 and self.concave is None and self.convex[0] == 0

    def upper_line(self, low: T, high: T) -> Line:
        """α and β of an upper bound for gaps between `low` and `high`.

        For a part of the interval the bound is nowhere larger. κ must have no concave part; see
        `FilmLaw`.
        """
        return _chord(self.gaps, self.convex, low, high)

    def lower_line(self, low: T, high: T) -> Line:
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

    upper: Conductivity  #: upper bound
    lower: Conductivity  #: lower bound; the same object if the conductivity is known exactly

    def __post_init__(self) -> None:
        if self.upper.concave is not None:
            raise Inconsistent("the upper bound of a conductivity has a concave part")


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
