"""Corners of cells as unknowns: what makes functions that may jump between cells conforming.

Both problems live in the space of functions linear on each cell and free to jump between cells.
Corners with the same number are one unknown, corners without one have a prescribed value.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.mesh.grouping import parts


@dataclass(frozen=True, eq=False)
class Unknowns:
    """A numbering of the corners of C cells.

    of_corner : (C, 3) int32, unknown of each corner or -1 where the value is prescribed; unknowns
        are numbered as the cells come to meet them
    lift : (C, 3), jumps and prescribed values; unknowns add to them
    count : number of unknowns
    """

    of_corner: np.ndarray
    lift: np.ndarray
    count: int

    def corners(self, values: np.ndarray, cells: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Corner values (n, 3), on all or some cells, of the function with unknowns (count,)."""
        number, lift = self.of_corner[cells], self.lift[cells]
        if not self.count:
            return lift.astype(float)
        found = values.take(number)
        found[number < 0] = 0.0
        found += lift
        return found

    def representable(self, values: np.ndarray) -> np.ndarray:
        """Values of the unknowns (count,), rounded so that adding the jumps to them is exact.

        A function with jumps is then stored as it is, without errors that contrast could magnify.
        """
        jump = np.abs(self.lift[self.of_corner >= 0]).max(initial=0)
        if jump == 0 or jump % 1:
            return values
        grid = 2.0 ** np.ceil(np.log2(jump + np.abs(values).max(initial=1.0)) + 1)
        return (values + grid) - grid

    def constant(self) -> np.ndarray:
        """(C,) bool, cells on which every function of this numbering is constant."""
        first = self.of_corner[:, 0], self.lift[:, 0]
        others = ((self.of_corner[:, k], self.lift[:, k]) for k in (1, 2))
        same = [(number == first[0]) & (lift == first[1]) for number, lift in others]
        return same[0] & same[1]

    def from_corners(self, corner_values: np.ndarray) -> np.ndarray:
        """Values of the unknowns (count,) nearest to given corner values (C, 3)."""
        total, corners = np.zeros((2, self.count + 1))
        for k in range(3):
            # Corners without an unknown are counted into a place of their own, and left out.
            number = self.of_corner[:, k] + 1
            total += np.bincount(number, corner_values[:, k] - self.lift[:, k], self.count + 1)
            corners += np.bincount(number, minlength=self.count + 1)
        return total[1:] / corners[1:]

    def neighbours(self, sides: np.ndarray) -> np.ndarray:
        """How many unknowns (count,) share a cell with each, at most.

        Parameters
        ----------
        sides : (C, 3), number of the side opposite each corner, the same for two cells at it

        Notes
        -----
        Two for each corner, less one for each side that two cells see with the same unknowns.
        """
        last = np.empty(int(sides.max(initial=-1)) + 1, dtype=np.int32)
        last[sides.ravel()] = np.arange(sides.size, dtype=np.int32)
        found = np.zeros(self.count + 1, dtype=np.int64)
        for cells in parts(0, len(sides), 1 << 18):
            slot = np.arange(3 * cells.start, 3 * cells.stop, dtype=np.int32)
            other = last.take(sides[cells].ravel())
            shared = other != slot
            here, there = (self._ends(side.compress(shared)) for side in (slot, other))
            same = (here[0] == there[0]) & (here[1] == there[1])
            # Corners without an unknown are counted into a place of their own, and left out.
            found += 2 * np.bincount(self.of_corner[cells].ravel() + 1, minlength=self.count + 1)
            for end in here:
                found -= np.bincount(end.compress(same) + 1, minlength=self.count + 1)
        return found[1:]

    def _ends(self, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unknowns (n,) at the ends of sides, given as 3 cell + side: the lower and the higher."""
        side, of_slot = sides % 3, self.of_corner.ravel()
        following = of_slot.take(sides + np.where(side == 2, -2, 1))
        preceding = of_slot.take(sides + np.where(side == 0, 2, -1))
        return np.minimum(following, preceding), np.maximum(following, preceding)


def numbered(label: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, int]:
    """Number what the corners of some cells belong to.

    Cells that are near each other in the mesh are near each other in its array, and so will be
    the unknowns in memory.

    Parameters
    ----------
    label : (C, 3) int, of each corner; free : (labels,) bool, whether it is an unknown

    Returns
    -------
    (C, 3) int32, consecutive numbers of free labels as the cells come to meet them, -1 of others;
    and how many there are
    """
    met = label.ravel()
    last = len(met)
    met_at = np.full(len(free), last, dtype=np.int32)
    # Written backwards, what stays is the first place.
    met_at[met[::-1]] = np.arange(last - 1, -1, -1, dtype=np.int32)
    met_at[~free] = last
    new = np.zeros(last + 1, dtype=bool)
    new[met_at] = True
    number = np.cumsum(new[:-1], dtype=np.int32)
    used = int(number[-1]) if last else 0
    of_label = np.append(number - np.int32(1), np.int32(-1))[met_at]
    return of_label[label], used
