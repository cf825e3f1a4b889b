"""Chains of points in processes of their own; each process solves alone."""

import ctypes
import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from math import inf
from multiprocessing import forkserver
from typing import TypeVar

from fem_seal.memory import available_memory, memory_of
from fem_seal.parallel import OF_MPI

Chain = TypeVar("Chain")
Answer = TypeVar("Answer")

_POLL = 0.5  # between two looks at what has finished [s]
_DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG of prctl(2)
_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_SPARE = 1.2  # times the largest point so far is kept free for each process
# Memory kept free for each process until a point is finished: what a contact on 4096 x 4096
# samples and its flow take [bytes].
UNKNOWN_POINT = 4_000_000_000


class WorkerKilledError(Exception):
    """A process of the pool has died, most likely of too little memory."""


def prepare(modules: Sequence[str]) -> None:
    """Start the process from which workers are forked, and let it import what they will need.

    Optional: `farm` starts it otherwise. A command calls this before it imports the same modules
    itself, so that both happen at the same time.

    Parameters
    ----------
    modules : sequence of str
        None of them may start MPI, which does not survive a fork.
    """
    multiprocessing.set_forkserver_preload(list(modules))
    # The process and its workers inherit that Ctrl-C is left to this one.
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
    look: Callable[[], int],
    memory: int | None = None,
) -> list[Answer]:
    """Compute chains in processes of this machine.

    As many processes are started as were asked for and as the memory holds. Until a point is
    finished, and shows how much memory it takes, each counts as `UNKNOWN_POINT`.

    Parameters
    ----------
    chains : sequence
        Each is pickled.
    compute : callable
        Computes a chain in a process of its own; a function of a module.
    jobs : int
        Most processes at a time.
    look : callable
        Called every half second and at the end; returns how many points are finished.
    memory : int, optional
        Most memory of all processes together [bytes]; what the machine has if left out.

    Returns
    -------
    list
        Answers of `compute`, in the order in which they came.

    Raises
    ------
    WorkerKilledError
        If a process has died; chains that it kept from being computed are not computed.
    """
    prepare([compute.__module__])
    with _environment() as environment:
        context = multiprocessing.get_context("forkserver")
        pool = ProcessPoolExecutor(jobs, context, _begin, (environment,))
    largest = 0

    def fitting(finished: int) -> int:
        nonlocal largest
        used = [size for pid in list(pool._processes or ()) if (size := memory_of(pid))]
        largest = max([largest, *(size.peak for size in used)])
        resident = [size.resident for size in used]
        left = available_memory()
        if memory is not None:
            left = min(left, memory - sum(resident))
        need = max(int(_SPARE * largest), 0 if finished else UNKNOWN_POINT)
        return min(jobs, processes_that_fit(need, resident, left))

    done = False
    try:
        answers = watch(chains, compute, pool, look, fitting)
        done = True
    except BrokenProcessPool:
        raise WorkerKilledError from None
    finally:
        if not done:
            # After an interrupt, or an error of one chain, the others would run on for long.
            for process in list((pool._processes or {}).values()):
                process.terminate()
        pool.shutdown(cancel_futures=True)
    return answers


def processes_that_fit(need: int, resident: Sequence[int], available: int) -> int:
    """Count the processes that the memory holds, at least one.

    Parameters
    ----------
    need : int
        Memory that a process takes at most [bytes].
    resident : sequence of int
        What each running process holds already [bytes]; it may still grow to `need`.
    available : int
        Memory that nobody uses [bytes].
    """
    if not need:
        return 1
    growth = sum(max(0, need - size) for size in resident)
    return max(1, len(resident) + (available - growth) // need)


def watch(
    chains: Sequence[Chain],
    compute: Callable[[Chain], Answer],
    executor: Executor,
    look: Callable[[], int],
    room: Callable[[int], float] | None = None,
) -> list[Answer]:
    """Compute chains by an executor, such as that of a Dask cluster.

    Parameters
    ----------
    chains, compute, look : as in `farm`
    executor : concurrent.futures.Executor
    room : callable, optional
        How many chains may run at a time, from the number of finished points. All chains are
        handed over at once if left out.

    Returns
    -------
    list
        As of `farm`.
    """
    waiting = deque(chains)
    running: set[Future[Answer]] = set()
    answers: list[Answer] = []
    most = inf if room is None else room(0)
    while waiting or running:
        while waiting and len(running) < most:
            running.add(executor.submit(compute, waiting.popleft()))
        # Now that all workers are busy there is time for the table.
        finished_points = look()
        if room is not None:
            most = room(finished_points)
        finished, running = wait(running, _POLL, FIRST_COMPLETED)
        answers += [future.result() for future in finished]
    look()
    return answers


@contextmanager
def _environment() -> Iterator[dict[str, str]]:
    """Variables as the workers are to find them."""
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
    """Take the variables of the first process as they are now, and end with it.

    The process from which workers are forked has those of the time at which it was started.
    """
    os.environ.clear()
    os.environ.update(environment)
    prctl = getattr(ctypes.CDLL(None), "prctl", None)
    if prctl is not None:  # Linux alone has it
        prctl(_DIE_WITH_PARENT, signal.SIGKILL)
