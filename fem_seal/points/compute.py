"""Compute the points that are missing, in this process or in many."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, wait
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from fem_seal import parallel
from fem_seal.digits import number_of
from fem_seal.errors import FemSealError, InvalidInput, MissingPackage, NotConverged
from fem_seal.points.farm import POLL, farm
from fem_seal.points.task import Chain, nothing
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
    MissingPackage
        If no point can be computed on this machine.
    """
    k, n = work.part
    comm = work.comm if comm is None else comm
    mine = [] if work.gather else list(chains[k - 1 :: n])
    missing = parallel.on_root(lambda: _cleared(mine), comm)
    jobs = work.jobs_for(min(len(mine), len(missing)), len(missing), each)
    expected = None if each is None else len(missing) * each.seconds / jobs
    pace = Pace(len(missing), name, report, expected)
    failures: Failures = {}
    if missing and jobs == 1 and work.executor is None:
        for chain in mine:
            failures |= compute_chain(chain, pace, comm=comm, after_each=pace.count)
    elif missing:

        def poll() -> int:
            """Show the progress, and count the finished points."""
            pace.count(len(missing) - len(_without_file(mine)))
            pace("", "")
            return pace.done

        waiting = [chain for chain in mine if _without_file([chain])]
        if work.executor is not None:
            failures = _by_executor(waiting, work.executor, poll)
        else:
            need = UNKNOWN_POINT if each is None else each.reserved
            failures = _by_workers(waiting, jobs, poll, work.memory, need)
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

    Returns the errors of points that failed.
    """
    handed_on = chain.begin()
    failures: Failures = {}
    for task in chain.tasks:
        # Another process may have computed the point meanwhile.
        if parallel.on_root(partial(chain.folder.finished, task.name), comm):
            continue
        try:
            point = task.compute(handed_on, under(task.label, report), comm)
            parallel.on_root(partial(chain.folder.write, task.name, point), comm)
        except MissingPackage:
            raise
        except FemSealError as error:
            failures[task.label] = error
        except (MemoryError, OSError) as error:
            failures[task.label] = InvalidInput(str(error) or type(error).__name__)
        after_each()
    return failures


def compute_alone(chain: Chain) -> Failures:
    """Compute a chain in a worker, which solves without the other processes."""
    comm = parallel.alone()
    parallel.start_petsc(comm)
    return compute_chain(chain, comm=comm)


def under(head: str, report: Report) -> Report:
    """Report with a heading, such as the label of a point, before each stage."""
    return lambda stage, detail: report(f"{head}: {stage}", detail)


def _by_executor(chains: Sequence[Chain], executor: Executor, poll: Callable[[], int]) -> Failures:
    """Compute chains by an executor, such as that of a Dask cluster."""
    running = {executor.submit(compute_alone, chain) for chain in chains}
    failures: Failures = {}
    while running:
        poll()
        finished, running = wait(running, POLL)
        for future in finished:
            failures |= future.result()
    return failures


def _by_workers(
    chains: Sequence[Chain], jobs: int, poll: Callable[[], int], memory: int | None, need: int
) -> Failures:
    """Compute chains in workers of this machine, those whose process was killed once more alone.

    If that is killed as well, the point has failed, and the points after it go on.
    """
    failures: Failures = {}
    answers, killed = farm(chains, compute_alone, jobs, poll, memory, need)
    while killed:
        chain = killed.pop()
        more, again = farm([chain], compute_alone, 1, poll, memory, need)
        answers += more
        if again:
            names = _without_file([chain])
            number = [task.name for task in chain.tasks].index(names[0])
            failures[chain.tasks[number].label] = NotConverged(KILLED)
            killed.append(Chain(chain.folder, chain.tasks[number + 1 :], chain.begin))
    for errors in answers:
        failures |= errors
    return failures


def compute_study(chains: Sequence[Chain], work: Work | None, report: Report) -> Outcome:
    """Compute the points that the folders lack; one that fails does not stop the others.

    The arguments are those of `compute_points`; without `work` the chains are computed in turn.

    Raises
    ------
    FemSealError
        If points have failed, after the others have been computed.
    """
    outcome = compute_points(chains, work or Work(), report=report)
    for label, error in outcome.failures.items():
        count = number_of(len(outcome.failures), "point")
        error.args = (f"{count} failed, the first of them {label}: {error}",)
        raise error
    return outcome
