"""Continuation of the residual beyond the free set, for the preconditioner."""

import numpy as np

from fem_seal.contact.halving import WHOLE, Halving

# Coarser grids, each of a quarter of the samples. One fewer costs an iteration or two at 1024².
LEVELS = 6
# How fast the continuation fades: where a share s of a cell is free, the cell's value is weighted
# s / (s + FADE (1 - s)). At 1 that is s itself, at 0 it would not fade at all. Measured at 256² to
# 1024²: 0.7 and 1 are an iteration worse at one load or another, 0.25 and 2 at all.
FADE = 0.85


class Extension:
    """E: values on the free set continued over the other points, and its transpose.

    The inverse of the half-space restricted to the free set is the stiffness applied to that
    continuation of a displacement which leaves no pressure outside: smooth, and fading with the
    distance. Cut off at the edge instead, the stiffness sees a jump. E leaves the free points as
    they are and fills the others from coarser grids, where cells hold the weighted means of the
    free values in and around them and are filled from the next coarser grid as far as they are
    not free. Between E and its transpose the stiffness stays symmetric, as conjugate gradients
    need it.

    Parameters
    ----------
    free : (nx, ny) float, 1 at free points, 0 elsewhere
        Kept, not copied; `update` takes note of what has changed in it.
    """

    def __init__(self, free: np.ndarray):
        self.free = free
        self.levels: list[_Level] = []
        shape = free.shape
        while len(self.levels) < LEVELS and max(shape) > 1:
            self.levels.append(_Level(shape, free.dtype))
            shape = self.levels[-1].values.shape

    def update(self) -> None:
        """Read the free set anew."""
        share = self.free
        for level in self.levels:
            share = level.update(share)

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
        """Turn `values` into Eᵀ values, in place; outside the free set they lose their meaning."""
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

    outside : (nx, ny), the share of each point that is not free
    values, scale : on the coarser grid, work array and weights of the means
    """

    def __init__(self, shape: tuple[int, int], dtype: np.dtype):
        self.halving = Halving(shape)
        self.outside = np.empty(shape, dtype)
        self.values = np.empty(self.halving.coarse, dtype)
        self.scale = np.empty_like(self.values)

    def update(self, share: np.ndarray) -> np.ndarray:
        """Read the free share of the finer grid's points; return the coarser grid's (a view)."""
        np.subtract(1, share, out=self.outside)
        self.outside /= WHOLE
        self.halving.restrict(share, self.values)
        # A quarter of a whole restriction: four points are one cell.
        np.multiply(self.values, 1 - FADE, out=self.scale)
        self.scale += 4 * WHOLE * FADE
        np.reciprocal(self.scale, out=self.scale)
        self.values *= self.scale
        return self.values
