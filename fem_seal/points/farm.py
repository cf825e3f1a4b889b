"""Points in processes of their own; each process solves alone."""

from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from select import select
from typing import TypeVar

from fem_seal.errors import Inconsistent
from fem_seal.memory import memory_of
from fem_seal.worker import Worker, record_peak

Item = TypeVar("Item")
T = TypeVar("T")

POLL = 0.5  # time between two polls of the points [s]


def farm(
    items: Sequence[Item],
    compute: Callable[[Item], T],
    jobs: int,
    poll: Callable[[], object],
) -> tuple[list[T], list[Item]]:
    """Compute items in processes of this machine.

    `compute` is a function of a module, and `poll` is called every half second and after each item.

    Returns the answers of `compute`, in the order in which they came, and the items whose process
    was killed. The first error that `compute` raises in any process ends the others.
    """
    idle: list[Worker] = []
    running: dict[Worker, Item] = {}
    waiting, answers, killed = deque(items), list[T](), list[Item]()
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                if worker := _begun(partial(compute, waiting[0]), idle):
                    running[worker] = waiting.popleft()
            poll()
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
