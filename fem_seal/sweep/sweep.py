"""The points of a sweep: chain after chain, in one process or many."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from fem_seal import parallel
from fem_seal.errors import InvalidInput
from fem_seal.files import locked_folder
from fem_seal.patch import require_trusted
from fem_seal.progress import Report, silent
from fem_seal.results.result import Provenance
from fem_seal.scene import Scene
from fem_seal.sweep.axis import Axis, combinations
from fem_seal.sweep.contact_path import ContactPath
from fem_seal.sweep.farm import WorkerKilledError, farm, watch
from fem_seal.sweep.point import Point, compute, failed, name_of, numbers_only
from fem_seal.sweep.store import SweepFolder


@dataclass(frozen=True)
class Tally:
    """How a sweep has ended.

    points : how many there are; computed : how many of them now
    failed : how many have no result, or one that a limit has cut short
    missing : how many are neither computed nor failed, but another part's
    table : all points of the folder, those of this sweep first
    """

    points: int
    computed: int
    failed: int
    missing: int
    table: tuple[Point, ...]


@dataclass(frozen=True)
class Task:
    """A point to compute: the file it goes into, its values and its scene."""

    name: str
    values: tuple[str, ...]
    scene: Scene


@dataclass(frozen=True)
class Chain:
    """Points of one surface, one after the other, and where they go; a worker gets it whole."""

    folder: Path
    keys: tuple[str, ...]
    tasks: tuple[Task, ...]
    trust: bool


@dataclass(frozen=True)
class Work:
    """How the points are shared out.

    jobs : processes of this machine
    part : (k, n) computes every n-th chain from the k-th on, k from 1; parts may run anywhere
    executor : computes the chains in place of processes of this machine, such as
        `client.get_executor()` of Dask; its workers see the same files under the same names
    gather : compute nothing, and write the table of what is there
    """

    jobs: int = 1
    part: tuple[int, int] = (1, 1)
    executor: Executor | None = None
    gather: bool = False

    def __post_init__(self) -> None:
        k, n = self.part
        if self.jobs < 1:
            raise InvalidInput(f"--jobs = {self.jobs} must be at least 1")
        if not 1 <= k <= n:
            raise InvalidInput(f"--part = {k}/{n} must be K/N with 1 <= K <= N")
        if (self.jobs > 1 or self.executor) and parallel.processes() > 1:
            raise InvalidInput(
                "a sweep in many processes solves each point in one; start it without mpirun"
            )


def sweep(
    path: Path,
    axes: Sequence[Axis] | tuple[tuple[str, ...], list[tuple[str, ...]]],
    out: Path,
    *,
    overrides: Sequence[str] = (),
    overwrite: bool = False,
    report: Report = silent,
    trust: bool = False,
    work: Work | None = None,
) -> Tally:
    """Compute the points of a sweep that its folder does not hold yet.

    Parameters
    ----------
    path : scene file
    axes : fields and their values, of which all combinations are computed; or the keys and the
        values of each point
    out : folder of points/, with a file for each finished point, and of sweep.csv, the table of
        all points that are there; any number of sweeps may write into it at once
    overrides : of the scene, for all points
    overwrite : whether another sweep may be replaced
    report : called with the point and its latest news
    trust : whether gmsh may run a .geo file that is not the package's own
    work : how the points are shared out; one after the other if left out. The rows are the same
        whatever the number of jobs or parts

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
    work = work or Work()
    keys, points = axes if isinstance(axes, tuple) else combinations(list(axes))
    tasks = []
    for values in points:
        scene = Scene.from_file(path, [*overrides, *map("{}={}".format, keys, values)])
        require_trusted(scene, trust)
        tasks.append(Task(name_of(scene), values, scene))
    folder = SweepFolder(out.absolute(), keys)
    order = [task.name for task in tasks]
    with ExitStack() as held:
        parallel.on_root(lambda: _open(held, folder, _origin(tasks[0].scene, keys), overwrite))
        chains = [] if work.gather else _chains(tasks, folder, trust, work.part)
        computed = _compute_all(chains, folder, order, report, work)
        table = parallel.on_root(lambda: folder.gather(order))
    there = {point.values: point for point in table}
    asked = [there[task.values] for task in tasks if task.values in there]
    failures = sum(not point.converged for point in asked)
    return Tally(len(tasks), computed, failures, len(tasks) - len(asked), tuple(table))


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


