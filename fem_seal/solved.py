"""The runner: from a scene to its answer, `Solved`, and to its result folder."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from time import perf_counter

from fem_seal import parallel
from fem_seal.accuracy import Choice, Chosen, chosen_patch
from fem_seal.contact.state import ContactState, GapState
from fem_seal.error_budget import ErrorBudget
from fem_seal.errors import InvalidInput
from fem_seal.files import PATCHES
from fem_seal.film import GridFilm
from fem_seal.grid_series import half_in_worker
from fem_seal.leak_rate import FlowState, LeakRate
from fem_seal.memory import peak_memory
from fem_seal.patch import Patch
from fem_seal.points import Work
from fem_seal.prediction import predicted
from fem_seal.products import file_names, require_packages, write_products
from fem_seal.progress import NOTE, Report, silent
from fem_seal.quantities.cautions import cautions
from fem_seal.quantities.headline import Headline, ShownUnit, headline
from fem_seal.quantities.lift import lift_range
from fem_seal.quantities.of_patch import Quantities, quantities
from fem_seal.quantities.seal import as_uncertain, seal_advice, seal_budget
from fem_seal.quantities.uncertainties import error_budget
from fem_seal.quantities.verdict import Verdict, verdict
from fem_seal.results import Result, ResultFolder
from fem_seal.results.records import GasRecord, LiftRecord, Rate, SealRecord
from fem_seal.results.result import Origin, Provenance
from fem_seal.scene import Scene
from fem_seal.scene.scene import require_scene
from fem_seal.upscaling.realizations import realizations
from fem_seal.upscaling.scene_profile import leak_path_of
from fem_seal.upscaling.seal import SealLeak, solve_seal, under_less_load
from fem_seal.worker import peak_of_workers

# Lower loads of a sealed seal may take half of the predicted time of the run, at least this [s].
LEAST_SECONDS = 60.0


@dataclass(frozen=True, eq=False)
class Solved:
    """The answer of a scene; `str(solved)` is its headline."""

    patch: Patch  #: surface, contact, film and flow of the patch, the first one of a seal
    leak_rate: LeakRate | None  #: flow only, of the seal where the scene has one; None if not asked
    budget: ErrorBudget  #: all reasons for which the leak rate is uncertain
    seal: SealLeak | None
    quantities: Quantities | None
    cautions: tuple[str, ...]
    choice: Choice | None  #: contact grid and tolerance that [accuracy] has chosen
    seconds: float  #: time of the solution

    @property
    def state(self) -> FlowState:
        """Whether fluid flows through the seal, or through the patch of a scene without one."""
        return self.patch.state if self.seal is None else self.seal.state

    @cached_property
    def headline(self) -> Headline | None:
        """The leak rate with all counted errors."""
        if self.leak_rate is None:
            return None
        return headline(self.leak_rate, self.budget, ShownUnit.of(self.patch.scene))

    @cached_property
    def verdict(self) -> Verdict | None:
        """How the headline compares with the limit of the scene."""
        if self.leak_rate is None:
            return None
        seal, budget = self.seal, self.budget
        advice = None if seal is None else seal_advice(self.patch, seal, budget)
        return verdict(self.patch.scene, self.leak_rate, budget, advice)

    @property
    def reason(self) -> str:
        """Why it has not converged; empty if it has."""
        patch, scene = self.patch, self.patch.scene
        flows = [patch.leak_rate if scene.solves_flow else None, self.leak_rate]
        if scene.lift == "range":
            flows += lift_range(patch)
        tensor = None if self.quantities is None else self.quantities.conductivity_tensor
        reasons = [flow.reason for flow in (*flows, tensor) if flow is not None and flow.reason]
        undecided = self.verdict is not None and self.verdict.decision == "undecided"
        if undecided and not reasons and scene.deciding_rate is not None:
            return "limit.decide asks for a decision, and the verdict is undecided"
        return "; ".join(dict.fromkeys(reasons))

    @property
    def converged(self) -> bool:
        """Whether all flows have reached their tolerance, or the decision that is asked for."""
        return not self.reason

    @property
    def contact(self) -> GapState | None:
        """Contact whose gap is the film, with the fluid's pressure where that is resolved."""
        return self.patch.film_contact

    def __str__(self) -> str:
        film = self.patch.film
        return str(
            self.headline or f"{100 * film.contact_area_fraction:.4g} % of the area in contact"
        )

    def __repr__(self) -> str:
        return f"<Solved: {self.state}, {self}>"

    def save(self, folder: str | Path, *, overwrite: bool = False) -> Result:
        """Write result.json, arrays and pictures, as `run` does.

        Raises
        ------
        InvalidInput
            If the folder cannot be written, or holds another scene's result and `overwrite` is
            False; nothing is written then.
        MissingPackage
            If a product needs a package that is not installed.
        """
        with _reserved(self.patch.scene, folder, overwrite, self.patch.comm) as target:
            return self.write(target)

    def write(self, folder: ResultFolder) -> Result:
        """Write into a folder that is held; under mpirun all processes call it."""
        files = parallel.on_root(
            lambda: write_products(self.patch, self.seal, folder.staged), self.patch.comm
        )
        result = self.result(files, folder.provenance)
        parallel.on_root(lambda: folder.commit(result), self.patch.comm)
        return result

    def result(self, files: tuple[str, ...] = (), provenance: Provenance | None = None) -> Result:
        """The content of result.json, with the names of the files beside it.

        The provenance is the present one if left out.
        """
        patch, scene, film = self.patch, self.patch.scene, self.patch.film
        leak = patch.leak_rate if scene.needs_leak_rate else None
        stated = scene.output.leak_rate_unit
        gap = film.gap if isinstance(film, GridFilm) else None
        elastic = self.contact if isinstance(self.contact, ContactState) else None
        total = self.seconds + patch.seconds.get("pictures", 0.0)
        return Result(
            state=self.state,
            percolates=not patch.sealed,
            headline=self.headline,
            leak_rate=Rate.of(leak),
            leak_rate_shown=Rate.of(self.leak_rate, ShownUnit.of(scene)) if stated else None,
            gas=GasRecord.of(patch, self.leak_rate),
            verdict=self.verdict,
            error_budget=self.budget or None,
            cautions=self.cautions,
            quantities=self.quantities,
            converged=self.converged,
            reason=self.reason,
            method=leak.method if leak else None,
            unknowns=leak.unknowns if leak else 0,
            preconditioner=_preconditioner(self),
            inflow=leak.inflow if leak else None,
            outflow=leak.outflow if leak else None,
            lift=LiftRecord.of(patch),
            seal=SealRecord.of(self.seal) if self.seal else None,
            contact_area_fraction=film.contact_area_fraction,
            mean_gap=film.mean_gap,
            gap_is_periodic=gap.periodic if gap else None,
            gap_slope=gap.slope_between_samples() if gap else None,
            mean_pressure=patch.carried_load,
            certificate=elastic.certificate if elastic else None,
            pressed_gap=elastic.pressed_gap if elastic else None,
            penetration=elastic.penetration if elastic else None,
            contact_iterations=elastic.iterations if elastic else None,
            levels=leak.levels if leak else (),
            accuracy=self.choice,
            preparation=None if patch.prepared is None else patch.prepared.steps,
            files=files,
            seconds=patch.seconds | {"total": total},
            peak_memory_bytes=parallel.total(peak_memory(), patch.comm) + peak_of_workers(),
            provenance=provenance or Provenance.of(scene, patch.comm),
        )


