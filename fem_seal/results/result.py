"""Result: the content of result.json."""

from collections.abc import Iterator
from copy import deepcopy
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from platform import python_version
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationError, field_validator, model_validator

from fem_seal import parallel
from fem_seal.accuracy import Choice
from fem_seal.error_budget import Uncertainty
from fem_seal.errors import FemSealError, InvalidInput
from fem_seal.files import digest
from fem_seal.leak_rate import FlowState, LeakRate, LevelRecord
from fem_seal.quantities.headline import Headline, ShownUnit, headline
from fem_seal.quantities.of_patch import Quantities
from fem_seal.quantities.verdict import Verdict
from fem_seal.results.records import GasRecord, LiftRecord, Rate, Record, SealRecord
from fem_seal.scene import Flow, Scene
from fem_seal.scene.contact import ITERATION
from fem_seal.scene.fluid import ambient_is_open
from fem_seal.scene.messages import explain
from fem_seal.scene.seal import PROFILES
from fem_seal.surface import MapStatistics

RESULT_FILE = "result.json"
LARGEST = 1e200  # largest number of a result; in any unit of a text it is finite
_PACKAGES = (
    "fem_seal", "fenics-dolfinx", "dolfinx-solver-real", "petsc4py", "numpy", "scipy", "pyfftw",
    "pyvista", "h5py", "SurfaceTopography",
)  # fmt: skip


def _bare_name(name: str) -> str:
    """Validate the name of a file beside result.json.

    When a result is replaced, its files are removed. A result file from elsewhere must therefore
    not name files of other folders.
    """
    if name in ("", "..") or name != Path(name).name or "\0" in name:
        raise ValueError("must be the name of a file in the folder")
    return name


FileName = Annotated[str, AfterValidator(_bare_name)]


class Origin(Record):
    """Command and scene file of a result, as the user wrote them."""

    command: tuple[str, ...] | None = None  #: without the name of the program
    scene_text: str | None = None  #: text of the scene file


class Provenance(Origin):
    """Origin of a result: the same scene with the same inputs reproduces it."""

    scene: dict[str, Any]
    seed: int | None
    inputs: dict[str, str]
    versions: dict[str, str]
    processes: int
    date: str

    @classmethod
    def of(
        cls, scene: Scene, comm: parallel.Comm = None, origin: Origin | None = None
    ) -> "Provenance":
        """Provenance with the present versions, input files and number of processes."""
        return cls(
            scene=scene.to_mapping(),
            seed=scene.seed,
            inputs={str(path): digest(path) for _, path in scene.input_files},
            versions={"python": python_version()} | dict(_versions()),
            processes=parallel.processes(comm),
            date=datetime.now(UTC).isoformat(timespec="seconds"),
            **dict(origin or Origin()),
        )

    def has_section(self, name: str) -> bool:
        """Whether the scene has a section, such as "shape"."""
        return bool(self.scene.get(name))

    def same_scene(self, other: "Provenance") -> bool:
        """Whether both describe the same physical case; the section [output] may differ."""
        mine = {key: value for key, value in self.scene.items() if key != "output"}
        others = {key: value for key, value in other.scene.items() if key != "output"}
        return mine == others and self.inputs == other.inputs


