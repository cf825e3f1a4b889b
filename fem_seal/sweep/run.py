"""A sweep: a scene over the values of some of its fields, and the table of all."""

from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from statistics import fmean
from typing import Any

from fem_seal import parallel
from fem_seal.errors import FemSealError, InvalidInput
from fem_seal.files import locked_folder
from fem_seal.patch import require_trusted
from fem_seal.points import Expected, Work, compute_points
from fem_seal.prediction import predicted
from fem_seal.progress import Report, silent
from fem_seal.quantities.headline import SI, ShownUnit
from fem_seal.results.result import Provenance
from fem_seal.scene import Scene
from fem_seal.scene.files import scene_text
from fem_seal.sweep.axis import Points
from fem_seal.sweep.point import Point, ScenePoint, digest_if_readable, failed, numbers_only
from fem_seal.sweep.store import SweepFolder


@dataclass(frozen=True)
class Tally:
    """Outcome of a sweep."""

    points: int  #: number of different points
    computed: int  #: number of points that this sweep computed
    failed: int  #: number of points without a result, or with one that a limit has cut short
    missing: int  #: number of points that are left to other parts
    table: tuple[Point, ...]  #: all points of the folder, those of this sweep first
    equal: tuple[str, ...] = ()  #: sentences on points that are the same as earlier ones
    shown: ShownUnit = SI  #: unit of the leak rates of all points in texts and pictures


def sweep(
    path: str | Path,
    points: Points,
    out: str | Path,
    *,
    overrides: Sequence[str] = (),
    overwrite: bool = False,
    report: Report = silent,
    trust: bool = False,
    work: Work | None = None,
) -> Tally:
    """Compute the points of a sweep that its folder does not hold yet.

    A point that fails has a row that says why, and the sweep goes on. A point that did not converge
    is kept; one that failed otherwise, as by a damaged file, is tried again next time.

    Parameters
    ----------
    path
        Scene file.
    points
        Fields, and their values at each point, as `combinations` or `read_points` makes them.
    out
        Folder of points/, with a file for each finished point, and of sweep.csv, the table of all
        these points; any number of sweeps may write into it at once.
    overrides
        Values of fields of the scene, for all points.
    overwrite
        Whether another sweep may be replaced.
    trust
        Whether gmsh may run a .geo file that is not the package's own.
    work
        How the points are shared among workers; one after the other if left out. The rows do not
        depend on the number of jobs or parts.

    Raises
    ------
    InvalidInput
        If a point is not a valid scene (all are checked before the first is computed), or the
        folder holds another sweep or cannot be written.
    """
    path, out, work = Path(path), Path(out), work or Work()
    keys, values = points
    if not values:
        raise InvalidInput("a sweep of no points: give a value of each field at least")
    tasks, equal = _tasks(path, points, overrides, trust)
    folder = SweepFolder(out.absolute(), keys)
    asked = {task.name: task.values for task in tasks}
    workers = work.open or (work.jobs is not None and work.jobs > 1)
    each = _expected(tasks) if workers and len(tasks) > 1 else None
    with ExitStack() as held:
        origin = _origin(tasks[0].scene, keys)
        parallel.on_root(lambda: _open(held, folder, origin, overwrite), work.comm)
        try:
            outcome = compute_points(folder, tasks, work, report=report, each=each)
        except KeyboardInterrupt:
            # An interrupted sweep leaves a table as well.
            if parallel.is_root(work.comm):
                folder.gather(asked)
            raise

        def gather() -> tuple[list[Point], list[Point | None]]:
            for task in tasks:
                if error := outcome.failures.get(task.label):
                    folder.save(task.name, failed(task.values, str(error), again=True))
            return folder.gather(asked), [folder.point(name) for name in asked]

        table, computed = parallel.on_root(gather, work.comm)
    own = [point for point in computed if point is not None]
    failures = sum(not point.converged for point in own)
    missing, units = len(tasks) - len(own), {ShownUnit.of(task.scene) for task in tasks}
    shown = units.pop() if len(units) == 1 else SI
    return Tally(len(tasks), outcome.computed, failures, missing, tuple(table), equal, shown)


def _tasks(
    path: Path, points: Points, overrides: Sequence[str], trust: bool
) -> tuple[list[ScenePoint], tuple[str, ...]]:
    """Tasks of different points, and sentences on those that are the same as earlier ones.

    InvalidInput if a point is not a valid scene.
    """
    (keys, rows), text = points, scene_text(path)
    tasks: dict[str, ScenePoint] = {}
    refused: dict[str, InvalidInput] = {}
    equal = []
    digest_of = cache(digest_if_readable)  # for this sweep: the next one may find another file
    for values in rows:
        changes = list(map("{}={}".format, keys, values))
        label = ", ".join(changes)
        try:
            scene = Scene.from_text(text, path, [*overrides, *changes])
        except InvalidInput as error:
            refused[label] = error
            continue
        require_trusted(scene, trust)
        name = numbers_only(scene).fingerprint(digest_of=digest_of)
        task = ScenePoint(name, label, values, scene, trust)
        if (first := tasks.setdefault(name, task)) is not task:
            equal.append(f"{label} is the same scene as {first.label}: one point of both")
    if refused:
        label, first_error = next(iter(refused.items()))
        if not tasks:
            raise first_error
        raise InvalidInput(
            f"{len(refused)} of {len(rows)} points cannot be computed, such as {label}: "
            f"{first_error}; where only some points need a field, take a table of --points, which "
            "may leave its cell empty"
        )
    return list(tasks.values()), tuple(equal)


def _expected(tasks: Sequence[ScenePoint]) -> Expected | None:
    """What a point is expected to take: the mean time, and the largest memory; None if unknown.

    A point that cannot be predicted counts as the others; its own line says what is wrong with it.
    """
    alike: dict[str, list[Expected]] = {}
    points: list[Expected] = []
    for scene in (numbers_only(task.scene) for task in tasks):
        # Seeds do not change the memory, nor loads but in a [seal]: no map is read again for them.
        load = () if scene.seal is not None else ("contact",)
        same = scene.model_dump_json(exclude={"surface": {"seed"}, **dict.fromkeys(load, True)})
        if same not in alike:
            alike[same] = []
            with suppress(FemSealError):
                alike[same].append(predicted(scene).of_point)
        points += alike[same]
    if not points:
        return None
    return Expected(fmean(each.seconds for each in points), max(each.memory for each in points))


def _open(held: ExitStack, folder: SweepFolder, origin: Provenance, overwrite: bool) -> None:
    if overwrite:
        with locked_folder(folder.path):
            folder.clear()
    held.enter_context(locked_folder(folder.path, shared=True))
    folder.open(origin)


def _origin(scene: Scene, keys: tuple[str, ...]) -> Provenance:
    """The part that all points share: the scene without the fields that vary."""
    origin = Provenance.of(scene)
    shared = _without(origin.scene, keys)
    files = {str(path) for name, path in scene.input_files if name not in keys}
    inputs = {path: digest for path, digest in origin.inputs.items() if path in files}
    return origin.model_copy(update={"scene": shared, "inputs": inputs, "seed": None})


def _without(fields: dict[str, Any], keys: tuple[str, ...], head: str = "") -> dict[str, Any]:
    """Nested fields without those of the keys, such as "tolerances.contact.pressure"."""
    kept = {name: value for name, value in fields.items() if f"{head}{name}" not in keys}
    inner = {
        name: _without(value, keys, f"{head}{name}.") if isinstance(value, dict) else value
        for name, value in kept.items()
    }
    return {name: value for name, value in inner.items() if value != {}}