def solve(
    scene: Scene,
    report: Report = silent,
    *,
    trust: bool = False,
    comm: parallel.Comm = None,
) -> Solved:
    """Compute the answer of a scene: lifted or dry, on a grid or a shape, of a patch or a seal.

    If a limit of the scene ended the flow, the answer has the best bounds so far, and `converged`
    is False.

    Parameters
    ----------
    scene
        The scene, which says all of that.
    report
        Called with stage and detail.
    trust
        Whether gmsh may run a .geo file that is not the package's own, with your rights.
    comm
        Processes that call this together, all of this run if left out; with MPI.COMM_SELF each
        process solves a scene of its own.

    Raises
    ------
    InvalidInput
        If the scene cannot be computed here.
    NotConverged
        If the contact does not reach its tolerance.
    """
    require_packages(scene)
    return answer(chosen_patch(scene, report, trust=trust, comm=comm))


def answer(chosen: Chosen, *, patches: Path | None = None, work: Work | None = None) -> Solved:
    """Compute the products of a patch's scene; what the patch has computed already is used.

    The solved patches of a [seal] are shared among workers by `work` and kept in the folder
    `patches`, from which a later run continues.
    """
    patch, choice, missed = chosen
    start, scene = perf_counter(), patch.scene
    # The dry contact uses all cores, a flow only one: half of the samples are solved meanwhile.
    patch.solve_contact()
    with half_in_worker(patch):
        # All processes solve film and flow together. From here on `parallel.on_root` marks what the
        # first one computes for all.
        patch.solve_film()
        leak: LeakRate | None = None
        budget: ErrorBudget = ()
        seal = None
        if scene.seal is not None:
            seal, budget = _solved_seal(patch, patches, work)
            leak = seal
        elif scene.needs_leak_rate:
            leak, budget = patch.leak_rate, error_budget(patch)
            leak = replace(leak, reason=missed) if missed else leak
    return Solved(
        patch=patch,
        leak_rate=leak,
        budget=budget,
        seal=seal,
        quantities=quantities(patch),
        cautions=cautions(patch, budget, seal),
        choice=choice,
        seconds=perf_counter() - start + patch.seconds.get("accuracy", 0.0),
    )


