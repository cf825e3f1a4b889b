"""Initial pressure for light loads: the solution for the same surface on coarser grids."""

import numpy as np

from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.methods import ContactStopping
from fem_seal.grid import GridField

# Contact area below which a coarse start pays. Measured at 512² and 1024²: it saves a quarter of
# the CPU time at 1 % of contact, a few percent at 5 %, and nothing at 20 %, where the remaining
# error is local.
LIGHT = 0.06
COARSEST = 128  # fewest samples along a side of a coarse grid
# A more accurate coarse solution does not make a better start.
ROUGHLY = ContactStopping(tolerance=0.3, gap_tolerance=float("inf"))


def coarse_start(pair: ContactPair, mean_pressure: float) -> np.ndarray | None:
    """Pressure [Pa] of the 2 × 2 means of the heights, repeated on the fine grid.

    The coarse problem is started in the same way, recursively. None where a coarse start would not
    pay: on small or odd grids, and unless Persson's area √(8/π) p / (E* h'rms) is below `LIGHT`,
    with the slope from differences of neighbours.
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
    coarse = pair.on(GridField(means, (2 * spacing[0], 2 * spacing[1]), periodic=True))
    start = coarse_start(coarse, mean_pressure)
    state = coarse.under_pressure(mean_pressure, ROUGHLY, start)
    pair.half_space.pairs += coarse.half_space.pairs / 4
    return state.pressure.values.repeat(2, axis=0).repeat(2, axis=1)
