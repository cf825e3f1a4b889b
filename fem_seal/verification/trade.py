"""Cost of accuracy: contact grids × flow methods × tolerances, error against time and memory.

The error of a leak rate has two parts. The flow part is the half-width of the certified bracket,
or, for finite differences, the distance from the best answer on the same gap. The contact part is
the discretization error of the contact: the same surface under the same load is solved on finer and
finer grids, and the distance of each leak rate from the extrapolated one is its contact part.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from time import process_time

import numpy as np

from fem_seal.contact.grid_error import extrapolate
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate, relative_half_width
from fem_seal.memory import peak_memory
from fem_seal.patch import Patch
from fem_seal.progress import Report, silent
from fem_seal.scene import Scene
from fem_seal.surface.resampling import resample
from fem_seal.tables import shown_as

FACTORS = (0.25, 0.5, 1.0, 2.0)
TOLERANCES = (0.3, 0.1, 0.03)
LEAST_SAMPLES = 8


@dataclass(frozen=True)
class Choice:
    """A flow method with its tolerance.

    Parameters
    ----------
    method : "adaptive", "uniform" or "finite-difference"
        Name of the method, as in flow.method.
    rtol : float or None
        Relative width of the bracket; None if the method has no tolerance.
    """

    method: str
    rtol: float | None

    def __str__(self) -> str:
        return self.method if self.rtol is None else f"{self.method}, rtol {self.rtol:g}"


@dataclass(frozen=True)
class Point:
    """One leak rate, its error and its cost.

    Attributes
    ----------
    samples : (nx, ny)
        Samples of the contact grid.
    flow : Choice
        Flow method and its tolerance.
    leak_rate, lower, upper : float
        Leak rate with its bounds [m^3/s]; finite differences have no bounds.
    contact_error, flow_error, total_error : float
        Relative errors; the total is the sum of the other two.
    seconds : float
        CPU time [s] of contact and flow.
    contact_seconds : float
        CPU time [s] of the contact alone.
    memory_bytes : int
        Largest resident memory of the process during the flow solve, libraries included.
    pareto : bool
        Whether no other point of its kind, with or without bounds, is both faster and more
        accurate.
    """

    samples: tuple[int, int]
    flow: Choice
    leak_rate: float = field(metadata=shown_as("leak rate [m^3/s]"))
    lower: float | None = field(metadata=shown_as("lower [m^3/s]"))
    upper: float | None = field(metadata=shown_as("upper [m^3/s]"))
    contact_error: float = field(metadata=shown_as("contact error/Q"))
    flow_error: float = field(metadata=shown_as("flow error/Q"))
    total_error: float = field(metadata=shown_as("total error/Q"))
    seconds: float = field(metadata=shown_as("CPU time [s]"))
    contact_seconds: float = field(metadata=shown_as("its contact [s]"))
    memory_bytes: int = field(metadata=shown_as("memory [byte]"))
    pareto: bool = False

    @property
    def certified(self) -> bool:
        """Whether the leak rate comes with bounds."""
        return self.lower is not None


@dataclass(frozen=True, eq=False)
class _Run:
    """A flow solve on one contact grid, before its error is known."""

    samples: tuple[int, int]
    flow: Choice
    leak: LeakRate
    seconds: float
    contact_seconds: float
    memory_bytes: int


@dataclass(frozen=True)
class Trade:
    """Leak rates of one scene over contact grids and flow methods.

    Attributes
    ----------
    points : tuple[Point, ...]
        All leak rates with errors and cost.
    reference : float
        Leak rate extrapolated to a contact grid of spacing 0 [m^3/s].
    uncertainty : float
        Relative uncertainty of the reference.
    """

    points: tuple[Point, ...]
    reference: float
    uncertainty: float

    def front(self, certified: bool) -> tuple[Point, ...]:
        """Pareto front, the fastest point first, of the points with or without bounds."""
        points = (p for p in self.points if p.pareto and p.certified == certified)
        return tuple(sorted(points, key=lambda p: p.seconds))


def trade(
    scene: Scene,
    *,
    factors: Sequence[float] = FACTORS,
    tolerances: Sequence[float] = TOLERANCES,
    report: Report = silent,
) -> Trade:
    """Compute a scene over contact grids and flow methods.

    Parameters
    ----------
    scene : with a surface and a contact; its flow method and rtol are not used
    factors : multiples of the scene's samples, at least three that give whole numbers; below 1
        the surface loses the waves shorter than two samples of the coarse grid
    tolerances : rtol of the adaptive method
    report : called with the stage and its progress

    Returns
    -------
    Trade

    Raises
    ------
    InvalidInput
        If the scene gives a gap in place of a surface, fewer than three grids are possible, or the
        finest contact is sealed.
    NotConverged
        If a contact does not reach its tolerance.
    """
    surface = Patch(scene, report).surface
    if surface is None:
        raise InvalidInput(
            "a trade needs [surface] and [contact]: the contact of a given gap cannot be solved "
            "on another grid"
        )
    runs: list[_Run] = []
    shapes = _shapes(surface.shape, factors)
    _warm_up()
    for shape in shapes:
        runs.extend(_on_grid(scene, resample(surface, shape), tolerances, report))
    return _judged(runs)


def _warm_up() -> None:
    """Import the libraries, so that the first point's time does not include it."""
    from fem_seal.flow import leak_rate

    leak_rate(GridField(np.ones((8, 8)), (1.0, 1.0)), viscosity=1.0, pressure_drop=1.0)


