"""Points in processes of their own; each process solves alone."""

from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from select import select
from typing import TypeVar

from fem_seal.errors import Inconsistent
from fem_seal.memory import available_memory, memory_of
from fem_seal.points.work import UNKNOWN_POINT
from fem_seal.worker import Worker, record_peak

Item = TypeVar("Item")
T = TypeVar("T")

POLL = 0.5  # time between two polls of the points [s]
_SPARE = 1.2  # memory kept free for each process, over that of the largest point so far


def farm(
    items: Sequence[Item],
    compute: Callable[[Item], T],
    jobs: int,
    poll: Callable[[], int],
    memory: float | None = None,
    need: int = UNKNOWN_POINT,
) -> tuple[list[T], list[Item]]:
    """Compute items in processes of this machine.

    At most `jobs` processes are started, and no more than `memory` [bytes] holds, or that of the
    machine. Until a point is finished and shows how much memory it takes, `need` [bytes] is kept
    free for each process. `compute` is a function of a module; `poll`, called every half second and
    after each item, returns how many are finished.

    Returns the answers of `compute`, in the order in which they came, and the items whose process
    was killed. The first error that `compute` raises in any process ends the others.
    """
    idle: list[Worker] = []
    running: dict[Worker, Item] = {}
    waiting, answers, killed = deque(items), list[T](), list[Item]()
    largest = finished = 0
    try:
        while waiting or running:
            used = [size for one in (*idle, *running) if (size := memory_of(one.number))]
            largest = max([largest, *(size.peak for size in used)])
            resident = [size.resident for size in used]
            left = available_memory()
            if memory is not None:
                left = min(left, int(memory) - sum(resident))
            most = max(int(_SPARE * largest), 0 if finished else need)
            while waiting and len(running) < min(jobs, processes_that_fit(most, resident, left)):
                if worker := _begun(partial(compute, waiting[0]), idle):
                    running[worker] = waiting.popleft()
            finished = poll()
            for worker in select(list(running), [], [], POLL)[0]:
                try:
                    answers.append(worker.answer())
                    idle.append(worker)
                except EOFError:
                    if worker.end() > 0:
                        raise Inconsistent("a worker has failed; its error stands above") from None
                    killed.append(running[worker])
                del running[worker]
    finally:
        sizes = [memory_of(worker.number) for worker in (*idle, *running)]
        record_peak(sum(size.peak for size in sizes if size))
        # After an interrupt or an error of one item, the others would go on for long.
        for worker in (*idle, *running):
            worker.end()
    return answers, killed


def _begun(call: Callable[[], object], idle: list[Worker]) -> Worker | None:
    """An idle or a new worker that calls; None if the system has killed the idle one."""
    worker = idle.pop() if idle else Worker()
    try:
        worker.begin(call)
    except ConnectionError:
        worker.end()
        return None
    return worker


def processes_that_fit(need: int, resident: Sequence[int], available: int) -> int:
    """Count the processes that the memory holds, at least one.

    All in bytes: `need` is what a process takes at most, `resident` what each running one holds
    already, which may still grow to that, `available` what nobody uses.
    """
    if not need:
        return 1
    growth = sum(max(0, need - size) for size in resident)
    return max(1, len(resident) + (available - growth) // need)