def _chains(
    tasks: Sequence[Task], folder: SweepFolder, trust: bool, part: tuple[int, int]
) -> list[Chain]:
    """Group the points of a part by their surface: each hands surface and contact on."""
    groups: dict[str, list[Task]] = {}
    for task in tasks:
        groups.setdefault(repr((task.scene.surface, task.scene.gap)), []).append(task)
    k, n = part
    mine = list(groups.values())[k - 1 :: n]
    return [Chain(folder.path, folder.keys, tuple(group), trust) for group in mine]


def compute_chain(
    chain: Chain,
    report: Report = silent,
    keep: Callable[[str, Point], None] | None = None,
) -> int:
    """Compute the points of a chain that its folder does not hold; count them.

    Parameters
    ----------
    chain : the points
    report : called with the point and its latest news
    keep : writes a point, by the name of its file; into the folder if left out
    """
    folder = SweepFolder(chain.folder, chain.keys)
    contacts = ContactPath()
    computed = 0
    for task in chain.tasks:
        # Another sweep into the folder may have computed the point meanwhile.
        if parallel.on_root(lambda t=task: folder.point(t.name)) is not None:
            continue
        label = ", ".join(map("{}={}".format, chain.keys, task.values))
        scene = numbers_only(task.scene)
        point = compute(scene, task.values, contacts, _under(label, report), trust=chain.trust)
        parallel.on_root(lambda t=task, p=point: (keep or folder.write)(t.name, p))
        computed += 1
    return computed


def _compute_all(
    chains: list[Chain], folder: SweepFolder, order: list[str], report: Report, work: Work
) -> int:
    """Compute what the folder does not hold; count it."""
    tasks = [task for chain in chains for task in chain.tasks]
    missing = parallel.on_root(
        lambda: [task.name for task in tasks if folder.point(task.name) is None]
    )
    if not missing:
        return 0
    if work.jobs == 1 and work.executor is None:

        def keep(name: str, point: Point) -> None:
            folder.write(name, point)
            folder.gather(order)

        computed = 0
        for chain in chains:
            head = f"{len(missing)} points"
            computed += compute_chain(chain, _under(head, report), keep)
        return computed

    def look() -> int | None:
        folder.gather(order)
        done = [point for name in missing if (point := folder.point(name)) is not None]
        report(f"{len(done)}/{len(missing)} points", "")
        sizes = [size for point in done if (size := point.numbers["peak_memory_bytes"])]
        return max(sizes, default=None)

    if work.executor is not None:
        watch(chains, compute_chain, work.executor, look)
    else:
        _farm_all(chains, folder, look, work.jobs)
    return sum(folder.point(name) is not None for name in missing)


def _farm_all(
    chains: list[Chain], folder: SweepFolder, look: Callable[[], int | None], jobs: int
) -> None:
    """Farm chains out; a point whose process is killed twice, the second time alone, has failed."""
    alone = False
    while chains:
        batch = chains[:1] if alone else chains
        try:
            farm(batch, compute_chain, 1 if alone else jobs, look)
        except WorkerKilledError:
            if alone:
                _blame_first_missing(batch[0], folder)
            alone = True
        else:
            chains, alone = chains[len(batch) :], False
        chains = [chain for chain in chains if not _done(chain, folder)]


def _done(chain: Chain, folder: SweepFolder) -> bool:
    return all(folder.there(task.name) for task in chain.tasks)


def _blame_first_missing(chain: Chain, folder: SweepFolder) -> None:
    for task in chain.tasks:
        if not folder.there(task.name):
            reason = "the process that computed it was killed; most likely it ran out of memory"
            folder.write(task.name, failed(task.values, reason))
            return


def _under(head: str, report: Report) -> Report:
    """Name the point before each stage."""
    return lambda stage, detail: report(f"{head}: {stage}", detail)
