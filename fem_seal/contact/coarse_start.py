"""A start for light loads: the pressure of the same surface on coarser grids."""

import numpy as np

from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.methods import Stopping
from fem_seal.grid import GridField

# Measured at 512² and 1024²: at 1 % of contact a coarse start saves a quarter of the CPU time, at
# 5 % a few percent, at 20 % nothing: what is left is local.
LIGHT = 0.06
COARSEST = 128
# A better coarse solution makes no better start.
ROUGHLY = Stopping(tolerance=0.3, gap_tolerance=float("inf"))


def coarse_start(pair: ContactPair, mean_pressure: float) -> np.ndarray | None:
    """Pressure [Pa] on a grid of 2 x 2 means, repeated; None where it would not pay.

    Contact is taken for light where Persson's √(8/π) p / (E* h'rms) is small, with the slope
    from differences of neighbours. The coarser grid is started in the same way.
    """
    heights, spacing = pair.height.values, pair.height.spacing
    nx, ny = heights.shape
    if min(nx, ny) < 2 * COARSEST or nx % 2 or ny % 2:
        return None
    squares = [np.mean(np.diff(heights, axis=axis) ** 2) / spacing[axis] ** 2 for axis in (0, 1)]
    slope = float(sum(squares)) ** 0.5
    if (8 / np.pi) ** 0.5 * mean_pressure >= LIGHT * pair.contact_modulus * slope:
        return None
    means = heights.reshape(nx // 2, 2, ny // 2, 2).mean(axis=(1, 3))
    coarse = pair.on(GridField(means, tuple(2 * d for d in spacing), periodic=True))
    start = coarse_start(coarse, mean_pressure)
    state = coarse.under_pressure(mean_pressure, ROUGHLY, start)
    pair.half_space.pairs += coarse.half_space.pairs / 4
    return state.pressure.values.repeat(2, axis=0).repeat(2, axis=1)
