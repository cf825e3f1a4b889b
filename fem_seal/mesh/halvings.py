"""The cells of a mesh that were halved, and how values on the cells are carried to the halves."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Halvings:
    """How C cells (a, b, c) became C' cells by halving, step by step.

    While the cells are halved, a first half (m, a, b) takes the number of its parent, and a second
    half (m, c, a) gets a new number after those of all cells before it.
    """

    #: ((n,), (n,)) int, for each step the cells that were halved, and the numbers of
    #: their second halves
    steps: tuple[tuple[np.ndarray, np.ndarray], ...]
    #: (C',) int32, for each cell of the new mesh its number while halving. In the new mesh the
    #: parts of a cell take its place, so that neighbours in the mesh are neighbours in memory
    order: np.ndarray
    parent: np.ndarray  #: (C',) int32, for each cell of the new mesh the old cell that contains it

    @classmethod
    def of(cls, steps: Sequence[tuple[np.ndarray, np.ndarray]], count: int) -> "Halvings":
        """Order the parts of `count` cells after all steps."""
        total = count + sum(len(second) for _, second in steps)
        # Number of parts of each cell. The second loop reduces it, step by step, to the number of
        # parts of its first half.
        size = np.ones(total, dtype=np.int32)
        for cut, second in reversed(steps):
            size[cut] += size[second]
        place = np.empty(total, dtype=np.int32)
        place[:count] = np.cumsum(size[:count]) - size[:count]
        parent = np.repeat(np.arange(count, dtype=np.int32), size[:count])
        for cut, second in steps:
            size[cut] -= size[second]
            place[second] = place[cut] + size[cut]
        order = np.empty(total, dtype=np.int32)
        order[place] = np.arange(total, dtype=np.int32)
        return cls(tuple(steps), order, parent)

    def carried(
        self,
        values: np.ndarray,
        halves: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    ) -> np.ndarray:
        """Carry values (C, ...) of the old cells to the new ones, (C', ...).

        `halves` maps values (n, ...) of cells to those of their first and of their second halves.
        """
        carried = np.empty((len(self.order), *values.shape[1:]), dtype=values.dtype)
        carried[: len(values)] = values
        for cut, second in self.steps:
            carried[cut], carried[second] = halves(carried.take(cut, axis=0))
        return carried.take(self.order, axis=0)
