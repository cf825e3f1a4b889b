"""Slope of a gap: Reynolds' equation requires slopes well below one."""

import numpy as np

from fem_seal.grid import GridField


def slope_between_samples(gap: GridField) -> float:
    """Root mean square gradient of a gap by the differences of neighbouring samples.

    Parameters
    ----------
    gap : gap [m]
    """
    vertices = gap.vertices()
    return float(
        sum(
            np.mean((np.diff(vertices, axis=axis) / step) ** 2)
            for axis, step in enumerate(gap.spacing)
            if vertices.shape[axis] > 1
        )
        ** 0.5
    )
