"""One point of a sweep: its numbers, and the name of the file that keeps them."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path

from fem_seal import __version__
from fem_seal.errors import NotConverged
from fem_seal.parallel import Comm
from fem_seal.points import Task
from fem_seal.progress import Report
from fem_seal.results.result import Result, digest
from fem_seal.scene import Scene
from fem_seal.solved import answer, solve
from fem_seal.sweep.contact_path import ContactPath
from fem_seal.tables import leaves

Number = str | float | int | bool | None

# Columns that every point has, empty where the scene does not give them. SI units.
COLUMNS = (
    *("state", "decision", "leak_rate", "lower", "upper", "together.lower", "together.upper"),
    *("contact_area_fraction", "mean_gap", "mean_pressure", "certificate"),
    *("unknowns", "converged", "reason", "seconds", "peak_memory_bytes"),
)
UNSETTLED = "unsettled"  # state of a point whose contact and flow reach no equilibrium
# Parts of a result that are not numbers of the point, or are in COLUMNS under another name.
_LEFT_OUT = {
    *("schema_version", "leak_rate", "verdict", "levels", "files", "seconds", "provenance"),
    *("preparation", "error_budget", "headline"),
}
# Products that are files.
_FILES = ("mesh", "pictures")


@dataclass(frozen=True)
class Point:
    """A finished point."""

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 (pydantic reads it)

    values: tuple[str, ...]  #: values of the axes, as text
    numbers: dict[str, Number]  #: by column; those of COLUMNS first
    again: bool = False  #: whether the cause of its failure may be gone in the next sweep
    version: str = __version__  #: of fem_seal
    finished: str = field(default_factory=lambda: datetime.now(UTC).isoformat())

    def number(self, column: str) -> float | None:
        """Number in a column; None if it is empty."""
        value = self.numbers[column]
        return value if isinstance(value, int | float) else None

    @property
    def converged(self) -> bool:
        """Whether the point has a result, and no limit cut its computation short."""
        return self.numbers["converged"] is True


def numbers_only(scene: Scene) -> Scene:
    """Leave out the products that are files: pictures and meshes are for single runs."""
    products = [name for name in scene.output.products if name not in _FILES]
    if scene.needs_flow and "leak_rate" not in products:
        products.append("leak_rate")
    output = scene.output.model_copy(update={"products": tuple(products)})
    return scene.model_copy(update={"output": output})


def digest_or_none(path: Path) -> str:
    """Digest of a file; the computation of the point says why one cannot be read."""
    try:
        return digest(path)
    except OSError:
        return "unreadable"


def name_of(scene: Scene, digest_of: Callable[[Path], str] = digest_or_none) -> str:
    """Name of the file of a point: a hash of its scene, its input files and the version."""
    inputs = [digest_of(path) for path in scene.input_files]
    point = {"scene": numbers_only(scene).to_mapping(), "inputs": inputs, "version": __version__}
    return sha256(json.dumps(point, sort_keys=True).encode()).hexdigest()[:32]


@dataclass(frozen=True)
class ScenePoint(Task[Point]):
    """A point of a sweep that is to be computed."""

    values: tuple[str, ...]  #: values of the axes, as text
    scene: Scene
    trust: bool  #: whether gmsh may run its geometry

    def compute(self, handed_on: ContactPath, report: Report, comm: Comm) -> Point:
        """Compute the point; `handed_on` holds surface and contact of the last point."""
        scene = numbers_only(self.scene)
        try:
            if scene.total_error is None:
                solved = answer(handed_on.patch(scene, report, trust=self.trust, comm=comm))
                handed_on.follow(solved.patch)
            else:
                solved = solve(scene, report, trust=self.trust, comm=comm)
            return Point(self.values, dict(_numbers(solved.result())))
        except NotConverged as error:
            return failed(self.values, str(error))


def failed(values: tuple[str, ...], reason: str, *, again: bool = False) -> Point:
    """Row of a point that has no numbers, and which the next sweep may try again."""
    one_line = " ".join(reason.split())
    empty: dict[str, Number] = dict.fromkeys(COLUMNS)
    return Point(values, empty | {"converged": False, "reason": one_line}, again)


def _numbers(result: Result) -> Iterator[tuple[str, Number]]:
    """Columns of a result: those of COLUMNS, then all other numbers and texts that it has.

    The leak rate of the last pass of contact and flow, which have not settled, is none of the
    point: its range stands in together.lower and together.upper.
    """
    # State and decision are those of the seal as well.
    leak = result.leak_rate if result.seal is None else result.seal.leak_rate
    head, unsettled = result.headline, result.lift is not None and not result.lift.settled
    if unsettled:
        leak = None
    own = {
        "state": UNSETTLED if unsettled else result.state,
        "decision": result.verdict.decision if result.verdict else None,
        "leak_rate": leak.value if leak else None,
        "lower": leak.lower if leak else None,
        "upper": leak.upper if leak else None,
        "together.lower": head.lower if head else None,
        "together.upper": head.upper if head else None,
        "seconds": result.seconds["total"],
    }
    for name in COLUMNS:
        yield name, own[name] if name in own else getattr(result, name)
    if head is not None:
        yield "headline", head.sentence
    rest = result.model_dump(exclude=_LEFT_OUT.union(COLUMNS))
    quantities = rest.pop("quantities", None) or {}
    for name, part in leaves(rest | quantities):
        if part is not None and isinstance(part, Number):
            yield name, part
