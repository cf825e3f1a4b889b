"""Result: the content of result.json."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from math import isfinite
from pathlib import Path
from platform import python_version
from time import perf_counter
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationError

from fem_seal import parallel
from fem_seal.accuracy import Choice, Trial
from fem_seal.contact.state import ContactState
from fem_seal.errors import InvalidInput
from fem_seal.files import digest
from fem_seal.film import GridFilm
from fem_seal.leak_rate import FlowState, LeakRate, Level
from fem_seal.memory import peak_memory
from fem_seal.patch import Patch
from fem_seal.quantities.error_budget import Uncertainty
from fem_seal.quantities.of_patch import Quantities, quantities, verdict_of
from fem_seal.quantities.remarks import cautions
from fem_seal.quantities.seal import leak_rate_of, seal_budget, seal_verdict
from fem_seal.quantities.slope import slope_between_samples
from fem_seal.quantities.tensor import ConductivityTensor
from fem_seal.quantities.uncertainties import error_budget
from fem_seal.quantities.verdict import Verdict
from fem_seal.results.lift import LiftRecord
from fem_seal.results.preparation import StepRecord
from fem_seal.results.rates import GasRecord, RateBounds, RateRecord
from fem_seal.results.record import Record
from fem_seal.results.seal import SealRecord
from fem_seal.scene import Flow, Scene
from fem_seal.scene.fluid import with_ambient_pressure
from fem_seal.scene.messages import explain
from fem_seal.tables import html_table
from fem_seal.upscaling.seal import SealLeak, solve_seal

RESULT_FILE = "result.json"
_PACKAGES = (
    *("fem_seal", "fenics-dolfinx", "dolfinx-solver-real", "petsc4py", "numpy", "scipy", "pyfftw"),
    *("pyvista", "h5py", "SurfaceTopography"),
)


def _beside(name: str) -> str:
    """Validate the name of a file beside result.json.

    When a result is replaced, its files are removed. A result file from elsewhere must therefore
    not name files of other folders.
    """
    if name in ("", "..") or name != Path(name).name or "\0" in name:
        raise ValueError("should be the name of a file in the folder")
    return name


FileName = Annotated[str, AfterValidator(_beside)]


class AccuracyRecord(Record):
    """Contact grid and tolerance that were chosen for accuracy.total.

    An error that is not known is null, and so is the contact error of a sealed grid.
    """

    total: float
    samples: tuple[int, int]
    rtol: float
    contact_error: float | None
    flow_error: float | None
    trials: tuple[Trial, ...]
    lift_error: float | None = None

    @classmethod
    def of(cls, choice: Choice) -> "AccuracyRecord":
        """Parts of the error, and the grids tried."""
        return cls(
            total=choice.total,
            samples=choice.surface.shape,
            rtol=choice.rtol,
            contact_error=_finite(choice.contact_error),
            flow_error=_finite(choice.flow_error),
            trials=choice.trials,
            lift_error=choice.lift_error,
        )


def _finite(error: float | None) -> float | None:
    return error if error is not None and isfinite(error) else None


@dataclass(frozen=True)
class Origin:
    """Command and scene file of a result, as the user wrote them.

    Parameters
    ----------
    command : tuple of str
        Command line, without the name of the program.
    scene_text : str, optional
        Text of the scene file; None without one.
    """

    command: tuple[str, ...]
    scene_text: str | None = None


class Provenance(Record):
    """Origin of a result: the same scene with the same inputs reproduces it."""

    scene: dict[str, Any]
    seed: int | None
    inputs: dict[str, str]
    versions: dict[str, str]
    processes: int
    date: str
    command: tuple[str, ...] | None = None
    scene_text: str | None = None

    @classmethod
    def of(
        cls, scene: Scene, comm: parallel.Comm = None, origin: Origin | None = None
    ) -> "Provenance":
        """Provenance with the present versions, input files and number of processes."""
        return cls(
            scene=scene.to_mapping(),
            seed=getattr(scene.surface, "seed", None),
            inputs={str(path): digest(path) for path in scene.input_files},
            versions={"python": python_version()} | dict(_versions()),
            processes=parallel.processes(comm),
            date=datetime.now(UTC).isoformat(timespec="seconds"),
            command=None if origin is None else origin.command,
            scene_text=None if origin is None else origin.scene_text,
        )

    def same_scene(self, other: "Provenance") -> bool:
        """Whether both describe the same physical case; the section [output] may differ."""
        mine = {key: value for key, value in self.scene.items() if key != "output"}
        others = {key: value for key, value in other.scene.items() if key != "output"}
        return mine == others and self.inputs == other.inputs


class Result(Record):
    """The numbers of one run; docs/reference/results.md explains each."""

    schema_version: Literal[1] = Field(1, alias="schema")
    state: FlowState
    percolates: bool
    leak_rate: RateBounds | None
    leak_rate_shown: RateRecord | None = None
    gas: GasRecord | None = None
    verdict: Verdict | None = None
    error_budget: tuple[Uncertainty, ...] | None = None
    cautions: tuple[str, ...] = ()
    quantities: Quantities | None = None
    converged: bool
    reason: str
    method: str | None
    unknowns: int
    preconditioner: str | None = None
    inflow: float | None
    outflow: float | None
    lift: LiftRecord | None = None
    seal: SealRecord | None = None
    contact_area_fraction: float
    mean_gap: float
    gap_is_periodic: bool | None = None
    gap_slope: float | None = None
    mean_pressure: float | None
    kkt_residual: float | None
    pressed_gap: float | None = None
    penetration: float | None = None
    contact_iterations: int | None
    levels: tuple[Level, ...]
    accuracy: AccuracyRecord | None = None
    preparation: tuple[StepRecord, ...] | None = None
    files: tuple[FileName, ...]
    seconds: dict[str, float]
    peak_memory_bytes: int
    provenance: Provenance

    def _repr_html_(self) -> str:
        from fem_seal.results.words import summary_of

        return html_table(summary_of(self))

    def to_json(self) -> str:
        """Text of result.json, with all digits of floats, so that reading returns them exactly."""
        return self.model_dump_json(by_alias=True, indent=2) + "\n"

    @classmethod
    def from_folder(cls, folder: str | Path) -> "Result":
        """Read a result folder; InvalidInput if it holds no whole result of this version."""
        path = Path(folder) / RESULT_FILE
        try:
            result = cls.model_validate_json(path.read_bytes())
        except OSError as error:
            raise InvalidInput(f"cannot read the result {path}: {error.strerror}") from None
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            where = ".".join(str(part) for part in first["loc"]) or "the file"
            raise InvalidInput(
                f"{path} is not a result of this version: {where}: {first['msg']}"
            ) from None
        # JSON has no infinity, but 1e999 is read as one.
        if not all(map(isfinite, _numbers(result.model_dump()))):
            raise InvalidInput(f"{path} is not a result: it holds numbers beyond double precision")
        return result

    def flow(self) -> Flow:
        """Section [flow] of the scene that gave this result."""
        try:
            return Flow.model_validate(self.provenance.scene.get("flow", {}))
        except ValidationError as error:
            reasons = "; ".join(explain(error, Flow))
            raise InvalidInput(f"scene of the result: {reasons}") from None

    def scene(self) -> Scene:
        """Rebuild the scene that gave this result."""
        scene = with_ambient_pressure(self.provenance.scene)
        return Scene.from_mapping(scene, source="scene of the result")


def _numbers(value: object) -> Iterator[float]:
    """All floats inside nested dicts, lists and tuples."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        for inner in value:
            yield from _numbers(inner)
    elif isinstance(value, float):
        yield value


