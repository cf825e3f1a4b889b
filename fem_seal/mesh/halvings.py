"""Which cells of a mesh were halved, and how values on the cells follow."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Halvings:
    """What became of C cells (a, b, c) that were halved step by step: C' of them.

    steps : of each the cells that give place to their first halves (middle, a, b), and the numbers
        of their second halves (middle, c, a), which follow those of all cells before
    order : (C',) int32, numbers of the cells as they stand in the new mesh: in place of their
        parents, so that what is near in the mesh is near in memory
    parent : (C',) int32, the old cell each new cell lies in
    """

    steps: tuple[tuple[np.ndarray, np.ndarray], ...]
    order: np.ndarray
    parent: np.ndarray

    @classmethod
    def of(cls, steps: Sequence[tuple[np.ndarray, np.ndarray]], count: int) -> "Halvings":
        """Put the halves of `count` cells in order."""
        total = count + sum(len(second) for _, second in steps)
        # How many cells each one becomes, and then, step by step, how many its first half does.
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
        """Values (C, ...) of the old cells as values (C', ...) of the new ones.

        halves : makes of the values (n, ...) of some cells those of their halves
        """
        carried = np.empty((len(self.order), *values.shape[1:]), dtype=values.dtype)
        carried[: len(values)] = values
        for cut, second in self.steps:
            carried[cut], carried[second] = halves(carried.take(cut, axis=0))
        return carried.take(self.order, axis=0)
