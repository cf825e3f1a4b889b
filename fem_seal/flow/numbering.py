"""Numberings: corners of cells that share an unknown, which makes the functions conforming.

The functions of both problems are linear on each cell and may jump between cells. A numbering
makes corners one unknown, and prescribes the value of corners without one:

    v at a corner = offset + value of its unknown
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array

from fem_seal.errors import Inconsistent


@dataclass(frozen=True, eq=False)
class Numbering:
    """A numbering of the corners of C cells: v = offset + value of the unknown of the corner."""

    #: (C, 3) int32, unknown of each corner, or -1 where the value is prescribed. Unknowns are
    #: numbered in the order in which the cells first use them
    of_corner: np.ndarray
    offset: np.ndarray  #: (C, 3), prescribed values, and jumps that are added to the unknowns
    count: int  #: number of unknowns

    def __post_init__(self) -> None:
        last = self.of_corner.max(initial=-1)
        if self.of_corner.shape != self.offset.shape or last >= self.count:
            raise Inconsistent(f"{self.count} unknowns, and corners of {last + 1}")

    def corners(self, values: np.ndarray, cells: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Corner values (n, 3), on all or given cells, of the function with `values` (count,)."""
        number, offset = self.of_corner[cells], self.offset[cells]
        if not self.count:
            return offset.astype(float)
        corner_values = values.take(number)
        corner_values[number < 0] = 0.0
        corner_values += offset
        return corner_values

    def representable(self, values: np.ndarray) -> np.ndarray:
        """Values of the unknowns (count,), rounded so that adding the jumps to them is exact.

        The function is then stored exactly, without rounding errors that a high contrast would
        magnify.
        """
        jump = np.abs(self.offset[self.of_corner >= 0]).max(initial=0)
        if jump == 0:
            return values
        grid = 2.0 ** np.ceil(np.log2(jump + np.abs(values).max(initial=1.0)) + 1)
        return (values + grid) - grid

    def constant(self) -> np.ndarray:
        """(C,) bool, cells on which every function of this numbering is constant."""
        first = self.of_corner[:, :1], self.offset[:, :1]
        return ((self.of_corner == first[0]) & (self.offset == first[1])).all(axis=1)

    def from_corners(self, corner_values: np.ndarray) -> np.ndarray:
        """Values of the unknowns (count,): means over their corners of corner_values - offset."""
        total, corners = np.zeros((2, self.count + 1))
        for k in range(3):
            # Corners without an unknown are summed in entry 0, which is dropped.
            number = self.of_corner[:, k] + 1
            total += np.bincount(number, corner_values[:, k] - self.offset[:, k], self.count + 1)
            corners += np.bincount(number, minlength=self.count + 1)
        return total[1:] / corners[1:]

    def neighbours(self) -> np.ndarray:
        """Number (count,) of other unknowns that share a cell with each unknown."""
        ends = self.of_corner.ravel(), self.of_corner[:, [1, 2, 0]].ravel()
        links = (ends[0] >= 0) & (ends[1] >= 0) & (ends[0] != ends[1])
        pairs = tuple(end.compress(links) for end in ends)
        graph = coo_array((np.ones(len(pairs[0]), bool), pairs), (self.count, self.count)).tocsr()
        return np.diff((graph + graph.T).indptr)


@dataclass(frozen=True, eq=False)
class Jumps:
    """Functions that jump by J across d lines: v = unknown of the corner + J·n, with a basis of J.

    Where a corner has no unknown, v = J·n is prescribed.
    """

    of_corner: np.ndarray  #: as of `Numbering`
    count: int  #: number of unknowns
    crossed: np.ndarray  #: (C, 3, d), number n of lines crossed at each corner
    basis: np.ndarray  #: (k, d), basis of the jumps J that are possible; k = 0 if none is

    @property
    def numberings(self) -> list[Numbering]:
        """Numbering for each jump of the basis."""
        return [Numbering(self.of_corner, self.crossed @ J, self.count) for J in self.basis]


def numbered(label: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, int]:
    """Number (C, 3) int32 of each corner's label, -1 if it is not free, and the number of unknowns.

    The numbers follow the order in which the cells first use the labels. Cells that are near each
    other in the mesh are near each other in its array; so are their unknowns in memory.
    """
    met = label.ravel()
    last = len(met)
    met_at = np.full(len(free), last, dtype=np.int32)
    # Assign in reverse order, so that the first occurrence wins.
    met_at[met[::-1]] = np.arange(last - 1, -1, -1, dtype=np.int32)
    met_at[~free] = last
    new = np.zeros(last + 1, dtype=bool)
    new[met_at] = True
    number = np.cumsum(new[:-1], dtype=np.int32)
    used = int(number[-1]) if last else 0
    of_label = np.append(number - np.int32(1), np.int32(-1))[met_at]
    return of_label[label], used
