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
from functools import partial
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


NEWS_BYTES = 200  # of a chain's latest news
# Of a worker: memory for the news of all chains, and the number of its chain.
_news: "ctypes.Array[ctypes.c_ubyte] | None" = None
_number = 0


def _nobody(news: str) -> None:
    """Hear nothing."""


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
    hear: Callable[[str], None] = _nobody,
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
    hear : callable
        Called before each look with the latest news, by `say`, of the first chain that runs.

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
        news = context.RawArray(ctypes.c_ubyte, NEWS_BYTES * len(chains))
        pool = ProcessPoolExecutor(jobs, context, _begin, (environment, news))
    largest = 0

    def look_and_hear() -> int:
        hear(_first_news(bytes(memoryview(news))))
        return look()

    def fitting(finished: int) -> int:
        """Processes that the memory holds, from the largest use of any so far."""
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
        numbered = list(enumerate(chains))
        answers = watch(numbered, partial(_numbered, compute), pool, look_and_hear, fitting)
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


def _first_news(news: bytes) -> str:
    """Text of the first chain that has one."""
    number = (len(news) - len(news.lstrip(b"\0"))) // NEWS_BYTES
    text = news[number * NEWS_BYTES : (number + 1) * NEWS_BYTES]
    return text.rstrip(b"\0").decode("utf-8", "ignore")


def say(stage: str, detail: str) -> None:
    """Give news of the chain that this process computes; a `Report` for workers of `farm`."""
    if _news is not None:
        words = f"{stage}: {detail}" if detail else stage
        _write(words.encode()[:NEWS_BYTES])


def _write(text: bytes) -> None:
    # Each chain has a part of the memory, which one process writes: there is no lock that a killed
    # process could hold.
    if _news is not None:
        start = _number * NEWS_BYTES
        _news[start : start + NEWS_BYTES] = list(text.ljust(NEWS_BYTES, b"\0"))


def _numbered(compute: Callable[[Chain], Answer], numbered: tuple[int, Chain]) -> Answer:
    """Compute a chain with its number; its news end with it."""
    global _number
    _number, chain = numbered
    try:
        return compute(chain)
    finally:
        _write(b"")


def _begin(environment: dict[str, str], news: "ctypes.Array[ctypes.c_ubyte]") -> None:
    """Take the variables of the first process as they are now, and end with it.

    The process from which workers are forked has those of the time at which it was started.
    """
    global _news
    _news = news
    os.environ.clear()
    os.environ.update(environment)
    prctl = getattr(ctypes.CDLL(None), "prctl", None)
    if prctl is not None:  # Linux alone has it
        prctl(_DIE_WITH_PARENT, signal.SIGKILL)
