"""The points of a sweep, chain after chain."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from fem_seal import parallel
from fem_seal.errors import InvalidInput
from fem_seal.files import locked_folder
from fem_seal.progress import Report, silent
from fem_seal.results.result import Provenance
from fem_seal.scene import Scene
from fem_seal.seal import Seal
from fem_seal.sweep.axis import Axis
from fem_seal.sweep.contact_path import ContactPath
from fem_seal.sweep.point import Point, compute, name_of, numbers_only
from fem_seal.sweep.store import SweepFolder


@dataclass(frozen=True)
class Tally:
    """How a sweep has ended.

    points : how many there are; computed : how many of them now
    failed : how many have no result, or one that a limit has cut short
    table : all points of the folder, those of this sweep first
    """

    points: int
    computed: int
    failed: int
    table: tuple[Point, ...]


@dataclass(frozen=True)
class Task:
    """A point to compute: the file it goes into, its values and its scene."""

    name: str
    values: tuple[str, ...]
    scene: Scene


def sweep(
    path: Path,
    axes: Sequence[Axis],
    out: Path,
    *,
    overrides: Sequence[str] = (),
    overwrite: bool = False,
    report: Report = silent,
    trust: bool = False,
) -> Tally:
    """Compute the points of a sweep that its folder does not hold yet.

    Parameters
    ----------
    path : scene file
    axes : fields and their values; all combinations are computed
    out : folder of points/, with a file for each finished point, and of sweep.csv, the table of
        all points that are there; any number of sweeps may write into it at once
    overrides : of the scene, for all points
    overwrite : whether another sweep may be replaced
    report : called with the point and its latest news
    trust : whether gmsh may run a .geo file that is not the package's own

    Returns
    -------
    Tally. A point that fails has a row that says why, and the sweep goes on. A point that did not
    converge is kept; one that failed otherwise, by a damaged file say, is tried again next time.

    Raises
    ------
    InvalidInput
        If any point is no scene, which is found before the first one is computed, or the folder
        holds another sweep or cannot be written.
    """
    keys = tuple(axis.key for axis in axes)
    if not keys or len(set(keys)) < len(keys):
        raise InvalidInput(f"a sweep needs fields to vary, each once; got {', '.join(keys)}")
    tasks = []
    for values in product(*(axis.values for axis in axes)):
        scene = Scene.from_file(path, [*overrides, *map("{}={}".format, keys, values)])
        Seal(scene, trust=trust)  # refuses a geometry that may not be run
        tasks.append(Task(name_of(scene), values, scene))
    folder = SweepFolder(out, keys)
    with ExitStack() as held:
        parallel.on_root(lambda: _open(held, folder, _origin(tasks[0].scene, keys), overwrite))
        computed = _compute_all(tasks, folder, report, trust)
        table = parallel.on_root(lambda: folder.gather([task.name for task in tasks]))
    names = {task.values for task in tasks}
    failed = sum(point.values in names and not point.converged for point in table)
    return Tally(len(tasks), computed, failed, tuple(table))


def _open(held: ExitStack, folder: SweepFolder, origin: Provenance, overwrite: bool) -> None:
    if overwrite:
        with locked_folder(folder.path):
            folder.clear()
    held.enter_context(locked_folder(folder.path, shared=True))
    folder.open(origin)


def _origin(scene: Scene, keys: tuple[str, ...]) -> Provenance:
    """What all points share: the scene without the fields that vary."""
    origin = Provenance.of(scene)
    shared = {
        section: {name: value for name, value in fields.items() if f"{section}.{name}" not in keys}
        for section, fields in origin.scene.items()
    }
    varied = [getattr(scene, key.removesuffix(".path")).path for key in keys if _names_file(key)]
    inputs = {path: digest for path, digest in origin.inputs.items() if Path(path) not in varied}
    return origin.model_copy(update={"scene": shared, "inputs": inputs, "seed": None})


def _names_file(key: str) -> bool:
    return key in ("surface.path", "gap.path", "shape.path")


def chains(tasks: Sequence[Task]) -> list[list[Task]]:
    """Group the points by their surface: each hands surface and contact on to the next."""
    groups: dict[str, list[Task]] = {}
    for task in tasks:
        groups.setdefault(repr((task.scene.surface, task.scene.gap)), []).append(task)
    return list(groups.values())


def _compute_all(tasks: Sequence[Task], folder: SweepFolder, report: Report, trust: bool) -> int:
    """Compute what the folder does not hold; count it."""
    missing = parallel.on_root(lambda: [t for t in tasks if folder.point(t.name) is None])
    computed = 0
    for chain in chains(missing):
        contacts = ContactPath()
        for task in chain:
            # Another sweep into the folder may have computed the point meanwhile.
            if parallel.on_root(lambda t=task: folder.point(t.name)) is not None:
                continue
            computed += 1
            label = ", ".join(map("{}={}".format, folder.keys, task.values))
            head = f"{computed}/{len(missing)} {label}"
            seal = Seal(numbers_only(task.scene), _under(head, report), trust=trust)
            point = compute(seal, task.values, contacts)
            parallel.on_root(lambda t=task, p=point: _keep(folder, t.name, p, tasks))
    return computed


def _keep(folder: SweepFolder, name: str, point: Point, tasks: Sequence[Task]) -> None:
    folder.write(name, point)
    folder.gather([task.name for task in tasks])


def _under(head: str, report: Report) -> Report:
    """Name the point before each stage."""
    return lambda stage, detail: report(f"{head}: {stage}", detail)
