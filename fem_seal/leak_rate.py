"""LeakRate: what every flow solver returns, finite elements and finite differences alike."""

from dataclasses import dataclass, field

import numpy as np

from fem_seal.digits import bracket_digits
from fem_seal.errors import Inconsistent


def relative_width(lower: float, upper: float) -> float:
    """Width of a bracket, (upper - lower) / √(lower upper), which `rtol` limits.

    Infinite without a lower bound above zero.
    """
    # The product of the two may be below what double precision holds.
    return (upper / lower - 1) * np.sqrt(lower / upper) if lower > 0 else np.inf


def relative_half_width(lower: float, upper: float) -> float:
    """Half-width of a bracket over its middle, (upper - lower) / (upper + lower); 0 if sealed."""
    return (upper - lower) / (upper + lower) if upper > 0 else 0.0


@dataclass(frozen=True)
class Level:
    """One mesh of a refinement and the bounds it gave.

    unknowns : primal unknowns; cells : open triangles of the mesh
    lower, upper : bounds of the leak rate [m^3/s]
    iterations, seconds : by stage ("primal", "dual", "mesh", ...); choosing the cells to refine
        counts to the level that comes of it
    """

    unknowns: int
    cells: int
    lower: float
    upper: float
    iterations: dict[str, int] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def half_width(self) -> float:
        """Relative half-width of the bracket, (upper - lower) / (upper + lower)."""
        return relative_half_width(self.lower, self.upper)


@dataclass(frozen=True, eq=False)
class FlowField:
    """The flow on the last mesh, for pictures and files.

    points : (N, 2) float [m]; points on contact lines stand once for each side
    cells : (C, 3) int, into points; only cells that carry flow
    gap : (N,) [m], zero in pockets on a grid, which no flow reaches; pressure : (N,) [Pa]
    flux : (C, 2) [m^2/s], volume per second and width, of the primal solution
    """

    points: np.ndarray
    cells: np.ndarray
    gap: np.ndarray
    pressure: np.ndarray
    flux: np.ndarray


@dataclass(frozen=True, eq=False)
class LeakRate:
    """Volume per second through the gap [m^3/s], with bounds where the method has them.

    state : "leaking" or "sealed"
    value : best estimate: √(lower upper), or the upper bound where no lower one above 0 is known,
        and then nothing but a bound
    lower, upper : guaranteed bounds or None. A lower bound of 0 says that no mesh so far was fine
        enough to let a stream function through, not that the leak may be zero: a gap without an
        open path has the state "sealed"
    unknowns : of the last solve; converged : the tolerance asked for was reached
    reason : one sentence when converged is False, else ""
    inflow, outflow : discrete flux through inlet and outlet [m^3/s]; equal up to the solver. Those
        of the pressure on the last mesh, whose energy the upper bound may improve upon: they can
        lie above it
    levels : the refinement history; field : the flow on the last mesh, if it was asked for

    Its text, str(leak), is for people; its representation leaves levels and field out.
    """

    state: str
    method: str
    value: float
    lower: float | None = None
    upper: float | None = None
    unknowns: int = 0
    converged: bool = True
    reason: str = ""
    inflow: float = 0.0
    outflow: float = 0.0
    levels: tuple[Level, ...] = field(default=(), repr=False)
    field: FlowField | None = field(default=None, repr=False)

    def __post_init__(self):
        if self.lower is not None and not self.lower <= self.upper:
            raise Inconsistent(
                f"the bounds cross: lower {self.lower:.6e} > upper {self.upper:.6e} m^3/s; "
                "this is a defect of the solver, please report the gap"
            )

    def __str__(self):
        if self.state == "sealed":
            return "sealed: 0 m^3/s, no open path joins inlet and outlet"
        unfinished = "" if self.converged else f"; {self.reason}"
        return f"leaking: {rate_text(self.value, self.lower, self.upper, 'm^3/s')}{unfinished}"

    @classmethod
    def sealed(cls, method: str) -> "LeakRate":
        """No open path joins inlet and outlet: the leak rate is exactly zero, without a solve."""
        return cls(state="sealed", method=method, value=0.0, lower=0.0, upper=0.0)


def rate_text(value: float, lower: float | None, upper: float | None, unit: str) -> str:
    """Write a rate with its bounds, which are rounded outwards, and half their distance.

    Parameters
    ----------
    value, lower, upper : in `unit`; no bounds (None) for finite differences
    """
    if lower is None or upper is None:
        return f"{value:.4g} {unit}, without bounds"
    if upper == 0:
        return f"0 {unit}"
    shown, low, high = bracket_digits(value, lower, upper)
    per_cent = 100 * relative_half_width(lower, upper)
    half_width = f"{per_cent:.2g}" if per_cent < 99 else f"{per_cent:.0f}"
    return f"{shown} {unit}, within [{low}, {high}] (±{half_width} %)"
