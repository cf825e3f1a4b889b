"""Chains of points in processes of their own; each process solves alone."""

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing import forkserver, parent_process
from threading import Thread
from typing import TypeVar

from fem_seal.beside import record_peak
from fem_seal.errors import present
from fem_seal.memory import available_memory, memory_of
from fem_seal.parallel import OF_MPI
from fem_seal.points.work import UNKNOWN_POINT

Item = TypeVar("Item")
T = TypeVar("T")

POLL = 0.5  # time between two polls of the chains [s]
_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_SPARE = 1.2  # memory kept free for each process, over that of the largest point so far


def farm(
    chains: Sequence[Item],
    compute: Callable[[Item], T],
    jobs: int,
    poll: Callable[[], int],
    memory: float | None = None,
    need: int = UNKNOWN_POINT,
) -> tuple[list[T], list[Item]]:
    """Compute chains in processes of this machine.

    At most `jobs` processes are started, and no more than the memory holds. Until a point is
    finished and shows how much memory it takes, `need` is kept free for each process. Returns the
    answers of `compute`, in the order in which they came, and the chains whose process was killed.

    Parameters
    ----------
    chains, compute
        Each chain is pickled; `compute` is a function of a module.
    poll
        Called every half second and after each chain; returns how many points are finished.
    memory
        Most memory of all processes together [bytes]; what the machine has if left out.
    need
        Memory that a process is expected to need [bytes].

    Raises
    ------
    Exception
        The first error that `compute` raises in any process; this ends the other processes.
    """
    context = multiprocessing.get_context("forkserver")
    with _environment() as environment:
        _start_fork_server(compute.__module__)
    # One process each, so that the end of one tells which chain has ended it, and stops no other.
    workers: list[ProcessPoolExecutor] = []
    idle: list[ProcessPoolExecutor] = []
    running: dict[Future[T], tuple[ProcessPoolExecutor, Item]] = {}
    waiting, answers, killed = deque(chains), list[T](), list[Item]()
    largest = finished = 0
    try:
        while waiting or running:
            used = [size for pid in _processes_of(workers) if (size := memory_of(pid))]
            largest = max([largest, *(size.peak for size in used)])
            resident = [size.resident for size in used]
            left = available_memory()
            if memory is not None:
                left = min(left, int(memory) - sum(resident))
            most = max(int(_SPARE * largest), 0 if finished else need)
            while waiting and len(running) < min(jobs, processes_that_fit(most, resident, left)):
                if not idle:
                    idle.append(ProcessPoolExecutor(1, context, _begin, (environment,)))
                    workers.append(idle[-1])
                worker, chain = idle.pop(), waiting.popleft()
                try:
                    running[worker.submit(compute, chain)] = worker, chain
                except BrokenProcessPool:  # The system has killed the worker while it was idle.
                    waiting.appendleft(chain)
            finished = poll()
            for future in wait(running, POLL, FIRST_COMPLETED).done:
                worker, chain = running.pop(future)
                try:
                    answers.append(future.result())
                    idle.append(worker)
                except BrokenProcessPool:
                    killed.append(chain)
    finally:
        sizes = map(memory_of, _processes_of(workers))
        record_peak(sum(size.peak for size in sizes if size))
        # After an interrupt or an error of one chain, the others would go on for long.
        for pid in _processes_of([worker for worker in workers if worker not in idle]):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGTERM)
        for worker in workers:
            worker.shutdown(wait=False)
    return answers, killed


def _processes_of(workers: Sequence[ProcessPoolExecutor]) -> list[int]:
    """Numbers of the processes of workers that run."""
    return [pid for worker in workers for pid in list(worker._processes or ())]


def processes_that_fit(need: int, resident: Sequence[int], available: int) -> int:
    """Count the processes that the memory holds, at least one.

    All in bytes: `need` is what a process takes at most, `resident` what each running one holds
    already, which may still grow to that, `available` what nobody uses.
    """
    if not need:
        return 1
    growth = sum(max(0, need - size) for size in resident)
    return max(1, len(resident) + (available - growth) // need)


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


def _start_fork_server(module: str) -> None:
    """Start the process from which workers are forked; it imports the module that they need.

    The module may not start MPI, which does not survive a fork.
    """
    multiprocessing.set_forkserver_preload([module])
    # The fork server and its workers inherit this mask: only the present process handles Ctrl-C.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


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
