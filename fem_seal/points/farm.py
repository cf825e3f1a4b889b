"""Chains of points in processes of their own; each process solves alone."""

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from math import inf
from multiprocessing import forkserver, parent_process
from threading import Thread
from typing import TypeVar

from fem_seal.errors import present
from fem_seal.memory import available_memory, memory_of
from fem_seal.parallel import OF_MPI
from fem_seal.points.work import UNKNOWN_POINT

Chain = TypeVar("Chain")
Answer = TypeVar("Answer")

_POLL = 0.5  # time between two polls of the chains [s]
_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_SPARE = 1.2  # memory kept free for each process, over that of the largest point so far


class WorkerKilledError(Exception):
    """A process of the pool has died, most likely of too little memory."""


def preload(modules: Sequence[str]) -> None:
    """Start the process from which workers are forked, and let it import what they will need.

    Optional: `farm` starts it otherwise. A command calls this before it imports the same modules
    itself, so that both happen at the same time. None of them may start MPI, which does not survive
    a fork.
    """
    multiprocessing.set_forkserver_preload(list(modules))
    # The fork server and its workers inherit this mask: only the present process handles Ctrl-C.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        with _environment():
            forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def farm(
    chains: Sequence[Chain],
    compute: Callable[[Chain], Answer],
    jobs: int,
    poll: Callable[[], int],
    memory: int | None = None,
    need: int = UNKNOWN_POINT,
) -> list[Answer]:
    """Compute chains in processes of this machine.

    At most `jobs` processes are started, and no more than the memory holds. Until a point is
    finished and shows how much memory it takes, `need` is kept free for each process. The answers
    of `compute` are in the order in which they came.

    Parameters
    ----------
    chains, compute
        Each chain is pickled; `compute` is a function of a module.
    poll
        Called every half second and at the end; returns how many points are finished.
    memory
        Most memory of all processes together [bytes]; what the machine has if left out.
    need
        Memory that a process is expected to need [bytes].

    Raises
    ------
    WorkerKilledError
        If a process has died; the chains that were not finished are then not computed.
    """
    preload([compute.__module__])
    with _environment() as environment:
        context = multiprocessing.get_context("forkserver")
        pool = ProcessPoolExecutor(jobs, context, _begin, (environment,))
    largest = 0

    def fitting(finished: int) -> int:
        """Processes that the memory holds, from the largest use of any so far."""
        nonlocal largest
        used = [size for pid in list(pool._processes or ()) if (size := memory_of(pid))]
        largest = max([largest, *(size.peak for size in used)])
        resident = [size.resident for size in used]
        left = available_memory()
        if memory is not None:
            left = min(left, memory - sum(resident))
        most = max(int(_SPARE * largest), 0 if finished else need)
        return min(jobs, processes_that_fit(most, resident, left))

    done = False
    try:
        answers = watch(chains, compute, pool, poll, fitting)
        done = True
    except BrokenProcessPool:
        raise WorkerKilledError from None
    finally:
        if not done:
            # After an interrupt or an error of one chain, the others would go on for long.
            for process in list((pool._processes or {}).values()):
                process.terminate()
        pool.shutdown(cancel_futures=True)
    return answers


def processes_that_fit(need: int, resident: Sequence[int], available: int) -> int:
    """Count the processes that the memory holds, at least one.

    All in bytes: `need` is what a process takes at most, `resident` what each running one holds
    already, which may still grow to that, `available` what nobody uses.
    """
    if not need:
        return 1
    growth = sum(max(0, need - size) for size in resident)
    return max(1, len(resident) + (available - growth) // need)


def watch(
    chains: Sequence[Chain],
    compute: Callable[[Chain], Answer],
    executor: Executor,
    poll: Callable[[], int],
    most_running: Callable[[int], float] | None = None,
) -> list[Answer]:
    """Compute chains by an executor, such as that of a Dask cluster.

    As `farm`; `most_running` gives the largest number of chains that run at a time from the number
    of finished points, and without it all are submitted at once.
    """
    waiting = deque(chains)
    running: set[Future[Answer]] = set()
    answers: list[Answer] = []
    most = inf if most_running is None else most_running(0)
    while waiting or running:
        while waiting and len(running) < most:
            running.add(executor.submit(compute, waiting.popleft()))
        # All workers are busy now: the time of the poll, which may write a table, is not lost.
        finished_points = poll()
        if most_running is not None:
            most = most_running(finished_points)
        finished, running = wait(running, _POLL, FIRST_COMPLETED)
        answers += [future.result() for future in finished]
    poll()
    return answers


@contextmanager
def _environment() -> Iterator[dict[str, str]]:
    """Set the environment variables of the workers; restore those of this process at the end."""
    before = dict(os.environ)
    for name in before:
        if name.startswith(OF_MPI) and not name.startswith("OMPI_MCA_"):
            del os.environ[name]
    os.environ.update(_ONE_THREAD)
    try:
        yield dict(os.environ)
    finally:
        os.environ.clear()
        os.environ.update(before)


def _begin(environment: dict[str, str]) -> None:
    """Begin a worker: take the present variables of the first process, and die with it.

    The fork server only has the variables of the time at which it was started. It cannot end the
    workers of a first process that was killed: it runs as long as one of them does.
    """
    os.environ.clear()
    os.environ.update(environment)
    Thread(target=_die_with_first_process, daemon=True).start()


def _die_with_first_process() -> None:
    first = present(parent_process(), "first process of a worker")
    first.join()
    os.kill(os.getpid(), signal.SIGKILL)
