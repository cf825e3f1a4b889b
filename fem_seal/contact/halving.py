"""Linear interpolation from a periodic grid of twice the spacing, and its transpose.

Along each axis a fine point lies at a quarter of the distance between the centres of its own
coarse cell and of the nearer neighbouring cell:

    interpolation   u_fine = 3 u_own + u_neighbour       (16 times the value, over two axes)
    restriction     the transpose of the interpolation
"""

import numpy as np

from fem_seal.contact.blocks import RowPasses

WHOLE = 16  # interpolation of ones; the restriction of ones is 4 × 16


class Halving:
    """Transfer between a grid and the one with half as many samples along each axis.

    Neither operation is normalised: callers include the factor 16 in their weights. Where the
    number of samples is odd, the last coarse cell contains a single row or column.
    """

    def __init__(self, shape: tuple[int, int], passes: RowPasses | None = None):
        self.shape, self.passes = shape, passes or RowPasses()
        self.coarse = (shape[0] + 1) // 2, (shape[1] + 1) // 2

    def restrict(
        self, fine: np.ndarray, out: np.ndarray, weights: np.ndarray | None = None
    ) -> None:
        """Write the restriction of `fine`, multiplied by `weights` if not None, into `out`."""

        def pass_over(rows: slice) -> None:
            """Coarse rows, each from four fine ones."""
            first, last = 2 * rows.start - 1, 2 * rows.stop + 1
            block = _rows(fine, first, last, 2 * self.coarse[0])
            if weights is not None:
                block = block * _rows(weights, first, last, 2 * self.coarse[0])
            halved = block[1:-1:2] + block[2:-1:2]
            halved *= 3
            halved += block[0:-2:2]
            halved += block[3::2]
            _halve_columns(halved, out[rows])

        self.passes.over(self.coarse, pass_over)

    def interpolate(
        self, coarse: np.ndarray, base: np.ndarray, out: np.ndarray, weights: np.ndarray | None
    ) -> None:
        """Write base + weights × interpolation of `coarse` into `out`; no weights: ones."""

        def pass_over(rows: slice) -> None:
            """Fine rows, two for each coarse one."""
            wide = _double_columns(
                _rows(coarse, rows.start - 1, rows.stop + 1, len(coarse)), self.shape[1]
            )
            fine = np.empty((2 * (rows.stop - rows.start), self.shape[1]), coarse.dtype)
            own = 3 * wide[1:-1]
            np.add(own, wide[:-2], out=fine[0::2])
            np.add(own, wide[2:], out=fine[1::2])
            fine_rows = slice(2 * rows.start, min(2 * rows.stop, self.shape[0]))
            fine = fine[: fine_rows.stop - fine_rows.start]
            if weights is not None:
                fine *= weights[fine_rows]
            np.add(base[fine_rows], fine, out=out[fine_rows])

        self.passes.over(self.coarse, pass_over)


def _rows(values: np.ndarray, first: int, last: int, period: int) -> np.ndarray:
    """Rows of a periodic array; rows between its length and the period are zero."""
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
