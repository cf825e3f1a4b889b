"""Compute the points that are missing, in this process or in many."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, wait
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeAlias

from fem_seal import parallel
from fem_seal.digits import number_of
from fem_seal.errors import FemSealError, MissingPackage, NotConverged, explained, present
from fem_seal.files import temporary_folder
from fem_seal.points.farm import POLL, farm
from fem_seal.points.folder import PointFolder, T
from fem_seal.points.task import Chain, Task, nothing
from fem_seal.points.work import UNKNOWN_POINT, Expected, Work
from fem_seal.progress import Pace, Report, silent

Failures: TypeAlias = dict[str, FemSealError]
KILLED = "the process that computed it was killed; most likely it ran out of memory"


@dataclass(frozen=True)
class Outcome:
    """Result of `compute_points`."""

    computed: int  #: number of points that any process has computed meanwhile
    missing: int  #: number of points without a file, those of other parts included
    failures: Failures  #: errors by label, of points that failed and left no file


def compute_points(
    chains: Sequence[Chain],
    work: Work,
    *,
    report: Report = silent,
    name: str = "points",
    each: Expected | None = None,
    comm: parallel.Comm = None,
) -> Outcome:
    """Compute the points of some chains that their folders do not hold.

    The chains are those of all parts. `name` is that of the points in the progress, `each` what one
    is expected to take, by which `work.jobs_for` decides. `comm` computes them, `work.comm` if left
    out.

    Raises
    ------
    MissingPackage, InvalidInput
        As of `compute_chain`.
    """
    k, n = work.part
    comm = work.comm if comm is None else comm
    mine = [] if work.gather else list(chains[k - 1 :: n])
    missing = parallel.on_root(lambda: _cleared(mine), comm)
    waiting = [
        replace(chain, tasks=tasks)
        for chain in mine
        if (tasks := tuple(t for t in chain.tasks if chain.folder.path_of(t.name) in missing))
    ]
    jobs = work.jobs_for(len(waiting), len(missing), each)
    expected = None if each is None else len(missing) * each.seconds / jobs
    pace = Pace(len(missing), name, report, expected)
    failures: Failures = {}
    if missing and jobs == 1 and work.executor is None:
        for chain in waiting:
            failures |= compute_chain(chain, pace, comm=comm, after_each=pace.count)
    elif missing:

        def poll() -> int:
            """Show the progress, and count the finished points."""
            pace.count(len(missing) - len(_without_file(waiting)))
            pace("", "")
            return pace.done

        if work.executor is not None:
            failures = _by_executor(waiting, work.executor, poll)
        else:
            need = UNKNOWN_POINT if each is None else each.reserved
            failures = _by_workers(waiting, jobs, poll, work.memory, need)
    left, all_left = parallel.on_root(lambda: (_without_file(mine), _without_file(chains)), comm)
    if missing:
        pace.count(len(missing) - len(left))
        pace("", "")
    return Outcome(len(missing) - len(left), len(all_left), failures)


def _cleared(chains: Sequence[Chain]) -> set[Path]:
    """Files of the points to compute; those of failed and damaged points are removed."""
    missing = set()
    for chain in chains:
        for task in chain.tasks:
            if not chain.folder.finished(task.name):
                path = chain.folder.path_of(task.name)
                path.unlink(missing_ok=True)
                missing.add(path)
    return missing


def _without_file(chains: Sequence[Chain]) -> list[str]:
    """Names of the points that have no file."""
    return [
        task.name
        for chain in chains
        for task in chain.tasks
        if not chain.folder.path_of(task.name).exists()
    ]


def compute_chain(
    chain: Chain,
    report: Report = silent,
    *,
    comm: parallel.Comm = None,
    after_each: Callable[[], object] = nothing,
) -> Failures:
    """Compute the points of a chain that its folder does not hold, `comm` together.

    Returns the errors of points that failed.

    Raises
    ------
    MissingPackage
        If no point can be computed on this machine.
    InvalidInput
        If the folder cannot be written.
    MemoryError, OSError
        If several processes compute together, and one of them runs out of memory or cannot read.
    """
    handed_on = chain.begin()
    failures: Failures = {}
    for task in chain.tasks:
        # Another process may have computed the point meanwhile.
        if not parallel.on_root(partial(chain.folder.finished, task.name), comm):
            try:
                point = task.compute(handed_on, under(task.label, report), comm)
            except MissingPackage:
                raise
            except FemSealError as error:
                failures[task.label] = error
            except (MemoryError, OSError) as error:
                if parallel.processes(comm) > 1:
                    raise  # The others wait for this process and know nothing of its error.
                failures[task.label] = explained(error)
            else:
                # A folder that cannot be written keeps none of the points to come either.
                parallel.on_root(partial(chain.folder.save, task.name, point), comm)
        after_each()
    return failures


def compute_alone(chain: Chain) -> Failures:
    """Compute a chain in a worker, which solves without the other processes."""
    with parallel.by_itself():
        return compute_chain(chain)


def under(head: str, report: Report) -> Report:
    """Report with a heading, such as the label of a point, before each stage."""
    return lambda stage, detail: report(f"{head}: {stage}", detail)


def _by_executor(chains: Sequence[Chain], executor: Executor, poll: Callable[[], int]) -> Failures:
    """Compute chains by an executor, such as that of a Dask cluster."""
    running = {executor.submit(compute_alone, chain) for chain in chains}
    failures: Failures = {}
    try:
        while running:
            poll()
            finished, running = wait(running, POLL)
            for future in finished:
                failures |= future.result()
    finally:
        # After an interrupt or an error of one chain, the others would go on for long.
        for future in running:
            future.cancel()
    return failures


def _by_workers(
    chains: Sequence[Chain], jobs: int, poll: Callable[[], int], memory: float | None, need: int
) -> Failures:
    """Compute chains in workers of this machine.

    The points of a chain whose process was killed are computed once more, one after the other; one
    that ends its process again has failed.
    """
    answers, killed = farm(chains, compute_alone, jobs, poll, memory, need)
    single = [replace(chain, tasks=(task,)) for chain in killed for task in chain.tasks]
    more, again = farm(single, compute_alone, 1, poll, memory, need)
    failures: Failures = {
        chain.tasks[0].label: NotConverged(KILLED) for chain in again if _without_file([chain])
    }
    for errors in (*answers, *more):
        failures |= errors
    return failures


def compute_study(chains: Sequence[Chain], work: Work, report: Report) -> Outcome:
    """Compute the points that the folders lack, and then raise the error of the first that failed.

    The arguments are those of `compute_points`.
    """
    outcome = compute_points(chains, work, report=report)
    if outcome.failures:
        label, error = next(iter(outcome.failures.items()))
        others = len(outcome.failures) - 1
        more = f", and {number_of(others, 'other point')} failed" if others else ""
        error.args = (f"{label}: {error}{more}",)
        raise error
    return outcome


def points_of(
    tasks: Sequence[Task[T]],
    kind: type[T],
    out: Path | None,
    work: Work | None,
    report: Report,
) -> list[T] | None:
    """Points of a study whose tasks share nothing; None if some are left to other parts.

    They are of a `kind` that `PointFolder` keeps in points/ of `out`; no files are kept if that is
    left out. Without `work` they are computed one after the other. Errors are those of
    `compute_study`.
    """
    work = work or Work()
    with ExitStack() as held:
        kept = out or parallel.on_root(lambda: held.enter_context(temporary_folder()), work.comm)
        folder = PointFolder(kept / "points", kind)
        if compute_study([Chain(folder, (task,)) for task in tasks], work, report).missing:
            return None
        return parallel.on_root(
            lambda: [present(folder.point(task.name), task.label) for task in tasks], work.comm
        )
