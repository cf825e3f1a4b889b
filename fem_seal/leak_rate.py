"""LeakRate: the result of every flow solver, by finite elements or finite differences."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import asinh, inf, isclose, log, sqrt, tanh
from typing import Literal, TypeAlias, get_args

import numpy as np

from fem_seal.arguments import require_known
from fem_seal.digits import bracket_digits, per_cent
from fem_seal.errors import Inconsistent

FlowState: TypeAlias = Literal["leaking", "sealed", "lifted off"]
MEAN_ROUNDING = 1e-12  # relative, of the geometric mean of two bounds


def middle_of(lower: float, upper: float) -> float:
    """Geometric mean of two bounds; the upper bound if the lower one is 0."""
    # Avoid the product of the two, which may underflow. The mean of equal bounds is exact.
    return lower * sqrt(upper / lower) if lower > 0 else upper


def log_ratio(one: float, other: float) -> float:
    """|Δ ln Q|; 0 if both are sealed, infinite if only one is."""
    low, high = sorted((one, other))
    if low == high:
        return 0.0
    return log(high / low) if low > 0 else inf


def relative_width(lower: float, upper: float) -> float:
    """Relative width (upper - lower) / √(lower upper), limited by `rtol`; 0 if sealed.

    It is infinite if the lower bound alone is 0.
    """
    if lower > 0:
        return (upper / lower - 1) * np.sqrt(lower / upper)
    return np.inf if upper > 0 else 0.0


def relative_half_width(lower: float, upper: float) -> float:
    """Half-width of a bracket over its middle, (upper - lower) / (upper + lower); 0 if sealed."""
    return (upper - lower) / (upper + lower) if upper > 0 else 0.0


def half_width_of(rtol: float) -> float:
    """Relative half-width, as `relative_half_width` gives it, of a bracket of relative width rtol.

    With upper/lower = e^(2u), rtol = 2 sinh u and the half-width is tanh u.
    """
    return tanh(asinh(0.5 * rtol))


@dataclass(frozen=True)
class Estimate:
    """The best estimate of a number, and its bounds where they are known."""

    value: float
    lower: float | None = None
    upper: float | None = None

    def __post_init__(self) -> None:
        require_enclosed(self.lower, self.upper, self.value)

    @property
    def range(self) -> tuple[float, float]:
        """The bounds; the value in place of one that is not known."""
        lower, upper = self.lower, self.upper
        return self.value if lower is None else lower, self.value if upper is None else upper


@dataclass(frozen=True)
class Bounded(Estimate):
    """A number between two bounds."""

    lower: float = dataclasses.field()
    upper: float = dataclasses.field()


@dataclass(frozen=True)
class Factors:
    """Factors on the lower and the upper end of a leak rate; 0 and infinity leave an end open."""

    lower: float = 1.0
    upper: float = 1.0

    def __post_init__(self) -> None:
        if not 0 <= self.lower <= self.upper:
            raise Inconsistent(f"factors of a leak rate: {self.lower} and {self.upper}")

    def __mul__(self, other: "Factors") -> "Factors":
        return Factors(self.lower * other.lower, self.upper * other.upper)

    @classmethod
    def widest(cls, some: Sequence["Factors | None"]) -> "Factors | None":
        """The least lower and the largest upper one; None if there are none, or one is unknown."""
        known = [one for one in some if one is not None]
        if not known or len(known) < len(some):
            return None
        return cls(min(one.lower for one in known), max(one.upper for one in known))

    def beyond(self, own: "Factors") -> "Factors":
        """How much wider these are than `own`, on each side at least 1; 1 where `own` is open."""
        lower = min(self.lower / own.lower, 1.0) if own.lower else 1.0
        upper = max(self.upper / own.upper, 1.0) if own.upper < inf else 1.0
        return Factors(lower, upper)


@dataclass(frozen=True)
class LevelRecord:
    """One mesh of a refinement, with its bounds and cost."""

    unknowns: int  #: unknowns of the primal problem
    cells: int  #: open triangles of the mesh
    lower: float  #: bounds of the leak rate [m^3/s]
    upper: float
    #: iterations and time by stage ("primal", "dual", "mesh", ...). The time to choose the cells to
    #: refine belongs to the finer level
    iterations: dict[str, int] = dataclasses.field(default_factory=dict)
    seconds: dict[str, float] = dataclasses.field(default_factory=dict)
    #: relative error of the energy after each iteration, by stage
    residuals: dict[str, tuple[float, ...]] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        require_enclosed(self.lower, self.upper)

    @property
    def half_width(self) -> float:
        """Relative half-width of the bracket, (upper - lower) / (upper + lower)."""
        return relative_half_width(self.lower, self.upper)


class FacetTag(IntEnum):
    """Numbers of the parts of the boundary of a flow, as tags of the facets of its mesh.

    INLET, OUTLET: the pressure is prescribed. WALL: no fluid crosses it. CONTACT: the gap is 0, or
    carries no flow on the other side, such as in a pocket of a grid; no fluid crosses it either.
    SEAM: the side y = 0 or y = Ly of periodic sides, or a bank of the cut through a ring; flow
    leaves through one and enters through the other, at the same pressure.
    """

    INSIDE = 0
    INLET = 1
    OUTLET = 2
    WALL = 3
    CONTACT = 4
    SEAM = 5


def require_enclosed(lower: float | None, upper: float | None, value: float | None = None) -> None:
    """Raise Inconsistent if bounds cross, or do not hold the value; None is not known."""
    least, most = -inf if lower is None else lower, inf if upper is None else upper
    if not least <= most:
        raise Inconsistent(
            f"the bounds cross: lower {least:.6e} > upper {most:.6e}; "
            "this is a defect of the solver, please report the gap"
        )
    if value is None or least <= value <= most:
        return
    if not any(isclose(value, end, rel_tol=MEAN_ROUNDING) for end in (least, most)):
        raise Inconsistent(f"{value:.6e} is not between {least:.6e} and {most:.6e}")


@dataclass(frozen=True, eq=False)
class FlowField:
    """The flow on the last mesh, for pictures and files."""

    #: (N, 2), coordinates of the corners [m]. A point on a contact line occurs once for each of its
    #: sides
    points: np.ndarray
    cells: np.ndarray  #: (C, 3) int, corners of the triangles that carry flow
    gap: np.ndarray  #: (N,), gap [m]; zero in pockets of a grid
    pressure: np.ndarray  #: (N,), pressure [Pa]
    #: (C, 2), flow density j of the primal solution, volume per time and width [m^2/s]
    flux: np.ndarray
    #: (C, 3) int8, `FacetTag` of the side opposite each corner, INSIDE where another cell
    #: shares the side. None in files that an earlier version wrote
    facet_tags: np.ndarray | None = None

    def __post_init__(self) -> None:
        n, c = len(self.points), len(self.cells)
        shapes = [array.shape for array in (self.points, self.gap, self.pressure, self.flux)]
        inside = c == 0 or (self.cells.min() >= 0 and self.cells.max() < n)
        tagged = self.facet_tags is None or self.facet_tags.shape == (c, 3)
        if shapes != [(n, 2), (n,), (n,), (c, 2)] or not inside or not tagged:
            raise Inconsistent(f"a flow of {n} points and {c} cells: {shapes}")


@dataclass(frozen=True, eq=False, kw_only=True)
class LeakRate(Estimate):
    """Leak rate Q [m³/s]: volume per time through the gap, with bounds if the method has them.

    The value is the best estimate: √(lower upper), or the upper bound if the lower bound is 0. The
    bounds, `slip_interval` included, are guaranteed (estimates of a seal), and None for finite
    differences. A lower bound of 0 of a leaking gap means that no mesh so far was fine enough for a
    stream function, not that Q may be 0. Bounds that cross raise Inconsistent.

    `str(leak)` is a sentence with value and bounds; `repr(leak)` omits levels and field.
    """

    state: FlowState  #: "leaking", "sealed" or "lifted off"
    method: str  #: name of the method
    unknowns: int = 0  #: unknowns of the last solve
    reason: str = ""  #: sentence on why it did not converge; empty if it did
    #: discrete flux of the pressure on the last mesh through inlet and outlet [m^3/s], equal up to
    #: the error of the linear solver. It may exceed the upper bound, since a hierarchical
    #: correction lowers that further
    inflow: float = 0.0
    outflow: float = 0.0
    #: refinement history
    levels: tuple[LevelRecord, ...] = dataclasses.field(default=(), repr=False)
    #: of the iteration of finite differences for "slip": largest change of the pressures over the
    #: inlet's in each step
    residuals: dict[str, tuple[float, ...]] = dataclasses.field(default_factory=dict, repr=False)
    #: flow on the last mesh, if the caller of the solver wanted it
    field: FlowField | None = dataclasses.field(default=None, repr=False)
    #: for a gas with slip: factors <= 1 and >= 1 from the bounds at the mean pressure to `lower`
    #: and `upper`, because the pressure at each place is only known to lie in an interval.
    #: Refinement does not narrow them. The levels hold the bounds at the mean pressure
    slip_interval: Factors | None = None

    def __post_init__(self) -> None:
        require_known(get_args(FlowState), self.state, "state")
        if (self.lower is None) != (self.upper is None):
            raise Inconsistent(f"one bound without the other: {self.lower} and {self.upper} m^3/s")
        super().__post_init__()
        least = self.range[0]
        if not least >= 0 or (self.state == "sealed" and self.value > 0):
            raise Inconsistent(
                f"{self.state}, with a leak rate of {self.value:.6e} m^3/s, at least {least:.6e}"
            )

    @property
    def converged(self) -> bool:
        """Whether the tolerance was reached, or it was decided against the limit."""
        return not self.reason

    @property
    def bounds(self) -> tuple[float, float]:
        """(lower, upper) [m^3/s]; Inconsistent for finite differences, which have none."""
        if self.lower is None or self.upper is None:
            raise Inconsistent(f"a leak rate by {self.method} has no bounds")
        return self.lower, self.upper

    def __str__(self) -> str:
        if self.state == "lifted off":
            return (
                "lifted off: the fluid presses harder than the load; nothing limits the leak rate"
            )
        if self.state == "sealed":
            return "sealed: 0 m^3/s, no open path joins inlet and outlet"
        unfinished = "" if self.converged else f"; {self.reason}"
        rate = rate_text(self.value, self.lower, self.upper, "m^3/s")
        return f"leaking: {rate}, flow only{unfinished}"

    @property
    def refined_bounds(self) -> tuple[float, float]:
        """Bounds [m^3/s] without `slip_interval`: refinement closes their distance."""
        slip, (lower, upper) = self.slip_interval or Factors(), self.bounds
        return lower / slip.lower, upper / slip.upper

    def widened(self, factors: Factors) -> "LeakRate":
        """The same with factors <= 1 and >= 1 on its range.

        A sealed film with an open upper end may leak. One that is lifted off has no finite range.
        """
        if self.state == "lifted off":
            return self
        low, high = self.range
        if factors.upper == inf:
            return dataclasses.replace(self, state="leaking", lower=factors.lower * low, upper=inf)
        return dataclasses.replace(self, lower=factors.lower * low, upper=factors.upper * high)

    @classmethod
    def sealed(cls, method: str) -> "LeakRate":
        """Leak rate of a gap without an open path from inlet to outlet: exactly zero."""
        return cls(state="sealed", method=method, value=0.0, lower=0.0, upper=0.0)

    @classmethod
    def lifted_off(cls, method: str) -> "LeakRate":
        """Leak rate if the fluid lifts the solid off: infinite, as nothing limits the gap."""
        return cls(state="lifted off", method=method, value=inf, lower=inf, upper=inf)


def rate_text(value: float, lower: float | None, upper: float | None, unit: str) -> str:
    """Write a rate with its bounds, if any, rounded outwards, and their relative half-width."""
    if lower is None or upper is None:
        return f"{value:.4g} {unit}, without bounds"
    if upper == 0:
        return f"0 {unit}"
    shown, low, high = bracket_digits(value, lower, upper)
    half_width = per_cent(relative_half_width(lower, upper))
    return f"{shown} {unit}, within [{low}, {high}] (±{half_width})"
