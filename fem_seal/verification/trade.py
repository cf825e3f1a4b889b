"""Cost of accuracy: contact grids × flow methods × tolerances, error against time and memory.

The error of a leak rate has two parts. The flow part is the half-width of the guaranteed bracket,
or, for finite differences, the distance from the far end of the narrowest bracket of the same gap.
The contact part is the discretization error of the contact. The same surface is solved under the
same load on finer and finer grids; the distance of each leak rate from that on the finest grid, and
what a still finer one would change (`grid_series.grid_error`, also for a measured map, and without
the linear gap beside constant pixels), are together its contact part. Grids that are sealed where
the finest leaks are left out: they have no leak rate to compare.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import expm1, inf
from pathlib import Path
from time import process_time

import numpy as np

from fem_seal.digits import per_cent
from fem_seal.errors import InvalidInput, present
from fem_seal.film import GridFilm
from fem_seal.flow_settings import FlowSettings
from fem_seal.grid import GridField
from fem_seal.grid_series import (
    LEAST_SAMPLES,
    change_of,
    counting_error,
    critical_gap,
    grid_error,
    unresolved,
)
from fem_seal.leak_rate import Estimate, FlowState, relative_half_width
from fem_seal.memory import peak_memory
from fem_seal.parallel import Comm
from fem_seal.patch import Given, Patch
from fem_seal.points import Task, Work, points_of
from fem_seal.progress import Report, silent
from fem_seal.scene import Scene
from fem_seal.surface.resampling import resample
from fem_seal.sweep.point import numbers_only

# Samples of the contact over the scene's, and tolerances of the flow, of the runs.
FACTORS = (0.25, 0.5, 1.0, 2.0)
TOLERANCES = (0.3, 0.1, 0.03)
# Columns of the tables on a terminal.
TRADE_COLUMNS = (
    "total_error", "samples", "flow", "leak_rate", "contact_error", "flow_error", "seconds",
)  # fmt: skip
TARGETS = (0.5, 0.2, 0.1, 0.05, 0.02)  # total errors for which the cheapest point is named


@dataclass(frozen=True)
class FlowMethod:
    """A flow method with its tolerance."""

    #: "adaptive", "uniform" or "finite-difference": name of the method, as in flow.method
    method: str
    rtol: float | None  #: relative width of the bracket; None if the method has no tolerance
    unknowns: int | None = None  #: limit; 1 stops "uniform" on its first mesh, the grid of the gap

    def __str__(self) -> str:
        return self.method if self.rtol is None else f"{self.method}, rtol {self.rtol:g}"


@dataclass(frozen=True)
class Run:
    """A flow solve on one contact grid, with its cost."""

    samples: tuple[int, int]  #: (nx, ny), samples of the contact grid
    flow: FlowMethod  #: flow method and its tolerance
    state: FlowState  #: state of the leak rate, such as "leaking"
    #: leak rate of the dry contact [m³/s]
    leak_rate: float = field(metadata={"header": "Q [m^3/s]"})
    #: bounds of the leak rate [m³/s]; None for finite differences
    lower: float | None = field(metadata={"header": "lower [m^3/s]"})
    upper: float | None = field(metadata={"header": "upper [m^3/s]"})
    converged: bool  #: whether the tolerance was reached
    #: CPU time of contact and flow [s]
    seconds: float = field(metadata={"header": "CPU time [s]"})
    contact_seconds: float  #: CPU time of the contact alone [s]
    #: largest resident memory of the process during the flow solve, libraries included
    memory_bytes: int
    critical_gap: float  #: gap of the critical constriction [m]; 0 if sealed
    unresolved: float  #: height that the grid leaves out between its samples [m]
    #: see `grid_series.counting_error`; None if sealed, or unless the area is prescribed
    counting_error: float | None

    @property
    def certified(self) -> bool:
        """Whether the leak rate comes with bounds."""
        return self.lower is not None

    @property
    def bounds(self) -> tuple[float, float]:
        """Lower and upper bound [m³/s], for a method with bounds."""
        return present(self.lower, "lower"), present(self.upper, "upper")


@dataclass(frozen=True)
class TradePoint(Run):
    """A `Run` with its relative errors; the total is the sum of the other two."""

    contact_error: float = field(metadata={"header": "contact grid's"})
    flow_error: float = field(metadata={"header": "flow's"})
    total_error: float = field(metadata={"header": "total error"})


@dataclass(frozen=True)
class ContactGrid(Task[tuple[Run, ...]]):
    """Contact on a grid, and the flows through it, one after the other."""

    scene: Scene
    samples: tuple[int, int]
    flows: tuple[FlowMethod, ...]

    def compute(self, report: Report, comm: Comm) -> tuple[Run, ...]:
        """Solve the contact, then the flows."""
        _warm_up(comm)
        surface = resample(surface_of(self.scene, comm), self.samples)
        pressed = Patch(self.scene, report, given=Given(surface), comm=comm)
        start = process_time()
        contact = pressed.contact
        of_contact = process_time() - start
        flow, runs = replace(self.scene.flow_settings, decide=None, field=False), []
        for own in self.flows:
            differences = own.method == "finite-difference"
            settings = replace(
                flow,
                method=own.method,
                rtol=own.rtol or flow.rtol,
                limits=replace(
                    flow.limits,
                    unknowns=None if differences else own.unknowns or flow.limits.unknowns,
                ),
                link_rule=flow.link_rule if differences else FlowSettings.link_rule,
            )
            patch = pressed.with_(Given(contact=contact, lift="none", flow_settings=settings))
            # Reset the kernel's largest resident memory of this process (proc(5)), where it can be.
            with suppress(OSError):
                Path("/proc/self/clear_refs").write_text("5")
            start = process_time()
            leak = patch.leak_rate
            seconds, memory = process_time() - start, peak_memory()
            leaks = leak.state == "leaking"
            runs.append(
                Run(
                    samples=self.samples,
                    flow=own,
                    state=leak.state,
                    leak_rate=leak.value,
                    lower=leak.lower,
                    upper=leak.upper,
                    converged=leak.converged,
                    seconds=of_contact + seconds,
                    contact_seconds=of_contact,
                    memory_bytes=memory,
                    critical_gap=critical_gap(patch) if leaks else 0.0,
                    unresolved=unresolved(surface),
                    counting_error=counting_error(patch) if leaks else None,
                )
            )
        return tuple(runs)


@dataclass(frozen=True)
class Trade:
    """Leak rates of one scene over contact grids and flow methods."""

    points: tuple[TradePoint, ...]  #: all leak rates with errors and cost
    reference: float  #: best leak rate on the finest contact grid [m³/s]
    uncertainty: float  #: what a finer grid may change of it, relative; infinite if not known
    sealed: tuple[tuple[int, int], ...] = ()  #: contact grids left out, since they are sealed

    def front(self, certified: bool) -> tuple[TradePoint, ...]:
        """Pareto front: points that no other one beats in time and error, the fastest point first.

        Points with and without bounds are compared separately: the error of a point without bounds
        is known only because the others were computed as well.
        """
        kind = [point for point in self.points if point.certified == certified]
        front: list[TradePoint] = []
        for point in sorted(kind, key=lambda p: (p.seconds, p.total_error)):
            if not front or point.total_error < front[-1].total_error:
                front.append(point)
        return tuple(front)


def trade(
    scene: Scene,
    *,
    factors: Sequence[float] = FACTORS,
    tolerances: Sequence[float] = TOLERANCES,
    out: Path | None = None,
    work: Work | None = None,
    report: Report = silent,
) -> Trade | None:
    """Compute the dry contact of a scene over contact grids and flow methods.

    The scene has a surface and a contact; its flow method and rtol are not used. The factors are
    multiples of its samples, at least three that give whole numbers; below 1 the surface loses the
    waves shorter than two samples of the coarse grid. The tolerances are those of the adaptive
    method. Each contact grid is a point of the study (`points_of`); jobs that run at the same time
    slow each other down, also in CPU time.

    Returns None if some points are left to other parts of the study.
    """
    grids = trade_grids(surface_of(scene, (work or Work()).comm).shape, factors)
    adaptive = [FlowMethod("adaptive", rtol) for rtol in sorted(tolerances, reverse=True)]
    flows = FlowMethod("finite-difference", None), FlowMethod("uniform", None, 1), *adaptive
    inputs = numbers_only(scene).fingerprint(repr(flows))
    tasks = [
        ContactGrid(f"{inputs}-{k}", f"contact {_size(samples)}", scene, samples, flows)
        for k, samples in enumerate(grids)
    ]
    points = points_of(tasks, tuple[Run, ...], out, work, report)
    if points is None:
        return None
    runs = [run for point in points for run in point]
    return trade_of(runs)


def surface_of(scene: Scene, comm: Comm = None) -> GridField:
    """Surface of a scene; InvalidInput if it gives a gap instead."""
    surface = Patch(scene, comm=comm).surface
    if surface is None:
        raise InvalidInput(
            "a trade needs [surface] and [contact]: the contact of a given gap cannot be solved "
            "on another grid"
        )
    return surface


def _warm_up(comm: Comm) -> None:
    """Import the libraries, and compile the forms, before the time of the first point is taken."""
    from fem_seal.flow import leak_rate

    leak_rate(
        GridFilm(GridField(np.ones((8, 8)), (1.0, 1.0))),
        FlowSettings(1.0, 1.0),
        comm=comm,
    )


def trade_grids(shape: tuple[int, int], factors: Sequence[float]) -> list[tuple[int, int]]:
    """Contact grids: samples times factors that give whole numbers, the coarsest first."""
    scaled = [(shape[0] * float(factor), shape[1] * float(factor)) for factor in sorted(factors)]
    whole = [
        (int(nx), int(ny))
        for nx, ny in scaled
        if all(n.is_integer() and n >= LEAST_SAMPLES for n in (nx, ny))
    ]
    if len(whole) < 3:
        raise InvalidInput(
            f"a trade needs three contact grids of whole, at least {LEAST_SAMPLES} samples; "
            f"of {shape} the factors {tuple(factors)} give {len(whole)}"
        )
    return whole


def trade_of(runs: Sequence[Run]) -> Trade:
    """Errors of runs on grids from coarse to fine."""
    # The tolerances fall: the last adaptive run on each grid is the most accurate.
    best = {run.samples: run for run in runs if run.flow.method == "adaptive"}
    *_, coarser, finest = best.values()
    if finest.state == "sealed":
        raise InvalidInput("the finest contact is sealed: there is no leak rate to trade for")
    reference = finest.leak_rate
    change = change_of(Estimate(coarser.leak_rate), Estimate(reference))
    unresolved_share = finest.unresolved / finest.critical_gap
    estimated = expm1(grid_error(change, unresolved_share, finest.counting_error).log_error)
    uncertainty = max(estimated, relative_half_width(*finest.bounds))
    sealed = tuple(samples for samples, run in best.items() if run.state == "sealed")
    points = tuple(
        _point(run, best[run.samples], reference, uncertainty)
        for run in runs
        if run.samples not in sealed
    )
    return Trade(points, reference, uncertainty, sealed)


def _point(run: Run, best: Run, reference: float, uncertainty: float) -> TradePoint:
    """Split the error of a run; `best` is the most accurate one on the same contact grid."""
    contact = abs(best.leak_rate / reference - 1) + uncertainty
    lower, upper = best.bounds
    away = max(run.leak_rate - lower, upper - run.leak_rate) / reference
    flow = relative_half_width(*run.bounds) if run.certified else away
    return TradePoint(
        **vars(run), contact_error=contact, flow_error=flow, total_error=contact + flow
    )


def recommend(result: Trade) -> tuple[str, ...]:
    """Sentence on the cheapest point of a trade for each of the TARGETS.

    A single one if a finer grid than all may change the leak rate by its own size. Before them, one
    for each grid that was left out.
    """
    left_out = tuple(
        f"contact on {_size(samples)} is left out: it is sealed there, and leaks on the finest grid"
        for samples in result.sealed
    )
    if result.uncertainty >= 1:
        known = f"known to {100 * result.uncertainty:.0f} % only"
        return (
            *left_out,
            "nothing to recommend: a finer grid may change the leak rate so much that it is "
            f"{known if result.uncertainty < inf else 'not known'}; take more samples",
        )
    return *left_out, *(_advice(result, target) for target in TARGETS)


def _advice(result: Trade, target: float) -> str:
    prefix = f"for {100 * target:g} %"
    accurate = [point for point in result.points if point.total_error <= target]
    if not accurate:
        best = _describe(min(result.points, key=lambda point: point.total_error))
        return f"{prefix}: no setting tried is that accurate; the most accurate is {best}"
    cheapest = min(accurate, key=lambda point: point.seconds)
    certified = [point for point in accurate if point.certified]
    if not certified:
        return f"{prefix}: only without bounds, {_describe(cheapest)}"
    bounded = min(certified, key=lambda point: point.seconds)
    if bounded is cheapest:
        return f"{prefix}: {_describe(bounded)}"
    return f"{prefix}: {_describe(bounded)}; without bounds of its own {_describe(cheapest)}"


def _size(samples: tuple[int, int]) -> str:
    return "{} x {}".format(*samples)


def _describe(point: TradePoint) -> str:
    return (
        f"contact on {_size(point.samples)}, {point.flow}: about {point.seconds:.2g} s and "
        f"{point.memory_bytes / 1e6:.0f} MB (contact grid {per_cent(point.contact_error)}, "
        f"flow {per_cent(point.flow_error)})"
    )
