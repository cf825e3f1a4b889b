"""Compute the points that are missing, in this process or in many."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, wait
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias

from fem_seal import parallel
from fem_seal.digits import number_of
from fem_seal.errors import (
    FemSealError,
    InvalidInput,
    MissingPackage,
    NotConverged,
    explained,
    present,
)
from fem_seal.files import POINTS, temporary_folder
from fem_seal.points.farm import POLL, farm
from fem_seal.points.folder import PointFolder, T
from fem_seal.points.task import Task
from fem_seal.points.work import Expected, Work
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
    folder: PointFolder[T],
    tasks: Sequence[Task[T]],
    work: Work,
    *,
    report: Report = silent,
    name: str = "points",
    each: Expected | None = None,
    comm: parallel.Comm = None,
) -> Outcome:
    """Compute the points of some tasks that a folder does not hold.

    The tasks are those of all parts. `name` is that of the points in the progress, `each` what one
    is expected to take, by which `work.jobs_for` decides. `comm` computes them, `work.comm` if left
    out.

    Raises
    ------
    MissingPackage, InvalidInput
        As of `compute_point`.
    """
    k, n = work.part
    comm = work.comm if comm is None else comm
    mine = [] if work.gather else tasks[k - 1 :: n]
    missing = parallel.on_root(lambda: _cleared(folder, mine), comm)
    waiting = [task for task in mine if task.name in missing]
    jobs = work.jobs_for(len(waiting), each)
    expected = None if each is None else len(waiting) * each.seconds / jobs
    pace = Pace(len(waiting), name, report, expected)
    failures: Failures = {}
    if waiting and jobs == 1 and work.executor is None:
        for task in waiting:
            failures |= compute_point(folder, task, pace, comm)
            pace.count()
    elif waiting:

        def poll() -> None:
            """Count the finished points, and show the progress."""
            pace.count(len(waiting) - _without_file(folder, waiting))
            pace("", "")

        if work.executor is not None:
            failures = _by_executor(folder, waiting, work.executor, poll)
        else:
            failures = _by_workers(folder, waiting, jobs, poll)
    left, all_left = parallel.on_root(
        lambda: (_without_file(folder, waiting), _without_file(folder, tasks)), comm
    )
    if waiting:
        pace.count(len(waiting) - left)
        pace("", "")
    return Outcome(len(waiting) - left, all_left, failures)


def _cleared(folder: PointFolder[T], tasks: Sequence[Task[T]]) -> set[str]:
    """Names of the points to compute; files of failed and damaged ones are removed."""
    missing = {task.name for task in tasks if not folder.finished(task.name)}
    for name in missing:
        folder.path_of(name).unlink(missing_ok=True)
    return missing


def _without_file(folder: PointFolder[T], tasks: Sequence[Task[T]]) -> int:
    """Count the points that have no file."""
    return sum(not folder.path_of(task.name).exists() for task in tasks)


def compute_point(
    folder: PointFolder[T], task: Task[T], report: Report = silent, comm: parallel.Comm = None
) -> Failures:
    """Compute a point, `comm` together, unless its folder holds it; its error if it failed.

    Raises
    ------
    MissingPackage
        If no point can be computed on this machine.
    InvalidInput
        If the folder cannot be written.
    MemoryError, OSError
        If several processes compute together, and one of them runs out of memory or cannot read.
    """
    # Another process may have computed the point meanwhile.
    if parallel.on_root(partial(folder.finished, task.name), comm):
        return {}
    try:
        point = task.compute(under(task.label, report), comm)
    except MissingPackage:
        raise
    except FemSealError as error:
        return {task.label: error}
    except (MemoryError, OSError) as error:
        if parallel.processes(comm) > 1:
            raise  # The others wait for this process and know nothing of its error.
        return {task.label: explained(error)}
    # A folder that cannot be written keeps none of the points to come either.
    parallel.on_root(partial(folder.save, task.name, point), comm)
    return {}


def compute_alone(folder: PointFolder[T], task: Task[T]) -> Failures:
    """Compute a point in a worker, which solves without the other processes."""
    with parallel.by_itself():
        return compute_point(folder, task)


def under(head: str, report: Report) -> Report:
    """Report with a heading, such as the label of a point, before each stage."""
    return lambda stage, detail: report(f"{head}: {stage}", detail)


def _by_executor(
    folder: PointFolder[T], tasks: Sequence[Task[T]], executor: Executor, poll: Callable[[], object]
) -> Failures:
    """Compute points by an executor, such as that of a Dask cluster."""
    running = {executor.submit(compute_alone, folder, task) for task in tasks}
    failures: Failures = {}
    try:
        while running:
            poll()
            finished, running = wait(running, POLL)
            for future in finished:
                failures |= future.result()
    finally:
        # After an interrupt or an error of the folder, the others would go on for long.
        for future in running:
            future.cancel()
    return failures


def _by_workers(
    folder: PointFolder[T], tasks: Sequence[Task[T]], jobs: int, poll: Callable[[], object]
) -> Failures:
    """Compute points in workers of this machine.

    A point whose process was killed is computed once more, without others beside it; one that ends
    its process again has failed.
    """
    compute = partial(compute_alone, folder)
    answers, killed = farm(tasks, compute, jobs, poll)
    more, again = farm(killed, compute, 1, poll)
    failures: Failures = {
        task.label: NotConverged(KILLED) for task in again if _without_file(folder, [task])
    }
    for errors in (*answers, *more):
        failures |= errors
    return failures


def compute_study(
    folder: PointFolder[T], tasks: Sequence[Task[T]], work: Work, report: Report
) -> Outcome:
    """Compute the points that the folder lacks, and then raise the error of the first that failed.

    The arguments are those of `compute_points`.
    """
    outcome = compute_points(folder, tasks, work, report=report)
    if outcome.failures:
        label, error = next(iter(outcome.failures.items()))
        others = len(outcome.failures) - 1
        more = f", and {number_of(others, 'other point')} failed" if others else ""
        kind = InvalidInput if isinstance(error, InvalidInput) else type(error)
        raise kind(f"{label}: {error}{more}") from error
    return outcome


def points_of(
    tasks: Sequence[Task[T]],
    kind: type[T],
    out: Path | None,
    work: Work | None,
    report: Report,
) -> list[T] | None:
    """Points of a study; None if some are left to other parts.

    They are of a `kind` that `PointFolder` keeps in points/ of `out`; no files are kept if that is
    left out. Without `work` they are computed one after the other. Errors are those of
    `compute_study`.
    """
    work = work or Work()
    with ExitStack() as held:
        kept = out or parallel.on_root(lambda: held.enter_context(temporary_folder()), work.comm)
        folder = PointFolder(kept / POINTS, kind)
        if compute_study(folder, tasks, work, report).missing:
            return None
        return parallel.on_root(
            lambda: [present(folder.point(task.name), task.label) for task in tasks], work.comm
        )
