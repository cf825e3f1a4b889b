"""K(w): conductivity of a patch of rough contact whose solid carries the net load w = P - p."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem_seal.errors import Inconsistent, InvalidInput
from fem_seal.leak_rate import middle_of
from fem_seal.points.folder import Numbers

# Steps of the interpolated conductivity between two loads of a table.
STEPS = 16
# Below the first load K is at most exp(MOST_RISE) times that at it: so large a K hardly resists.
MOST_RISE = 50.0
MOST_TAIL = 8.0  # fall of ln K up to which it is extrapolated above the last load
# Exponents m and n, so that K^m is concave in the gap and K^n convex: of K ~ g³, and under slip by
# either law, for which all m up to 0.333 and n from 0.57 on would do.
CUBIC, SLIPPING = (1 / 3, 1 / 3), (0.3, 0.6)
# Steps inside an enclosure: K falls by about the part FALL in each; most of them.
FALL, ENCLOSURE_STEPS = 0.002, 500


@dataclass(frozen=True)
class Enclosure:
    """Bounds of K between two loads, whose width falls as the square of the loads' distance.

    Between both loads K^m is at least the chord of `lower`^m, and K^n at most that of `upper`^n
    (see `patch_conductivity`).
    """

    #: (k,), bounds of K [m³/(Pa s)] at places evenly from the lower load to the higher one: k = 2,
    #: in results of older versions 3
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    exponents: tuple[float, float] = CUBIC  #: m and n

    def __post_init__(self) -> None:
        ordered = all(0 <= low <= high for low, high in zip(self.lower, self.upper, strict=False))
        if not ordered or not len(self.lower) == len(self.upper) > 1:
            raise Inconsistent(f"an enclosure with the bounds {self.lower} and {self.upper}")

    @property
    def step_count(self) -> int:
        """Number of steps that follow the bounds closely."""
        low, high = self.lower[-1], self.upper[0]
        fall = np.log(high / low) if low > 0 else np.inf
        return int(np.clip(fall / FALL, 1, ENCLOSURE_STEPS))

    def lower_at(self, share: np.ndarray) -> np.ndarray:
        """Lower bound at parts 0 to 1 of the way from the lower load to the higher one."""
        return _power_chord(self.lower, self.exponents[0], share)

    def upper_at(self, share: np.ndarray) -> np.ndarray:
        """Upper bound at parts 0 to 1 of the way from the lower load to the higher one."""
        return _power_chord(self.upper, self.exponents[1], share)

    def overlaps(self, bounds: tuple[float, float], share: float) -> bool:
        """Whether these bounds and others of K at a part of the way have a common value."""
        at = np.array(share)
        return bool(bounds[0] <= self.upper_at(at) and bounds[1] >= self.lower_at(at))


def _power_chord(bounds: tuple[float, ...], exponent: float, share: np.ndarray) -> np.ndarray:
    places = np.linspace(0, 1, len(bounds))
    return np.interp(share, places, np.power(bounds, exponent)) ** (1 / exponent)


@dataclass(frozen=True, eq=False)
class ConductivitySteps:
    """A conductivity that falls with the load in steps."""

    loads: np.ndarray  #: (n,), net loads [Pa], ascending, at which the conductivity falls
    #: (n + 1,), K [m³/(Pa s)] below the first load, between the loads, and above the last load. It
    #: does not increase; infinite where the film may be open, zero where it may be sealed
    conductivity: np.ndarray

    def __post_init__(self) -> None:
        loads, K = self.loads, self.conductivity
        # An interpolated K rises by rounding where the bounds are equal.
        falls = (K[1:] >= 0).all() and (K[1:] <= K[:-1] * (1 + 1e-9)).all()
        if K.shape != (loads.size + 1,) or not falls or not (np.diff(loads) >= 0).all():
            raise Inconsistent("a conductivity that rises with the load, or loads out of order")

    def __call__(self, load: np.ndarray) -> np.ndarray:
        """K [m³/(Pa s)] at net loads [Pa]; infinite where the net load is not positive."""
        K = self.conductivity[np.searchsorted(self.loads, load, side="left")]
        return np.where(np.asarray(load) > 0, K, np.inf)


@dataclass(frozen=True, eq=False)
class ConductivityTable:
    """Bounds of the effective conductivity of a patch at a list of net loads.

    K falls with the load. Where the bounds of a higher load exceed those of a lower one, which the
    grid of the contact may cause, the bounds are widened until they do not rise: the upper bound to
    the largest one at this load and above, the lower bound to the smallest one at this load and
    below.
    """

    loads: Numbers  #: (n,), net loads w = P - p [Pa], >= 0, ascending
    #: (n,), bounds of K [m³/(Pa s)], 0 <= lower <= upper; both 0 where the patch is sealed
    lower: Numbers
    upper: Numbers
    #: (n - 1,) Enclosure or None, narrower bounds between the loads; None: those of the two loads
    between: tuple[Enclosure | None, ...] = ()

    def __post_init__(self) -> None:
        loads, lower, upper = (
            np.array(values, dtype=float) for values in (self.loads, self.lower, self.upper)
        )
        if not (loads.ndim == 1 and loads.size and loads.shape == lower.shape == upper.shape):
            raise InvalidInput(
                "a conductivity table needs as many lower and upper bounds as loads, at least one; "
                f"got {loads.size} loads, {lower.size} lower and {upper.size} upper bounds"
            )
        if not np.isfinite([loads, lower, upper]).all() or min(loads.min(), lower.min()) < 0:
            raise InvalidInput(
                "loads and conductivities of a table must be finite and >= 0; got loads from "
                f"{loads.min():g} to {loads.max():g} Pa, conductivities from {lower.min():g} to "
                f"{upper.max():g} m^3/(Pa s)"
            )
        if not (rises := np.diff(loads) > 0).all():
            before, after = loads[np.argmin(rises) :][:2]
            raise InvalidInput(
                "the loads of a conductivity table must ascend, and "
                f"{before:g} Pa stands before {after:g} Pa"
            )
        if (lower > upper).any():
            at = loads[np.argmax(lower > upper)]
            raise InvalidInput(f"the bounds of the conductivity cross at a load of {at:g} Pa")
        if len(self.between) not in (0, loads.size - 1):
            raise InvalidInput(
                f"a conductivity table of {loads.size} loads needs {loads.size - 1} enclosures "
                f"between them or none, got {len(self.between)}"
            )
        object.__setattr__(self, "loads", loads)
        object.__setattr__(self, "lower", np.minimum.accumulate(lower))
        object.__setattr__(self, "upper", np.maximum.accumulate(upper[::-1])[::-1])

    def __eq__(self, other: object) -> bool:
        """Whether all numbers are the same: a result that is read equals the written one."""
        if not isinstance(other, ConductivityTable):
            return NotImplemented
        pairs = ((self.loads, other.loads), (self.lower, other.lower), (self.upper, other.upper))
        return self.between == other.between and all(np.array_equal(*pair) for pair in pairs)

    __hash__ = None  # type: ignore[assignment]  # as of anything that is compared by its arrays

    @property
    def sealing_load(self) -> float:
        """Smallest load [Pa] of the table that seals the patch; infinite if none does."""
        sealed = self.upper == 0
        return float(self.loads[np.argmax(sealed)]) if sealed.any() else np.inf

    @cached_property
    def highest(self) -> ConductivitySteps:
        """Upper bound of K: between two loads that of the lower load, less inside an enclosure."""
        loads, _, upper = self._bounds_by_load
        return ConductivitySteps(loads, np.concatenate([[np.inf], upper]))

    @cached_property
    def lowest(self) -> ConductivitySteps:
        """Lower bound of K: between two loads that of the higher load, more inside an enclosure.

        Above the last load it is 0.
        """
        loads, lower, _ = self._bounds_by_load
        return ConductivitySteps(loads, np.concatenate([lower, [0.0]]))

    @cached_property
    def _bounds_by_load(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Loads and bounds of the table and of the steps inside the enclosures; no bound rises."""
        rows = [(self.loads, self.lower, self.upper)]
        for k, enclosure in enumerate(self.between):
            if enclosure is not None:
                a, b = self.loads[k : k + 2]
                share = np.arange(1, enclosure.step_count) / enclosure.step_count
                inside = a + (b - a) * share
                kept = (inside > a) & (inside < b)
                lower = np.maximum(enclosure.lower_at(share), self.lower[k + 1])
                upper = np.minimum(enclosure.upper_at(share), self.upper[k])
                rows.append((inside[kept], lower[kept], upper[kept]))
        columns = np.concatenate(rows, axis=1)
        loads, lower, upper = columns[:, np.argsort(columns[0])]
        return loads, np.minimum.accumulate(lower), np.maximum.accumulate(upper[::-1])[::-1]

    @property
    def value(self) -> np.ndarray:
        """Estimate of K at the loads: √(lower upper), or the upper bound if the lower one is 0."""
        return np.minimum.accumulate(list(map(middle_of, self.lower, self.upper)))

    @cached_property
    def interpolated(self) -> ConductivitySteps:
        """Estimate of K between the bounds, in fine steps.

        Between the loads ln K is a monotone cubic (F. N. Fritsch and J. Butland, SIAM J. Sci. Stat.
        Comput. 5, 300 (1984)), kept between the bounds. Towards a sealed load K itself is linear.
        Beyond the first and the last load ln K goes on with the slope of the interval next to it;
        where K has fallen by exp(MOST_TAIL) it keeps its value.
        """
        nodes, values = self.loads, self.value
        leaking = np.count_nonzero(values)
        slopes = -np.diff(np.log(values[:leaking])) / np.diff(nodes[:leaking])
        if leaking == nodes.size > 1 and slopes[-1] > 0:
            nodes = np.append(nodes, nodes[-1] + MOST_TAIL / slopes[-1])
            values = np.append(values, values[-1] * np.exp(-MOST_TAIL))
        if nodes[0] > 0:
            rise = min(slopes[0] * nodes[0], MOST_RISE) if leaking > 1 else 0.0
            nodes, values = np.append(0.0, nodes), np.append(values[0] * np.exp(rise), values)
        leaking = max(1, int(np.count_nonzero(values)))
        share = (np.arange(STEPS) + 0.5) / STEPS
        places = nodes[:-1, None] + np.diff(nodes)[:, None] * share
        inside = np.empty_like(places)
        inside[: leaking - 1] = _interpolated(nodes[:leaking], values[:leaking], places)
        # K falls linearly to 0 at the first sealed load, and stays 0 in the intervals behind it.
        inside[leaking - 1 :] = values[leaking - 1 : -1, None] * (1 - share)
        inside = np.clip(inside, self.lowest(places), self.highest(places))
        edges = nodes[:-1, None] + np.diff(nodes)[:, None] * (np.arange(STEPS) + 1) / STEPS
        return ConductivitySteps(
            np.append(nodes[:1], edges), np.concatenate([values[:1], inside.ravel(), values[-1:]])
        )


def _interpolated(nodes: np.ndarray, values: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Monotone cubic of ln K at places (m, STEPS), the first n - 1 rows between n nodes."""
    from scipy.interpolate import PchipInterpolator

    if len(nodes) < 2:
        return np.empty((0, places.shape[1]))
    return np.exp(PchipInterpolator(nodes, np.log(values))(places[: len(nodes) - 1]))
