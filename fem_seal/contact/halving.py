"""Linear interpolation from a periodic grid of cells of twice the size, and its transpose."""

import numpy as np

from fem_seal.contact.blocks import row_blocks

# What a value of 1 everywhere is restricted to, over four; and what it is interpolated to.
WHOLE = 16


class Halving:
    """Between a grid and one of half the samples along each axis.

    Interpolation is linear between the cells' middles: along each axis a point takes 3 of its own
    cell and 1 of the nearer neighbour, so that the values come out 16 times as large; the callers
    put that into their weights. Restriction is the transpose. Where the number of samples is odd
    the last cell is half empty.

    Parameters
    ----------
    shape : (nx, ny)
        Of the finer grid.
    """

    def __init__(self, shape: tuple[int, int]):
        self.shape = shape
        self.coarse = (shape[0] + 1) // 2, (shape[1] + 1) // 2

    def restrict(
        self, fine: np.ndarray, out: np.ndarray, weights: np.ndarray | None = None
    ) -> None:
        """Write the restriction of `fine`, times `weights` of its shape if given, into `out`."""
        for rows in row_blocks(self.coarse):
            first, last = 2 * rows.start - 1, 2 * rows.stop + 1
            block = _rows(fine, first, last, 2 * self.coarse[0])
            if weights is not None:
                block = block * _rows(weights, first, last, 2 * self.coarse[0])
            halved = block[1:-1:2] + block[2:-1:2]
            halved *= 3
            halved += block[0:-2:2]
            halved += block[3::2]
            _halve_columns(halved, out[rows])

    def interpolate(
        self, coarse: np.ndarray, base: np.ndarray, out: np.ndarray, weights: np.ndarray | None
    ) -> None:
        """Write base + weights × interpolation of `coarse` into `out`; no weights: ones."""
        for rows in row_blocks(self.coarse):
            wide = _double_columns(
                _rows(coarse, rows.start - 1, rows.stop + 1, len(coarse)), self.shape[1]
            )
            fine = np.empty((2 * (rows.stop - rows.start), self.shape[1]), coarse.dtype)
            own = 3 * wide[1:-1]
            np.add(own, wide[:-2], out=fine[0::2])
            np.add(own, wide[2:], out=fine[1::2])
            here = slice(2 * rows.start, min(2 * rows.stop, self.shape[0]))
            fine = fine[: here.stop - here.start]
            if weights is not None:
                fine *= weights[here]
            np.add(base[here], fine, out=out[here])


def _rows(values: np.ndarray, first: int, last: int, period: int) -> np.ndarray:
    """Rows of an array that repeats with a period; those it does not have are zero."""
    if first >= 0 and last <= len(values):
        return values[first:last]
    rows = np.arange(first, last) % period
    block = values.take(rows, axis=0, mode="clip")
    block[rows >= len(values)] = 0
    return block


def _halve_columns(block: np.ndarray, out: np.ndarray) -> None:
    """Restriction along the second axis."""
    if block.shape[1] % 2:
        block = np.pad(block, ((0, 0), (0, 1)))
    first, second = block[:, 0::2], block[:, 1::2]
    np.add(first, second, out=out)
    out *= 3
    out[:, 1:] += second[:, :-1]
    out[:, 0] += second[:, -1]
    out[:, :-1] += first[:, 1:]
    out[:, -1] += first[:, 0]


def _double_columns(block: np.ndarray, width: int) -> np.ndarray:
    """Interpolation along the second axis to `width` points (new array)."""
    own = 3 * block
    doubled = np.empty((len(block), 2 * block.shape[1]), block.dtype)
    first, second = doubled[:, 0::2], doubled[:, 1::2]
    np.add(own[:, 1:], block[:, :-1], out=first[:, 1:])
    np.add(own[:, 0], block[:, -1], out=first[:, 0])
    np.add(own[:, :-1], block[:, 1:], out=second[:, :-1])
    np.add(own[:, -1], block[:, 0], out=second[:, -1])
    return doubled[:, :width]
