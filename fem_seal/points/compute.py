"""Compute the points that are missing, in this process or in many."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import monotonic
from typing import TypeAlias

from fem_seal import parallel
from fem_seal.errors import FemSealError, MissingPackage, NotConverged
from fem_seal.points.farm import WorkerKilledError, farm, watch
from fem_seal.points.task import Chain, Task, nothing
from fem_seal.points.work import UNKNOWN_POINT, Expected, Work
from fem_seal.progress import Pace, Report, silent

Failures: TypeAlias = dict[str, FemSealError]
KILLED = "the process that computed it was killed; most likely it ran out of memory"
# `_Throttled` waits at least this many times as long as its last call took.
SELDOM = 50


@dataclass(frozen=True)
class Outcome:
    """Result of `compute_points`."""

    computed: int  #: number of points that any process has computed meanwhile
    missing: int  #: number of points without a file, those of other parts included
    #: errors by label, of points that failed and left no file
    failures: Failures


class _Throttled:
    """A function whose calls are skipped if they would take much of the time."""

    def __init__(self, call: Callable[[], object]):
        self._call, self._next = call, 0.0

    def __call__(self) -> None:
        start = monotonic()
        if start >= self._next:
            self._call()
            end = monotonic()
            self._next = end + SELDOM * (end - start)


def compute_points(
    chains: Sequence[Chain],
    work: Work,
    *,
    report: Report = silent,
    gather: Callable[[], object] = nothing,
    name: str = "points",
    each: Expected | None = None,
    comm: parallel.Comm = None,
) -> Outcome:
    """Compute the points of some chains that their folders do not hold.

    The chains are those of all parts. `gather` makes a table of the finished points; the first
    process calls it now and then, and at the end. `name` is that of the points in the progress,
    `each` what one is expected to take, by which `work.jobs_for` decides. `comm` computes them,
    `work.comm` if left out.

    Raises
    ------
    MissingPackage
        If no point can be computed on this machine.
    """
    k, n = work.part
    comm = work.comm if comm is None else comm
    mine = [] if work.gather else list(chains[k - 1 :: n])
    missing = parallel.on_root(lambda: _cleared(mine), comm)
    jobs = work.jobs_for(min(len(mine), len(missing)), len(missing), each)
    need = UNKNOWN_POINT if each is None else each.reserved
    expected = None if each is None else len(missing) * each.seconds / jobs
    pace = Pace(len(missing), name, report, expected)
    failures: Failures = {}
    try:
        if missing and jobs == 1 and work.executor is None:
            now_and_then = _Throttled(gather)

            def after_each() -> None:
                pace.count()
                now_and_then()

            for chain in mine:
                failures |= compute_chain(chain, pace, comm=comm, after_each=after_each)
        elif missing:
            failures = _by_workers(mine, missing, replace(work, jobs=jobs), need, pace, gather)
    finally:
        if parallel.is_root(comm):
            gather()
    left, all_left = parallel.on_root(lambda: (_without_file(mine), _without_file(chains)), comm)
    return Outcome(len(missing) - len(left), len(all_left), failures)


def _cleared(chains: Sequence[Chain]) -> list[str]:
    """Names of the points to compute; files of failed and damaged ones are removed."""
    missing = []
    for chain in chains:
        for task in chain.tasks:
            if not chain.folder.finished(task.name):
                chain.folder.remove(task.name)
                missing.append(task.name)
    return missing


def _without_file(chains: Sequence[Chain]) -> list[str]:
    """Names of the points that have no file."""
    return [
        task.name for chain in chains for task in chain.tasks if not chain.folder.exists(task.name)
    ]


def compute_chain(
    chain: Chain,
    report: Report = silent,
    *,
    comm: parallel.Comm = None,
    after_each: Callable[[], object] = nothing,
) -> Failures:
    """Compute the points of a chain that its folder does not hold, `comm` together.

    Returns the errors, by label, of points that failed and left no file.
    """
    handed_on = chain.begin()
    failures: Failures = {}
    for task in chain.tasks:
        # Another process may have computed the point meanwhile.
        if parallel.on_root(partial(chain.folder.finished, task.name), comm):
            continue
        try:
            point = task.compute(handed_on, under(task.label, report), comm)
        except MissingPackage:
            raise
        except FemSealError as error:
            point = task.failed(str(error))
            if point is None:
                failures[task.label] = error
                continue
        parallel.on_root(partial(chain.folder.write, task.name, point), comm)
        parallel.on_root(lambda: after_each() and None, comm)
    return failures


def compute_alone(chain: Chain) -> Failures:
    """Compute a chain in a worker, which solves without the other processes."""
    comm = parallel.alone()
    parallel.start_petsc(comm)
    return compute_chain(chain, comm=comm)


def under(head: str, report: Report) -> Report:
    """Report with a heading, such as the label of a point, before each stage."""
    return lambda stage, detail: report(f"{head}: {stage}", detail)


def _by_workers(
    chains: list[Chain],
    missing: Sequence[str],
    work: Work,
    need: int,
    pace: Pace,
    gather: Callable[[], object],
) -> Failures:
    """Compute chains in workers; return the errors of points that failed and left no file."""
    folder_of = {task.name: chain.folder for chain in chains for task in chain.tasks}
    now_and_then = _Throttled(gather)

    def poll() -> int:
        """Gather the table now and then, show the progress, and count the finished points."""
        now_and_then()
        pace.count(sum(folder_of[name].exists(name) for name in missing))
        pace("", "")
        return pace.done

    chains = [chain for chain in chains if _without_file([chain])]
    failures: Failures = {}
    if work.executor is not None:
        for errors in watch(chains, compute_alone, work.executor, poll):
            failures |= errors
        return failures
    alone = False
    while chains:
        # A point whose process is killed twice, the second time alone, has failed.
        batch = chains[:1] if alone else chains
        try:
            jobs = 1 if alone else work.jobs or 1
            for errors in farm(batch, compute_alone, jobs, poll, work.memory, need):
                failures |= errors
        except WorkerKilledError:
            chains = [chain for chain in chains if _without_file([chain])]
            if not chains:
                break
            if alone:
                chains[0] = _without_killer(chains[0], failures)
            alone = True
        else:
            chains, alone = chains[len(batch) :], False
    return failures


def _without_killer(chain: Chain, failures: Failures) -> Chain:
    """Record the failure of the point that killed its process; the points after it go on."""
    killer = next(task for task in chain.tasks if not chain.folder.exists(task.name))
    point = killer.failed(KILLED)
    if point is None:
        failures[killer.label] = NotConverged(KILLED)
    else:
        chain.folder.write(killer.name, point)
    rest: tuple[Task, ...] = chain.tasks[chain.tasks.index(killer) + 1 :]
    return Chain(chain.folder, rest, chain.begin)


def compute_study(chains: Sequence[Chain], work: Work | None, report: Report) -> Outcome:
    """Compute the points that the folders lack; one that fails does not stop the others.

    The arguments are those of `compute_points`; without `work` the chains are computed in turn.

    Raises
    ------
    FemSealError
        If points have failed, after the others have been computed.
    """
    outcome = compute_points(chains, work or Work(), report=report)
    if outcome.failures:
        label, error = next(iter(outcome.failures.items()))
        count = len(outcome.failures)
        points = "a point has failed" if count == 1 else f"{count} points have failed, the first of"
        points += "" if count == 1 else " them"
        raise type(error)(f"{points}: {label}: {error}")
    return outcome