def _solved_seal(
    patch: Patch, patches: Path | None, work: Work | None
) -> tuple[SealLeak, ErrorBudget]:
    """The flow of a whole seal; where all its patches are sealed, bounded by that under less load.

    The expected time is said before the first patch.
    """
    with patch.timed("seal"):
        expected = predicted(patch.scene, patch.surface, work)
        patch.report(NOTE, str(expected))
        seal = solve_seal(patch, patches, work, each=expected.each_patch)
        if seal.state == "sealed" and patch.scene.limit is not None:
            seconds = max(expected.seconds / 2, LEAST_SECONDS)
            seal = under_less_load(patch, seal, seconds, patches, work, expected.each_patch)

    def rate_of(other: Patch) -> LeakRate:
        """Leak rate of the seal of another patch, wider by what it errs more than this one."""
        return as_uncertain(seal, solve_seal(other, patches, work, each=expected.each_patch))

    return seal, seal_budget(patch, seal, rate_of)


def require_shared(scene: Scene, work: Work | None) -> None:
    """Refuse, before the work, patches of a seal that cannot be read, and `work` without a seal."""
    if scene.seal is not None:
        leak_path_of(scene)
        realizations(scene)
    elif work is not None and ((work.jobs or 1) > 1 or work.memory is not None):
        raise InvalidInput(
            "--jobs and --memory (`work`) distribute the patches of a [seal], and this scene has "
            "none; leave them out, or start the command by mpirun; flow.max_memory limits a flow"
        )


def run(
    scene: Scene,
    out: str | Path,
    *,
    overwrite: bool = False,
    report: Report = silent,
    trust: bool = False,
    comm: parallel.Comm = None,
    work: Work | None = None,
    origin: Origin | None = None,
) -> Result:
    """Solve a scene and save the answer in a folder; scene and folder are checked first.

    Parameters
    ----------
    scene, report, trust, comm
        As of `solve`.
    work
        As of `answer`.
    out
        Result folder: result.json, contact.npz where a contact was solved, the pictures and the
        mesh where they are products.
    overwrite
        Whether another scene's result may be replaced.
    origin
        Command and scene file, to be kept in result.json.

    Raises
    ------
    InvalidInput
        If the scene cannot be computed here, or the folder cannot be written; nothing is written
        then.
    NotConverged
        If the contact does not reach its tolerance; nothing is written then.
    """
    with _reserved(scene, out, overwrite, comm, work, origin) as folder:
        chosen = chosen_patch(scene, report, trust=trust, comm=comm)
        return answer(chosen, patches=folder.path / PATCHES, work=work).write(folder)


@contextmanager
def _reserved(
    scene: Scene,
    out: str | Path,
    overwrite: bool,
    comm: parallel.Comm,
    work: Work | None = None,
    origin: Origin | None = None,
) -> Iterator[ResultFolder]:
    """Check scene and folder before any work, and hold the folder until the result is written."""
    require_scene(scene)
    require_packages(scene, pictures="pictures" in scene.output.products)
    require_shared(scene, work)
    provenance = Provenance.of(scene, comm, origin)
    folder = ResultFolder(out, provenance, overwrite, file_names(scene))
    with ExitStack() as held:

        def hold() -> None:
            held.enter_context(folder)

        parallel.on_root(hold, comm)
        yield folder


def _preconditioner(solved: Solved) -> str | None:
    """PETSc's name of the preconditioner of the flows; None if none was solved."""
    leak, seal, named = solved.leak_rate, solved.seal, solved.quantities
    by_elements = leak is not None and bool(leak.levels)
    tensor = named is not None and named.conductivity_tensor is not None
    if not (by_elements or tensor or (seal is not None and seal.state == "leaking")):
        return None
    from fem_seal.flow.linear import preconditioner

    return preconditioner()
