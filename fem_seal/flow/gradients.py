"""Gradients of functions linear on triangles."""

import numpy as np


def shape_gradients(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of the barycentric coordinates and areas of triangles.

    Parameters
    ----------
    x : (C, 3, 2), corners

    Returns
    -------
    (C, 3, 2), (C,)
    """
    a, b, c = x.transpose(1, 2, 0)
    # Store component by component: NumPy loops over a last axis of length two are slow.
    slopes = np.empty((3, 2, len(x)))
    (ux, uy), (vx, vy) = c - b, a - c
    twice = ux * vy - uy * vx
    for slope, (ex, ey) in zip(slopes, ((ux, uy), (vx, vy), b - a), strict=True):
        np.divide(-ey, twice, out=slope[0])
        np.divide(ex, twice, out=slope[1])
    return slopes.transpose(2, 0, 1), np.abs(twice) / 2


def gradients(slopes: np.ndarray, corner_values: np.ndarray) -> np.ndarray:
    """Gradients (n, 2) of linear functions, from those of the barycentric coordinates (n, 3, 2).

    Uses differences of the corner values (n, 3): a common constant cancels exactly.
    """
    _, b, c = slopes.transpose(1, 2, 0)
    a, *others = corner_values.T
    return (b * (others[0] - a) + c * (others[1] - a)).T
