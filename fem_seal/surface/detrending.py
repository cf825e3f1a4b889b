"""Subtraction of a polynomial trend from a measured map: its height, its tilt, its curvature."""

import numpy as np
from numpy.polynomial.legendre import legvander

from fem_seal.arguments import choose
from fem_seal.errors import InvalidInput
from fem_seal.field_file.recorded import FieldMap
from fem_seal.grid import GridField

# Degree of the polynomial in x and y together.
DEGREES = {"mean": 0, "plane": 1, "quadratic": 2}
TREND_ROUNDING = 1e-13  # rounding error of a fitted trend, as a part of the largest height


def detrended(heights: FieldMap | GridField, trend: str) -> FieldMap:
    """Subtract the polynomial of least squares that fits the measured points best.

    The trend is "mean", "plane" or "quadratic" (all terms up to x², xy and y²). Missing points stay
    missing and do not count.
    """
    degree = choose(DEGREES, trend, "detrend")
    if heights.periodic and degree > 0:
        raise InvalidInput(
            f"the map repeats, and would have a jump at its seam without its {trend} trend; set "
            "detrend = 'mean', or leave it out"
        )
    measured = ~np.isnan(heights.values)
    if not measured.any():
        raise InvalidInput(f"all {measured.size} points are missing")
    values = heights.values - _polynomial(heights.values, measured, degree)
    # What is left of a flat or tilted plane is rounding, and no roughness that could be pressed.
    if np.nanmax(np.abs(values)) < TREND_ROUNDING * np.nanmax(np.abs(heights.values)):
        values = np.where(measured, 0.0, np.nan)
    return FieldMap(values, heights.spacing, heights.periodic)


def _polynomial(values: np.ndarray, measured: np.ndarray, degree: int) -> np.ndarray:
    """Fit Σ c_ab P_a(x) P_b(y), a + b <= degree, with Legendre polynomials on [-1, 1]²."""
    # The basis is a product, so that the normal equations need no array beyond the map's own.
    X, Y = (legvander(np.linspace(-1, 1, n), degree) for n in values.shape)
    terms = [(a, b) for a in range(degree + 1) for b in range(degree + 1 - a)]
    heights = np.where(measured, values, 0.0)
    weight = measured.astype(float)
    normal = np.array(
        [[(X[:, a] * X[:, c]) @ weight @ (Y[:, b] * Y[:, d]) for c, d in terms] for a, b in terms]
    )
    right = np.array([X[:, a] @ heights @ Y[:, b] for a, b in terms])
    coefficients = np.linalg.lstsq(normal, right, rcond=None)[0]
    return sum(
        c * np.outer(X[:, a], Y[:, b]) for c, (a, b) in zip(coefficients, terms, strict=True)
    )
