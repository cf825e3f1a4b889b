"""The residual continued into the gap: what the preconditioner should see beyond the free set."""

import numpy as np

from fem_seal.contact.blocks import row_blocks


class Extension:
    """E = (F + G N)², and its transpose, on periodic grids.

    F and G mask the free points and the others, N is the mean of the four neighbours. E leaves the
    free points as they are and continues them two samples deep. The inverse of the half-space
    restricted to the free set is the stiffness applied to that continuation of a displacement which
    leaves no pressure outside; cut off at the edge instead, the stiffness sees a jump. Between
    E and its transpose the stiffness stays symmetric, as conjugate gradients need it.

    Parameters
    ----------
    free : (nx, ny) float, 1 at free points, 0 elsewhere
        Kept, not copied; `update` takes note of what has changed in it.
    """

    def __init__(self, free: np.ndarray):
        self.free = free
        self.outside = np.empty_like(free)
        self.scratch = np.empty_like(free)

    def update(self) -> None:
        """Read the free set anew."""
        for rows in row_blocks(self.free.shape):
            outside = self.outside[rows]
            np.subtract(1, self.free[rows], out=outside)
            # The quarter belongs to the mean of four neighbours.
            outside *= 0.25

    def extend(self, residual: np.ndarray, out: np.ndarray) -> None:
        """Write E residual into `out`; the residual is zero outside the free set."""
        for values, into in ((residual, self.scratch), (self.scratch, out)):
            for rows in row_blocks(self.free.shape):
                around = _neighbours(values, rows)
                around *= self.outside[rows]
                np.add(around, residual[rows], out=into[rows])

    def gather(self, values: np.ndarray) -> None:
        """Turn `values` into Eᵀ values, in place; outside the free set they lose their meaning."""
        for _ in range(2):
            for rows in row_blocks(self.free.shape):
                np.multiply(self.outside[rows], values[rows], out=self.scratch[rows])
            for rows in row_blocks(self.free.shape):
                values[rows] *= self.free[rows]
                values[rows] += _neighbours(self.scratch, rows)


def _neighbours(values: np.ndarray, rows: slice) -> np.ndarray:
    """Sum of the four periodic neighbours of some rows (new array)."""
    last = len(values)
    if rows.start == 0 or rows.stop == last:
        indices = np.arange(rows.start, rows.stop)
        around = values.take(indices - 1, axis=0, mode="wrap")
        around += values.take(indices + 1, axis=0, mode="wrap")
    else:
        around = values[rows.start - 1 : rows.stop - 1] + values[rows.start + 1 : rows.stop + 1]
    here = values[rows]
    around[:, 1:] += here[:, :-1]
    around[:, :-1] += here[:, 1:]
    around[:, 0] += here[:, -1]
    around[:, -1] += here[:, 0]
    return around