def _shapes(shape: tuple[int, int], factors: Sequence[float]) -> list[tuple[int, int]]:
    ratios = sorted(Fraction(factor).limit_denominator(1024) for factor in factors)
    scaled = [(shape[0] * ratio, shape[1] * ratio) for ratio in ratios]
    whole = [
        (int(nx), int(ny))
        for nx, ny in scaled
        if all(n.denominator == 1 and n >= LEAST_SAMPLES for n in (nx, ny))
    ]
    if len(whole) < 3:
        raise InvalidInput(
            f"a trade needs three contact grids of whole, at least {LEAST_SAMPLES} samples; "
            f"of {shape} the factors {tuple(factors)} give {len(whole)}"
        )
    return whole


def _choices(tolerances: Sequence[float]) -> list[Choice]:
    adaptive = [Choice("adaptive", rtol) for rtol in sorted(tolerances, reverse=True)]
    return [Choice("finite-difference", None), Choice("uniform", None), *adaptive]


def _on_grid(
    scene: Scene, surface: GridField, tolerances: Sequence[float], report: Report
) -> list[_Run]:
    """Solve the contact once and the flow by every method."""
    patch = Patch(scene, surface=surface)
    name = " x ".join(map(str, surface.shape))
    report(f"contact {name}", "")
    start = process_time()
    contact = patch.contact
    contact_seconds = process_time() - start
    runs = []
    for choice in _choices(tolerances):
        report(f"contact {name}", str(choice))
        # A limit of one unknown stops the uniform method on its first mesh, the grid of the gap.
        limits = {"max_unknowns": 1 if choice.method == "uniform" else scene.flow.max_unknowns}
        flow = scene.flow.model_copy(
            update={"method": choice.method, "rtol": choice.rtol or scene.flow.rtol, **limits}
        )
        patch = Patch(
            scene.model_copy(update={"flow": flow}), surface=surface, contact=contact
        )
        _forget_peak()
        start = process_time()
        leak = patch.leak_rate
        spent = contact_seconds + process_time() - start
        run = _Run(surface.shape, choice, leak, spent, contact_seconds, peak_memory())
        runs.append(run)
    return runs


def _forget_peak() -> None:
    """Reset the kernel's record of the largest resident memory (proc(5), clear_refs)."""
    Path("/proc/self/clear_refs").write_text("5")


def _judged(runs: Sequence[_Run]) -> Trade:
    # Tolerances fall, so that the last adaptive run on each grid is the most accurate.
    best = {run.samples: run.leak for run in runs if run.flow.method == "adaptive"}
    finest = list(best.values())[-1]
    if finest.state == "sealed":
        raise InvalidInput("the finest contact is sealed: there is no leak rate to trade for")
    limit = extrapolate([leak.value for leak in best.values()])
    reference = limit.limit if limit.limit > 0 else finest.value
    uncertainty = max(limit.error / reference, relative_half_width(*finest.bounds))
    points = [_point(run, best[run.samples].value, reference, uncertainty) for run in runs]
    return Trade(mark_pareto(points), reference, uncertainty)


def _point(run: _Run, best: float, reference: float, uncertainty: float) -> Point:
    """Split the error of a run; `best` is the best leak rate on the same contact grid."""
    leak = run.leak
    contact_error = max(abs(best / reference - 1), uncertainty)
    flow_error = (
        abs(leak.value - best) / reference
        if leak.lower is None
        else relative_half_width(*leak.bounds)
    )
    return Point(
        samples=run.samples,
        flow=run.flow,
        leak_rate=leak.value,
        lower=leak.lower,
        upper=leak.upper,
        contact_error=contact_error,
        flow_error=flow_error,
        total_error=contact_error + flow_error,
        seconds=run.seconds,
        contact_seconds=run.contact_seconds,
        memory_bytes=run.memory_bytes,
    )


def mark_pareto(points: Sequence[Point]) -> tuple[Point, ...]:
    """Mark the points that no other one of their kind beats in time and error.

    Points with bounds are compared among themselves, and points without bounds, whose error is
    known only because the others were computed as well, among themselves.
    """
    return tuple(replace(point, pareto=not _beaten(point, points)) for point in points)


def _beaten(point: Point, points: Sequence[Point]) -> bool:
    cost = point.seconds, point.total_error
    others = ((p.seconds, p.total_error) for p in points if p.certified == point.certified)
    return any(o[0] <= cost[0] and o[1] <= cost[1] and o != cost for o in others)
