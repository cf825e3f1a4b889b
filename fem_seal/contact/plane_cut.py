"""The bearing model: the gap of an undeformed surface cut by a plane."""

import numpy as np

from fem_seal.contact.settings import one_load
from fem_seal.contact.state import BearingState
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField

GAP_ROUNDING = 1e-4  # largest relative error of a prescribed mean gap, by rounding


def bearing(
    height: GridField, *, area_fraction: float | None = None, mean_gap: float | None = None
) -> BearingState:
    """Cut the surface: gap = max(0, h_free - Δ), with h_free the gap at first touch.

    Exactly one of the two prescribes the plane.

    Parameters
    ----------
    height
        Heights [m] of the counter-face; its highest points touch first.
    area_fraction
        Contact area fraction in [0, 1), reached to half a sample (more where heights are equal:
        they touch together); the highest point always touches.
    mean_gap
        [m], > 0.

    Raises
    ------
    InvalidInput
        If the rounding of the heights changes so small a mean gap by more than 1 part in 10 000.
    """
    load, heights = one_load(area_fraction=area_fraction, mean_gap=mean_gap), height.values
    if load.kind == "area_fraction":
        touching = max(1, round(load.value * heights.size))
        plane = np.partition(heights, heights.size - touching, axis=None)[-touching]
    else:
        plane = plane_at_mean_gap(heights, load.value)
    gap = GridField(np.maximum(plane - heights, 0), height.spacing, height.periodic)
    if load.kind == "mean_gap" and not abs(gap.values.mean() / load.value - 1) <= GAP_ROUNDING:
        raise InvalidInput(
            f"mean_gap = {load.value:g} m is lost in the rounding of heights from "
            f"{heights.min():.3g} to {heights.max():.3g} m; ask for a larger one"
        )
    return BearingState(gap, shift=float(heights.max() - plane))


def plane_at_mean_gap(heights: np.ndarray, mean_gap: float) -> float:
    """Height of the plane at which the mean of max(0, plane - h) is the mean gap.

    This mean is convex, increasing and piecewise linear in the height of the plane, and at least
    plane - <h>: Newton's method from above reaches the solution exactly. NaN if a height is.
    """
    plane = heights.mean() + mean_gap
    while True:
        gap = np.maximum(plane - heights, 0)
        opened = np.mean(gap > 0)  # 0 where rounding leaves no gap
        lower = plane - (gap.mean() - mean_gap) / opened if opened else plane
        if not lower < plane:
            return plane
        plane = lower
