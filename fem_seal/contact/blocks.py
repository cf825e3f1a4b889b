"""Passes over large arrays in blocks of rows that fit into the processor's cache."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from typing import TypeVar

import numpy as np

from fem_seal.memory import slices

T = TypeVar("T")
Item = TypeVar("Item")

# 256 kB of float64: numpy's temporaries then never reach the main memory.
BLOCK_SAMPLES = 2**15
# A block takes 20 µs, and to give a task to a thread takes as long: a sixteenth of the task's work.
STRIP = 16


def row_blocks(shape: tuple[int, ...]) -> list[slice]:
    """Slices of whole rows, of about 32768 samples each."""
    return list(slices(0, shape[0], max(1, BLOCK_SAMPLES // shape[1])))


def product(one: np.ndarray, other: np.ndarray) -> float:
    """Sum of the products of two blocks; einsum, unlike vdot, does not copy padded rows."""
    return float(np.einsum("ij,ij->", one, other))


class RowPasses:
    """Passes over arrays, block by block, in one thread or several.

    numpy computes without Python's lock: threads save time if a block is large. The blocks depend
    on the shape only and their answers come in order: sums over them have the same digits for every
    number of threads. A thread takes `STRIP` blocks at a time. The threads end with the object.
    """

    def __init__(self, threads: int = 1):
        self.threads = threads
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None

    def over(self, shape: tuple[int, ...], work: Callable[[slice], T]) -> list[T]:
        """Call `work` for every block of rows of a shape; return its answers in order."""
        return self.each(row_blocks(shape), work, STRIP)

    def product(self, one: np.ndarray, other: np.ndarray) -> float:
        """Sum of the products of two arrays."""
        return sum(self.over(one.shape, lambda rows: product(one[rows], other[rows])))

    def each(self, items: Sequence[Item], work: Callable[[Item], T], strip: int = 1) -> list[T]:
        """Call `work` for every item, `strip` of them in one task of a thread."""
        if self._pool is None or len(items) <= strip:
            return [work(item) for item in items]
        tasks = [items[first : first + strip] for first in range(0, len(items), strip)]
        answers = self._pool.map(lambda task: [work(item) for item in task], tasks)
        return list(chain.from_iterable(answers))
