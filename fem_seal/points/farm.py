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
from typing import TypeVar

from fem_seal.memory import available_memory, memory_of

Chain = TypeVar("Chain")
Answer = TypeVar("Answer")

_POLL = 0.5  # between two looks at what has finished [s]
_DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG of prctl(2)
# Of an mpirun, or of MPI started in this process: workers are alone.
_OF_MPI = ("OMPI_", "PMIX_", "PMI_")
_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_SPARE = 1.2  # times the largest point so far is kept free for each process


class WorkerKilledError(Exception):
    """A process of the pool has died, most likely of too little memory."""


def farm(
    chains: Sequence[Chain],
    compute: Callable[[Chain], Answer],
    jobs: int,
    look: Callable[[], int],
    memory: int | None = None,
) -> list[Answer]:
    """Compute chains in processes of this machine.

    The first process works alone until it has finished a point: it compiles the forms that the
    others then find in the cache, and shows how much memory a point takes. Others are started up
    to the number that was asked for, and that the memory of the machine holds.

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
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), _begin)
    largest = 0

    def fitting() -> int:
        nonlocal largest
        used = [size for pid in list(pool._processes or ()) if (size := memory_of(pid))]
        largest = max([largest, *(size.peak for size in used)])
        resident = [size.resident for size in used]
        left = available_memory()
        if memory is not None:
            left = min(left, memory - sum(resident))
        return processes_that_fit(int(_SPARE * largest), resident, left)

    done = False
    try:
        with _environment():
            answers = watch(chains, compute, pool, look, lambda: min(jobs, fitting()))
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
    room: Callable[[], float] | None = None,
) -> list[Answer]:
    """Compute chains by an executor, such as that of a Dask cluster.

    Parameters
    ----------
    chains, compute, look : as in `farm`
    executor : concurrent.futures.Executor
    room : callable, optional
        How many chains may run at a time, once a point is finished; before that it is one. All
        chains are handed over at once if left out.

    Returns
    -------
    list
        As of `farm`.
    """
    waiting = deque(chains)
    running: set[Future[Answer]] = set()
    answers: list[Answer] = []
    most = inf if room is None else 1
    while waiting or running:
        while waiting and len(running) < most:
            running.add(executor.submit(compute, waiting.popleft()))
        finished, running = wait(running, _POLL, FIRST_COMPLETED)
        answers += [future.result() for future in finished]
        if look() and room is not None:
            most = room()
    look()
    return answers


@contextmanager
def _environment() -> Iterator[None]:
    """Variables as the workers are to find them."""
    before = dict(os.environ)
    for name in before:
        if name.startswith(_OF_MPI) and not name.startswith("OMPI_MCA_"):
            del os.environ[name]
    os.environ.update(_ONE_THREAD)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _begin() -> None:
    """Leave Ctrl-C to the first process, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    prctl = getattr(ctypes.CDLL(None), "prctl", None)
    if prctl is not None:  # Linux alone has it
        prctl(_DIE_WITH_PARENT, signal.SIGKILL)
