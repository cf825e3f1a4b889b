"""One point of a sweep: its numbers, and the name of the file that keeps them."""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from math import inf
from pathlib import Path

from pydantic import ConfigDict

from fem_seal import __version__
from fem_seal.errors import InvalidInput, NotConverged
from fem_seal.files import digest
from fem_seal.parallel import Comm
from fem_seal.points import Task
from fem_seal.progress import Report
from fem_seal.results.result import LARGEST, Result
from fem_seal.scene import Scene
from fem_seal.scene.sections import PRODUCTS
from fem_seal.solved import solve
from fem_seal.tables import leaves

TableEntry = str | float | int | bool | None

# Columns that every row has, empty where the scene does not give them.
COLUMNS = (
    "state", "decision", "leak_rate", "lower", "upper", "together.lower", "together.upper",
    "contact_area_fraction", "mean_gap", "mean_pressure", "certificate",
    "unknowns", "converged", "reason", "seconds", "peak_memory_bytes",
)  # fmt: skip
UNSETTLED = "unsettled"  # state of a point whose contact and flow reach no equilibrium
# Parts of a result that are not numbers of the point, or are fields of it under their names.
_LEFT_OUT = {
    "schema_version", "leak_rate", "verdict", "levels", "files", "seconds", "provenance",
    "preparation", "error_budget", "headline",
    "state", "converged", "reason", "contact_area_fraction",
}  # fmt: skip


@dataclass(frozen=True)
class Point:
    """A finished point, in SI units; None where its scene does not give the number."""

    # The file of a point keeps infinite numbers as Infinity: null, the default, means "not known".
    __pydantic_config__ = ConfigDict(extra="forbid", ser_json_inf_nan="constants")

    values: tuple[str, ...]  #: values of the axes, as text
    converged: bool  #: whether it has a result, and no limit cut its computation short
    reason: str  #: why it has not converged, else empty
    state: str | None = None  #: None if it has no result
    decision: str | None = None
    leak_rate: float | None = None
    lower: float | None = None  #: lower and upper bound of the flow
    upper: float | None = None
    together_lower: float | None = None  #: with all counted errors
    together_upper: float | None = None
    contact_area_fraction: float | None = None
    headline: str | None = None
    #: all other numbers and texts of result.json, by names such as gas.mass_rate.value; the time is
    #: the total
    further: dict[str, TableEntry] = field(default_factory=dict)
    again: bool = False  #: whether the cause of its failure may be gone in the next sweep
    version: str = __version__  #: of fem_seal
    finished: str = field(default_factory=lambda: datetime.now(UTC).isoformat())

    def __post_init__(self) -> None:
        """A file from elsewhere may lack what each line shows, or hold what no picture can."""
        rates = self.leak_rate, self.lower, self.upper, self.together_lower, self.together_upper
        known = (abs(rate) for rate in rates if rate is not None)
        lacks_area = self.state is not None and self.contact_area_fraction is None
        if lacks_area or any(LARGEST < rate < inf for rate in known):
            raise InvalidInput(
                f"a point lacks its contact area, or leaks more than {LARGEST:g} m^3/s"
            )

    @classmethod
    def of(cls, values: tuple[str, ...], result: Result) -> "Point":
        """Point of a result.

        Where contact and flow have not settled the point has no leak rate: its range stands in
        together_lower and together_upper.
        """
        # That of the seal where the scene has one, as are the state and decision of the result.
        leak = result.leak_rate if result.seal is None else result.seal.leak_rate
        head, unsettled = result.headline, result.lift is not None and not result.lift.settled
        if unsettled:
            leak = None
        rest = result.model_dump(exclude=_LEFT_OUT)
        quantities = rest.pop("quantities", None) or {}
        rest["seconds"] = result.seconds["total"]
        return cls(
            values,
            result.converged,
            result.reason,
            state=UNSETTLED if unsettled else result.state,
            decision=result.verdict.decision if result.verdict else None,
            leak_rate=leak.value if leak else None,
            lower=leak.lower if leak else None,
            upper=leak.upper if leak else None,
            together_lower=head.lower if head else None,
            together_upper=head.upper if head else None,
            contact_area_fraction=result.contact_area_fraction,
            headline=head.sentence if head else None,
            further={
                name: part
                for name, part in leaves(rest | quantities)
                if part is not None and isinstance(part, TableEntry)
            },
        )

    @property
    def row(self) -> dict[str, TableEntry]:
        """Cells by column: those of COLUMNS, then those that this scene gives beside them."""
        cells = {column: getattr(self, column.replace(".", "_"), None) for column in COLUMNS}
        words = {} if self.headline is None else {"headline": self.headline}
        return cells | words | self.further


def numbers_only(scene: Scene) -> Scene:
    """Leave out the products that are files: pictures and meshes are for single runs."""
    products = [name for name in scene.output.products if not PRODUCTS[name].folder]
    if scene.needs_leak_rate and "leak_rate" not in products:
        products.append("leak_rate")
    output = scene.output.model_copy(update={"products": tuple(products)})
    return scene.model_copy(update={"output": output})


def digest_if_readable(path: Path) -> str:
    """Digest of a file; the computation of the point says why one cannot be read."""
    try:
        return digest(path)
    except OSError:
        return "unreadable"


@dataclass(frozen=True)
class ScenePoint(Task[Point]):
    """A point of a sweep that is to be computed."""

    values: tuple[str, ...]  #: values of the axes, as text
    scene: Scene
    trust: bool  #: whether gmsh may run its geometry

    def compute(self, report: Report, comm: Comm) -> Point:
        """Compute the point as `fem-seal run` does its scene."""
        scene = numbers_only(self.scene)
        try:
            return Point.of(self.values, solve(scene, report, trust=self.trust, comm=comm).result())
        except NotConverged as error:
            return failed(self.values, str(error))


def failed(values: tuple[str, ...], reason: str, *, again: bool = False) -> Point:
    """Row of a point that has no numbers, and which the next sweep may try again."""
    return Point(values, False, " ".join(reason.split()), again=again)