def summarise(
    patch: Patch,
    files: tuple[str, ...] = (),
    started: float | None = None,
    *,
    choice: Choice | None = None,
    seal: SealLeak | None = None,
    origin: Origin | None = None,
) -> Result:
    """Collect the numbers of the scene's products.

    Parameters
    ----------
    patch : Patch
        Patch whose steps are read; nothing beyond the products is computed.
    files : tuple of str
        Names of the files beside result.json.
    started : float or None
        perf_counter() at the start of the run, for its total time; None: the sum of the stages.
    choice : Choice or None
        Chosen contact grid, for a scene with [accuracy].
    seal : SealLeak or None
        Leak rate of the whole seal, for a scene with [seal]; solved here if left out.
    origin : Origin or None
        Command and scene file as the user wrote them.
    """
    leak = patch.leak_rate if patch.scene.needs_flow else None
    sealed = patch.sealed
    named = quantities(patch)
    budget = error_budget(patch)
    ends: tuple[LeakRate, ...] = patch.lift_range if patch.scene.lift == "range" else ()
    decision, shown = verdict_of(patch, budget), RateRecord.shown(patch)
    state: FlowState = "lifted off" if patch.lifted_off else "sealed" if sealed else "leaking"
    if patch.scene.seal is not None:
        if seal is None:
            with patch.timed("seal"):
                seal = solve_seal(patch)
        budget, state = seal_budget(patch, seal), seal.state
        decision, ends = seal_verdict(patch, seal, budget), (leak_rate_of(patch, seal),)
        shown = RateRecord.in_unit(patch, ends[0])
    film, contact = patch.film, patch.film_contact
    grid = film if isinstance(film, GridFilm) else None
    elastic = contact if isinstance(contact, ContactState) else None
    tensor = None if named is None else named.conductivity_tensor
    flows = [flow for flow in (leak, tensor, *ends) if flow is not None]
    reasons = [flow.reason for flow in flows if flow.reason]
    asked = patch.scene.deciding_rate is not None
    if asked and decision is not None and decision.decision == "undecided" and not reasons:
        reasons.append("limit.decide asks for a decision, and the verdict is undecided")
    stages = dict(patch.seconds)
    total = sum(stages.values()) if started is None else perf_counter() - started
    return Result(
        state=state,
        lift=LiftRecord.of(patch),
        seal=None if seal is None else SealRecord.of(seal),
        percolates=not sealed,
        leak_rate=None if leak is None else RateBounds.of(leak),
        method=None if leak is None else leak.method,
        unknowns=0 if leak is None else leak.unknowns,
        preconditioner=_preconditioner(leak, tensor, seal),
        inflow=None if leak is None else leak.inflow,
        outflow=None if leak is None else leak.outflow,
        levels=() if leak is None else leak.levels,
        converged=not reasons and all(flow.converged for flow in flows),
        reason="; ".join(dict.fromkeys(reasons)),
        contact_area_fraction=film.contact_area_fraction,
        mean_gap=film.mean_gap,
        gap_is_periodic=None if grid is None else grid.gap.periodic,
        gap_slope=None if grid is None else slope_between_samples(grid.gap),
        mean_pressure=None if elastic is None else patch.mean_pressure,
        kkt_residual=None if elastic is None else elastic.kkt_residual,
        pressed_gap=None if elastic is None else elastic.pressed_gap,
        penetration=None if elastic is None else elastic.penetration,
        contact_iterations=None if elastic is None else elastic.iterations,
        accuracy=None if choice is None else AccuracyRecord.of(choice),
        preparation=StepRecord.all_of(patch),
        gas=GasRecord.of(patch, leak if seal is None else ends[0]),
        leak_rate_shown=shown,
        verdict=decision,
        error_budget=budget,
        cautions=cautions(patch, budget, seal),
        quantities=named,
        files=files,
        seconds=stages | {"total": total},
        peak_memory_bytes=parallel.total(peak_memory(), patch.comm),
        provenance=Provenance.of(
            patch.scene if choice is None else choice.asked(patch.scene), patch.comm, origin
        ),
    )


def _preconditioner(
    leak: LeakRate | None, tensor: ConductivityTensor | None, seal: SealLeak | None
) -> str | None:
    """PETSc's name of the preconditioner of the flows; None if none was solved."""
    by_elements = leak is not None and bool(leak.levels)
    if not (by_elements or tensor or (seal is not None and seal.state == "leaking")):
        return None
    from fem_seal.flow.linear import preconditioner

    return preconditioner()


def _versions() -> Iterator[tuple[str, str]]:
    for package in _PACKAGES:
        try:
            yield package, version(package)
        except PackageNotFoundError:
            continue  # the contact half works without FEniCSx and PyVista
