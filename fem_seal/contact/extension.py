"""Extension of the residual beyond the free set, for the preconditioner Eᵀ M E of `free_set_cg`."""

import numpy as np

from fem_seal.contact.blocks import RowPasses
from fem_seal.contact.halving import WHOLE, Halving

# Number of coarser grids, each with a quarter of the samples. With one fewer, 1024² takes one or
# two iterations more.
LEVELS = 6
# Decay of the extension: a cell of which a fraction s is free gets the weight s / (s + FADE (1 -
# s)), which is s for FADE = 1, and 1 for FADE = 0. Measured at 256² to 1024²: 0.7 and 1 take one
# more iteration at some loads, 0.25 and 2 at all loads.
FADE = 0.85


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
        self.levels: list[_Level] = []
        nx, ny = free.shape
        while len(self.levels) < LEVELS and max(nx, ny) > 1:
            self.levels.append(_Level((nx, ny), free.dtype, passes))
            nx, ny = self.levels[-1].values.shape

    def update(self) -> None:
        """Recompute all weights from the free set."""
        fraction = self.free
        for level in self.levels:
            fraction = level.update(fraction)

    def extend(self, residual: np.ndarray, out: np.ndarray) -> None:
        """Write E residual into `out`; the residual is zero outside the free set."""
        means = residual
        for level in self.levels:
            level.halving.restrict(means, level.values)
            level.values *= level.scale
            means = level.values
        for level, finer in zip(self.levels[:0:-1], self.levels[-2::-1], strict=True):
            level.halving.interpolate(level.values, finer.values, finer.values, level.outside)
        finest = self.levels[0]
        finest.halving.interpolate(finest.values, residual, out, finest.outside)

    def gather(self, values: np.ndarray) -> None:
        """Replace `values` by Eᵀ values; only the entries on the free set are meaningful."""
        fine = values
        for level in self.levels:
            level.halving.restrict(fine, level.values, level.outside)
            fine = level.values
        for level, finer in zip(self.levels[:0:-1], self.levels[-2::-1], strict=True):
            level.values *= level.scale
            level.halving.interpolate(level.values, finer.values, finer.values, None)
        finest = self.levels[0]
        finest.values *= finest.scale
        finest.halving.interpolate(finest.values, values, values, None)


class _Level:
    """A grid and the next coarser one.

    `outside` is the fraction of each point that is not free; `values` and `scale`, on the coarser
    grid, are a work array and the weights of the means.
    """

    def __init__(self, shape: tuple[int, int], dtype: np.dtype, passes: RowPasses):
        self.halving = Halving(shape, passes)
        self.outside = np.empty(shape, dtype)
        self.values = np.empty(self.halving.coarse, dtype)
        self.scale = np.empty_like(self.values)

    def update(self, fraction: np.ndarray) -> np.ndarray:
        """Take the free fractions of the finer grid; return those of the coarser one (a view)."""
        self.halving.restrict(fraction, self.values)

        def fill(rows: slice) -> None:
            """Write the weights of the samples outside the free set."""
            np.subtract(1, fraction[rows], out=self.outside[rows])
            self.outside[rows] /= WHOLE

        def weigh(rows: slice) -> None:
            """Write the weights of the means, and turn sums into free fractions."""
            values, scale = self.values[rows], self.scale[rows]
            # The restriction of ones is 4 WHOLE: s + FADE (1 - s) in units of it.
            np.multiply(values, 1 - FADE, out=scale)
            scale += 4 * WHOLE * FADE
            np.reciprocal(scale, out=scale)
            values *= scale

        passes = self.halving.passes
        passes.over(self.outside.shape, fill)
        passes.over(self.values.shape, weigh)
        return self.values