class Result(Record):
    """The numbers of one run; docs/reference/results.md explains each."""

    schema_version: Literal[2] = Field(2, alias="schema")
    state: FlowState
    percolates: bool
    headline: Headline | None = Field(None, alias="together")
    leak_rate: Rate | None = None
    leak_rate_shown: Rate | None = None
    gas: GasRecord | None = None
    verdict: Verdict | None = None
    error_budget: tuple[Uncertainty, ...] | None = None
    cautions: tuple[str, ...] = ()
    quantities: Quantities | None = None
    converged: bool
    reason: str
    method: str | None = None
    unknowns: int = 0
    preconditioner: str | None = None
    inflow: float | None = None
    outflow: float | None = None
    lift: LiftRecord | None = None
    seal: SealRecord | None = None
    contact_area_fraction: float
    mean_gap: float
    gap_is_periodic: bool | None = None
    gap_slope: float | None = None
    mean_pressure: float | None = None
    certificate: float | None = None
    pressed_gap: float | None = None
    penetration: float | None = None
    contact_iterations: int | None = None
    levels: tuple[LevelRecord, ...] = ()
    accuracy: Choice | None = None
    preparation: tuple[MapStatistics, ...] | None = None
    files: tuple[FileName, ...]
    seconds: dict[str, float]
    peak_memory_bytes: int
    provenance: Provenance

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: Any) -> Any:
        if not (isinstance(data, dict) and data.get("schema") == 1):
            return data
        try:
            return _of_schema_1(data)
        except (LookupError, AttributeError, TypeError) as error:
            raise ValueError(f"a damaged result of the first schema: {error!r}") from None

    @field_validator("seconds")
    @classmethod
    def _with_total(cls, seconds: dict[str, float]) -> dict[str, float]:
        if "total" not in seconds:
            raise ValueError("must hold the 'total'")
        return seconds

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
        except FemSealError as error:  # of a part that contradicts itself
            contradiction = str(error).partition("; ")[0]  # and not that a solver is to blame
            raise InvalidInput(f"{path} is not a result: {contradiction}") from None
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            where = ".".join(str(part) for part in first["loc"]) or "the file"
            raise InvalidInput(
                f"{path} is not a result of this version: {where}: {first['msg']}"
            ) from None
        # JSON has no infinity, but 1e999 is read as one; others would become one in another unit.
        if any(not abs(number) < LARGEST for number in _floats(result.model_dump(mode="json"))):
            raise InvalidInput(f"{path} is not a result: it holds numbers beyond double precision")
        return result

    @property
    def shown(self) -> ShownUnit:
        """Unit of `leak_rate_shown`; m³/s where nothing leaks, or the scene names none."""
        leak = self.leak_rate if self.seal is None else self.seal.leak_rate
        if self.leak_rate_shown is None or not (leak and leak.value):
            return ShownUnit()
        return ShownUnit(self.leak_rate_shown.unit, self.leak_rate_shown.value / leak.value)

    def flow(self) -> Flow:
        """Section [flow] of the scene that gave this result."""
        try:
            return Flow.model_validate(self.provenance.scene.get("flow", {}))
        except ValidationError as error:
            reasons = "; ".join(explain(error, Flow))
            raise InvalidInput(f"scene of the result: {reasons}") from None

    def scene(self) -> Scene:
        """Rebuild the scene that gave this result."""
        scene = _of_present_version(self.provenance.scene)
        return Scene.from_mapping(scene, source="scene of the result")


def _floats(part: Any) -> Iterator[float]:
    """Numbers that are no whole ones, of nested dicts and lists."""
    if isinstance(part, float):
        yield part
    elif isinstance(part, dict | list):
        for one in part.values() if isinstance(part, dict) else part:
            yield from _floats(one)


def _of_present_version(scene: dict[str, Any]) -> dict[str, Any]:
    """The scene of an earlier version, which took less and ignored more.

    The ambient pressure could be left out: it was the outlet's. Without an elastic contact it was
    ignored, and so were the settings of the contact's iteration; beside [seal], flow.rtol, and
    contact.pressure beside a table. All are refused now.
    """
    contact, flow = scene.get("contact") or {}, scene.get("flow", {})
    if seal := scene.get("seal"):
        flow = {name: flow[name] for name in flow if name != "rtol"}
        if seal.get("pressure_profile", "uniform") not in PROFILES:
            contact = {name: contact[name] for name in contact if name != "pressure"}
        scene = {**scene, "flow": flow, "contact": contact}
    if contact.get("model") == "gfmd":
        outlet = flow.get("outlet_pressure")
        if ambient_is_open(outlet, flow.get("ambient_pressure")):
            return {**scene, "flow": {**flow, "ambient_pressure": outlet}}
        return scene
    new = {**scene, "flow": {**flow, "ambient_pressure": None}}
    if contact:
        new["contact"] = {name: contact[name] for name in contact if name not in ITERATION}
    return new


def _of_schema_1(data: dict[str, Any]) -> dict[str, Any]:
    """The content of a result.json of the first schema in the present one."""
    data = deepcopy(data)
    for entry in data.get("error_budget") or ():
        entry.setdefault("key", entry["name"].replace(" ", "_"))
    data["certificate"] = data.pop("kkt_residual", None)
    judged = data.get("verdict")
    if judged is not None:
        judged["comparison"] = judged.pop("headline", "").partition(": ")[2]
    result = Result.model_validate(data | {"schema": 2})
    leak = result.leak_rate if result.seal is None else result.seal.leak_rate
    if leak is None:
        return data | {"schema": 2}
    rate = LeakRate(
        leak.value, leak.lower, leak.upper, state=result.state, method=result.method or ""
    )
    return data | {"schema": 2, "together": headline(rate, result.error_budget or (), result.shown)}


def _versions() -> Iterator[tuple[str, str]]:
    for package in _PACKAGES:
        try:
            yield package, version(package)
        except PackageNotFoundError:
            continue  # the contact half works without FEniCSx and PyVista
