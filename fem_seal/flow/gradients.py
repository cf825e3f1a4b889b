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
    opposite = x[:, [2, 0, 1]] - x[:, [1, 2, 0]]
    twice = opposite[:, 0, 0] * opposite[:, 1, 1] - opposite[:, 0, 1] * opposite[:, 1, 0]
    turned = np.stack([-opposite[..., 1], opposite[..., 0]], axis=-1)
    return turned / twice[:, None, None], np.abs(twice) / 2


def gradients(slopes: np.ndarray, corner_values: np.ndarray) -> np.ndarray:
    """Gradients (n, 2) of linear functions, from those of the barycentric coordinates (n, 3, 2).

    From differences of the corner values (n, 3): the same added to all is not even rounded.
    """
    return np.einsum("cid,ci->cd", slopes[:, 1:], corner_values[:, 1:] - corner_values[:, :1])
