"""Extension of the residual beyond the free set, for the preconditioner Eᵀ M E of `free_set_cg`.

It interpolates linearly between periodic grids, each with half as many samples along both axes as
the last. Along each axis a fine point lies at a quarter of the distance between the centres of its
own coarse cell and of the nearer neighbouring cell:

    interpolation   u_fine = 3 u_own + u_neighbour       (16 times the value, over two axes)
    restriction     the transpose of the interpolation

Neither is normalised: the weights include the factor 16.
"""

import numpy as np

from fem_seal.contact.blocks import RowPasses

# Number of coarser grids, each with a quarter of the samples. With one fewer, 1024² takes one or
# two iterations more.
GRIDS = 6
# Decay of the extension: a cell of which a fraction s is free gets the weight s / (s + FADE (1 -
# s)), which is s for FADE = 1, and 1 for FADE = 0. Measured at 256² to 1024²: 0.7 and 1 take one
# more iteration at some loads, 0.25 and 2 at all loads.
FADE = 0.85
WHOLE = 16  # interpolation of ones; the restriction of ones is 4 × 16


class Extension:
    """The extension E of values on the free set to the whole grid, and its transpose.

    Let u be a displacement on the free set. The pressure on the free set that causes it is the
    stiffness M applied to a displacement of the whole grid: the one that equals u on the free set
    and needs no pressure outside. That displacement is smooth and decays with the distance. If u
    were set to zero outside, M would act on a jump at the edge.

    E approximates it. Free points keep their values. The other points are interpolated from coarser
    grids, whose cells hold weighted means of the free values in and around them, mixed with the
    next coarser grid by the fraction of the cell that is not free. Eᵀ M E is symmetric, as
    conjugate gradients require.

    `free` (nx, ny) is 1 at free points, 0 elsewhere. It is not copied: call `update` after changing
    it.
    """

    def __init__(self, free: np.ndarray, passes: RowPasses | None = None):
        self.free = free
        passes = passes or RowPasses()
        self.pairs: list[_GridPair] = []
        nx, ny = free.shape
        while len(self.pairs) < GRIDS and max(nx, ny) > 1:
            self.pairs.append(_GridPair((nx, ny), free.dtype, passes))
            nx, ny = self.pairs[-1].values.shape
        self.update()

    def update(self) -> None:
        """Recompute all weights from the free set."""
        fraction = self.free
        for pair in self.pairs:
            fraction = pair.update(fraction)

    def extend(self, residual: np.ndarray, out: np.ndarray) -> None:
        """Write E residual into `out`; the residual is zero outside the free set."""
        means = residual
        for pair in self.pairs:
            pair.restrict(means)
            pair.values *= pair.scale
            means = pair.values
        for pair, finer in zip(self.pairs[:0:-1], self.pairs[-2::-1], strict=True):
            pair.interpolate(finer.values, finer.values, pair.outside)
        self.pairs[0].interpolate(residual, out, self.pairs[0].outside)

    def gather(self, values: np.ndarray) -> None:
        """Replace `values` by Eᵀ values; only the entries on the free set are meaningful."""
        fine = values
        for pair in self.pairs:
            pair.restrict(fine, pair.outside)
            fine = pair.values
        for pair, finer in zip(self.pairs[::-1], [*self.pairs[-2::-1], None], strict=True):
            pair.values *= pair.scale
            target = values if finer is None else finer.values
            pair.interpolate(target, target)


class _GridPair:
    """A grid and the next coarser one; of an odd number of samples the last coarse cell holds one.

    `outside` is the fraction of each point that is not free, over WHOLE; `values` and `scale`, on
    the coarser grid, are a work array and the weights of the means.
    """

    def __init__(self, shape: tuple[int, int], dtype: np.dtype, passes: RowPasses):
        self.passes, self.outside = passes, np.empty(shape, dtype)
        self.values = np.empty(((shape[0] + 1) // 2, (shape[1] + 1) // 2), dtype)
        self.scale = np.empty_like(self.values)

    def update(self, fraction: np.ndarray) -> np.ndarray:
        """Take the free fractions of the finer grid; return those of the coarser one (a view)."""
        np.subtract(1, fraction, out=self.outside)
        self.outside /= WHOLE
        self.restrict(fraction)
        # `values` are 4 WHOLE s with the free fractions s, as the restriction of ones is 4 WHOLE.
        # The weights are 1 / (4 WHOLE (s + FADE (1 - s))).
        np.multiply(self.values, 1 - FADE, out=self.scale)
        self.scale += 4 * WHOLE * FADE
        np.reciprocal(self.scale, out=self.scale)
        self.values *= self.scale
        return self.values

    def restrict(self, fine: np.ndarray, weights: np.ndarray | None = None) -> None:
        """Write the restriction of `fine`, multiplied by `weights` if not None, into `values`."""
        period = 2 * len(self.values)

        def pass_over(rows: slice) -> None:
            """Coarse rows, each from four fine ones."""
            first, last = 2 * rows.start - 1, 2 * rows.stop + 1
            block = _periodic_rows(fine, first, last, period)
            if weights is not None:
                block = block * _periodic_rows(weights, first, last, period)
            halved = block[1:-1:2] + block[2:-1:2]
            halved *= 3
            halved += block[0:-2:2]
            halved += block[3::2]
            _halve_columns(halved, self.values[rows])

        self.passes.over(self.values.shape, pass_over)

    def interpolate(
        self, base: np.ndarray, out: np.ndarray, weights: np.ndarray | None = None
    ) -> None:
        """Write base + weights × interpolation of `values` into `out`; no weights: ones."""
        coarse, (nx, ny) = self.values, self.outside.shape

        def pass_over(rows: slice) -> None:
            """Fine rows, two for each coarse one."""
            block = _periodic_rows(coarse, rows.start - 1, rows.stop + 1, len(coarse))
            wide = _double_columns(block, ny)
            fine = np.empty((2 * (rows.stop - rows.start), ny), coarse.dtype)
            own = 3 * wide[1:-1]
            np.add(own, wide[:-2], out=fine[0::2])
            np.add(own, wide[2:], out=fine[1::2])
            fine_rows = slice(2 * rows.start, min(2 * rows.stop, nx))
            fine = fine[: fine_rows.stop - fine_rows.start]
            if weights is not None:
                fine *= weights[fine_rows]
            np.add(base[fine_rows], fine, out=out[fine_rows])

        self.passes.over(coarse.shape, pass_over)


def _periodic_rows(values: np.ndarray, first: int, last: int, period: int) -> np.ndarray:
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
