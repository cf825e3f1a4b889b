"""Price and error of the three settings of flow.lift: none, range, resolved.

All three are computed on each contact grid and compared with the resolved leak rate on that grid.
The leak rate of the dry contact differs from it; the range encloses it.
"""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from time import process_time

from fem_seal.errors import InvalidInput, present
from fem_seal.files import temporary_folder
from fem_seal.memory import peak_memory
from fem_seal.parallel import Comm
from fem_seal.patch import Patch
from fem_seal.points import Chain, RecordFolder, Task, Work, compute_study
from fem_seal.progress import Report, silent
from fem_seal.scene import Scene
from fem_seal.surface.resampling import resample
from fem_seal.sweep.point import name_of
from fem_seal.tables import shown_as
from fem_seal.verification.trade import forget_peak, surface_of, trade_grids, warm_up

FACTORS = (0.25, 0.5, 1.0)
LIFTS = ("none", "range", "resolved")


@dataclass(frozen=True)
class LiftRun:
    """Leak rate with one setting of flow.lift on one contact grid."""

    samples: tuple[int, int]  #: (nx, ny), samples of the contact grid
    lift: str  #: setting of flow.lift: "none", "range" or "resolved"
    #: leak rate [m³/s]; for "range" that of the dry contact
    leak_rate: float = field(metadata=shown_as("leak rate [m^3/s]"))
    #: ends of the leak rate [m³/s]: bounds of the dry flow; ends of the range; bounds of the lifted
    #: flow, widened by the uncertainty of the passes. None if there is no end
    lower: float | None = field(metadata=shown_as("at least [m^3/s]"))
    upper: float | None = field(metadata=shown_as("at most [m^3/s]"))
    converged: bool  #: whether the tolerance was reached
    #: CPU time of contact, flow and lift [s]
    seconds: float = field(metadata=shown_as("CPU time [s]"))
    #: largest resident memory of the process during the solve, libraries included
    memory_bytes: int = field(metadata=shown_as("memory [byte]"))


@dataclass(frozen=True)
class LiftRow(LiftRun):
    """A `LiftRun` compared with the resolved one on its grid."""

    #: largest factor between an end of the leak rate and the resolved leak rate; None if there is
    #: no end, or only one of the two is sealed
    off: float | None = field(default=None, metadata=shown_as("off by a factor"))
    dry_runs: float = 1.0  #: CPU time over that of the dry contact and its flow


@dataclass(frozen=True)
class LiftTask(Task[LiftRun]):
    """Task of one setting of flow.lift on one contact grid."""

    scene: Scene  #: the scene with its flow.lift
    samples: tuple[int, int]  #: (nx, ny), samples of the contact grid

    def compute(self, handed_on: object, report: Report, comm: Comm) -> LiftRun:
        """Solve the scene from its surface; tasks share nothing, so that their times compare."""
        warm_up()
        surface = resample(surface_of(self.scene, comm), self.samples)
        patch = Patch(self.scene, report, surface=surface, comm=comm)
        forget_peak()
        start = process_time()
        leak = patch.leak_rate
        lower, upper, converged = leak.lower, leak.upper, leak.converged
        if self.scene.lift == "range":
            ends = patch.lift_range
            lower, upper = ends[0].lower, ends[1].upper
            converged = converged and all(end.converged for end in ends)
        elif self.scene.lift == "resolved" and leak.lower:
            claimed = 1 + present(patch.lifted, "lifted state").claimed
            lower, upper = leak.bounds[0] / claimed, leak.bounds[1] * claimed
        return LiftRun(
            samples=self.samples,
            lift=self.scene.lift,
            leak_rate=leak.value,
            lower=lower,
            upper=None if upper == float("inf") else upper,
            converged=converged,
            seconds=process_time() - start,
            memory_bytes=peak_memory(),
        )


def lift_price(
    scene: Scene,
    *,
    factors: Sequence[float] = FACTORS,
    out: Path | None = None,
    work: Work | None = None,
    report: Report = silent,
) -> list[LiftRow] | None:
    """Compute a scene with the three settings of flow.lift over contact grids.

    Parameters
    ----------
    scene : scene with a surface and a contact that a fluid can lift; its flow.lift is not used
    factors, out, work : as of `trade`

    Returns
    -------
    Three for each grid; None if some are left to other parts of the study.
    """
    if scene.flow.method == "finite-difference":
        raise InvalidInput(
            "the answers are compared by their bounds, and flow.method = 'finite-difference' has "
            "none; choose adaptive or uniform"
        )
    scenes = [_with_lift(scene, lift) for lift in LIFTS]
    with ExitStack() as held:
        if out is None:
            out = held.enter_context(temporary_folder())
        folder = RecordFolder(out / "points", LiftRun)
        chains = [
            Chain(folder, tuple(_task(one, samples) for one in scenes))
            for samples in trade_grids(surface_of(scene, None).shape, factors)
        ]
        if compute_study(chains, work, report).missing:
            return None
        runs = [[folder.point(task.name) for task in chain.tasks] for chain in chains]
    return [row for of_grid in runs for row in judged([run for run in of_grid if run])]


def _with_lift(scene: Scene, lift: str) -> Scene:
    mapping = scene.to_mapping()
    mapping["flow"]["lift"] = lift
    mapping["output"] = {"products": ["leak_rate"]}
    return Scene.from_mapping(mapping)


def _task(scene: Scene, samples: tuple[int, int]) -> LiftTask:
    grid = f"{samples[0]}x{samples[1]}"
    name = f"{name_of(scene)}-{grid}-lift-{scene.lift}"
    return LiftTask(name, f"contact {grid}, lift {scene.lift}", scene, samples)


def judged(runs: Sequence[LiftRun]) -> list[LiftRow]:
    """Compare the leak rates on one grid, in the order of LIFTS, with the resolved one."""
    dry, _, resolved = runs
    return [
        LiftRow(
            **vars(run),
            off=_largest_factor(run, resolved.leak_rate),
            dry_runs=run.seconds / dry.seconds,
        )
        for run in runs
    ]


def _largest_factor(run: LiftRun, exact: float) -> float | None:
    """Largest factor between an end of a run's leak rate and the exact one, in either direction."""
    if run.lower is None or run.upper is None:
        return None
    ends = (run.lower, run.upper)
    if exact == 0 or 0 in ends:
        return 1.0 if max(ends) == exact == 0 else None
    return max(max(end / exact, exact / end) for end in ends)
