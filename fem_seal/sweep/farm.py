"""Chains of points in processes of their own, each of which solves alone."""

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

from fem_seal.memory import available_memory

Chain = TypeVar("Chain")

_POLL = 0.5  # between two looks at what has finished [s]
_DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG of prctl(2)
# Of an mpirun, or of MPI started in this process: workers are alone.
_OF_MPI = ("OMPI_", "PMIX_", "PMI_")
_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_SPARE = 1.2  # memory is kept for this many times the largest point so far


class WorkerKilledError(Exception):
    """A process of the pool has died, most likely of too little memory."""


def farm(
    chains: Sequence[Chain],
    compute: Callable[[Chain], object],
    jobs: int,
    look: Callable[[], int | None],
) -> None:
    """Compute chains in processes of this machine.

    The first process works alone until it has finished a point: it compiles the forms that the
    others then find in the cache, and shows how much memory a point takes. So many others are
    started as are asked for and as the memory of the machine holds.

    Parameters
    ----------
    chains : each is pickled
    compute : does a chain, in a process of its own; a function of a module
    jobs : most processes at a time
    look : called every half second and at the end; returns the largest memory of a point so far
        [bytes], None before the first one

    Raises
    ------
    WorkerKilledError
        If a process has died; chains that it kept from being done are left undone.
    """
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), _begin)
    done = False
    try:
        with _environment():
            watch(chains, compute, pool, look, jobs)
        done = True
    except BrokenProcessPool:
        raise WorkerKilledError from None
    finally:
        if not done:
            # After an interrupt, or an error of one chain, the others would run on for long.
            for process in list((pool._processes or {}).values()):
                process.terminate()
        pool.shutdown(cancel_futures=True)


def watch(
    chains: Sequence[Chain],
    compute: Callable[[Chain], object],
    executor: Executor,
    look: Callable[[], int | None],
    jobs: float = inf,
) -> None:
    """Compute chains by an executor, such as that of a Dask cluster.

    Parameters
    ----------
    chains, compute, look : as in `farm`
    executor : any of concurrent.futures
    jobs : most chains at a time; all are handed over at once if left out
    """
    waiting = deque(chains)
    running: set[Future] = set()
    most = jobs if jobs == inf else 1
    while waiting or running:
        while waiting and len(running) < most:
            running.add(executor.submit(compute, waiting.popleft()))
        finished, running = wait(running, _POLL, FIRST_COMPLETED)
        for future in finished:
            future.result()
        memory = look()
        if memory is not None and most < jobs:
            most = min(jobs, len(running) + max(0, int(available_memory() / (_SPARE * memory))))
            most = max(1, most)
    look()


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
