"""Straight segments of a spectrum, y = ln C against x = ln q.

The model is a constant below the long cut-off, a plateau that turns into a power law at the knee
x_k,

    y = constant + slope max(x - x_k, 0),

and another straight line beyond the short cut-off. The ends of the segments minimise the Bayesian
information criterion χ² + (number of parameters) ln(number of bins).
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import NotConverged

FEWEST_BINS = 5  # least number of bins of plateau and power law together
FEWEST_BEYOND = 2  # least number of bins beyond a cut-off
STRADDLING = 3  # largest number of bins that a cut-off is smeared over
# Measured spectra deviate from a power law by some 15 % of the power. Adding this to the
# statistical error keeps such deviations from passing for cut-offs. The fit of the exponent does
# not use it.
WIGGLE = 0.15
# Slope of the least steep power law; a smaller fall counts as a plateau.
LEAST_FALL = -1.0


@dataclass(frozen=True)
class Segments:
    """Division of the bins into segments.

    The bins next to `start` and `stop`, which straddle the cut-offs, belong to no segment.
    """

    start: int  #: first bin of the plateau
    knee: int  #: first bin of the power law
    stop: int  #: bin behind the power law


@dataclass(frozen=True)
class PowerLaw:
    """The fit y = constant + slope max(x - knee, 0), or constant + slope x without a knee."""

    constant: float
    slope: float
    slope_error: float  #: standard deviation of the slope
    knee: float | None  #: its position in ln q
    knee_error: float | None  #: standard deviation of the position
    misfit: float  #: χ² per degree of freedom

    def at(self, x: np.ndarray) -> np.ndarray:
        """Fitted ln C at ln q."""
        beyond = x if self.knee is None else np.maximum(x - self.knee, 0)
        return self.constant + self.slope * beyond


def best_segments(x: np.ndarray, y: np.ndarray, variance: np.ndarray) -> Segments | None:
    """Division of least χ² + (number of parameters) ln(number of bins).

    The arguments (m,) are ln q, ascending, ln C, and the variance of ln C. None if a constant
    spectrum has a smaller value.
    """
    m = len(x)
    weight = 1 / (variance + WIGGLE**2)
    sums = _Sums(x, y, weight)
    penalty = np.log(max(m, 2))  # penalty of each parameter
    # A cut-off lies in one bin or is smeared over a few by a window; each bin is a parameter.
    below = [
        min(sums.constant(0, i - n) + (1 + n) * penalty for n in range(1, STRADDLING + 1))
        for i in range(m)
    ]
    beyond = [
        min(sums.line(j + n, m) + (2 + n) * penalty for n in range(1, STRADDLING + 1))
        for j in range(m)
    ]
    below[0], beyond = 0.0, [*beyond, 0.0]
    # Start from a constant spectrum, such as that of white noise.
    least, best = sums.constant(0, m) + penalty, None
    for start in range(m):
        if 0 < start < 1 + FEWEST_BEYOND:
            continue
        for stop in range(start + FEWEST_BINS, m + 1):
            if m - FEWEST_BEYOND - 1 < stop < m:
                continue
            knees = np.arange(start, stop - FEWEST_BEYOND)
            costs = sums.broken_line(start, knees, stop) + penalty * (2 + (knees > start))
            k = int(np.argmin(costs))
            cost = costs[k] + below[start] + beyond[stop]
            if cost < least:
                least, best = cost, Segments(start, int(knees[k]), stop)
    return best


class _Sums:
    """Weighted least squares of any range of bins, from cumulative sums."""

    def __init__(self, x: np.ndarray, y: np.ndarray, weight: np.ndarray):
        # Relative to the mean, so that differences of sums of squares do not cancel.
        x0, y0 = x.mean(), y.mean()
        self.x = x - x0
        terms = [np.ones_like(x), self.x, self.x**2, y - y0, self.x * (y - y0), (y - y0) ** 2]
        self.cumulative = np.array([np.concatenate([[0.0], np.cumsum(weight * t)]) for t in terms])

    def between(self, first: int | np.ndarray, last: int) -> np.ndarray:
        """Σ w, w x, w x², w y, w x y, w y² over bins [first, last)."""
        end = self.cumulative[:, last]
        return (end[:, None] if np.ndim(first) else end) - self.cumulative[:, first]

    def constant(self, first: int, last: int) -> float:
        """χ² of the best constant."""
        if last <= first:
            return 0.0
        w, _, _, wy, _, wyy = self.between(first, last)
        return float(wyy - wy**2 / w)

    def line(self, first: int, last: int) -> float:
        """χ² of the best straight line."""
        if last - first < 3:
            return 0.0
        w, wx, wxx, wy, wxy, wyy = self.between(first, last)
        determinant = w * wxx - wx**2
        slope = (w * wxy - wx * wy) / determinant
        return float(wyy - wy**2 / w - slope * (wxy - wx * wy / w))

    def broken_line(self, first: int, knees: np.ndarray, last: int) -> np.ndarray:
        """χ² (n,) of the best line that is constant up to each knee (n,) and falls from there."""
        w, _, _, wy, _, wyy = self.between(first, last)
        v, vx, vxx, vy, vxy, _ = self.between(knees, last)
        # Sums of the basis function b = max(x - knee, 0), of b² and of b y.
        knee = self.x[knees]
        b, bb, by = vx - knee * v, vxx - 2 * knee * vx + knee**2 * v, vxy - knee * vy
        slope = (w * by - b * wy) / (w * bb - b**2)
        cost = wyy - wy**2 / w - slope * (by - b * wy / w)
        return np.where(slope < LEAST_FALL, cost, np.inf)


def power_law(x: np.ndarray, y: np.ndarray, variance: np.ndarray, segments: Segments) -> PowerLaw:
    """Fit plateau and power law of a division; arguments as of `best_segments`.

    Errors include the factor √misfit if that is above 1.
    """
    from scipy.optimize import minimize_scalar

    inside = slice(segments.start, segments.stop)
    xs, ys, weight = x[inside], y[inside], 1 / variance[inside]
    knee = None
    if segments.knee > segments.start:
        search = x[segments.knee - 1], x[min(segments.knee + 1, segments.stop - 1)]
        found = minimize_scalar(
            lambda x_k: _solve(np.maximum(xs - x_k, 0), ys, weight)[2],
            bounds=search,
            method="bounded",
        )
        if not found.success:
            raise NotConverged(f"the roll-off of the spectrum was not found: {found.message}")
        knee = found.x
    basis = xs if knee is None else np.maximum(xs - knee, 0)
    constant, slope, chi_squared = _solve(basis, ys, weight)
    columns = [np.ones_like(xs), basis]
    if knee is not None:
        columns.append(-slope * (xs > knee))
    J = np.stack(columns)
    covariance = np.linalg.pinv((J * weight) @ J.T)
    misfit = chi_squared / max(len(xs) - len(columns), 1)
    errors = np.sqrt(np.diag(covariance) * max(misfit, 1.0))
    return PowerLaw(
        float(constant),
        float(slope),
        float(errors[1]),
        None if knee is None else float(knee),
        None if knee is None else float(errors[2]),
        float(misfit),
    )


def _solve(basis: np.ndarray, y: np.ndarray, weight: np.ndarray) -> tuple[float, float, float]:
    """Constant, slope and χ² of the weighted least squares y ≈ constant + slope basis."""
    root = np.sqrt(weight)
    A = np.stack([root, root * basis], axis=1)
    (constant, slope), *_ = np.linalg.lstsq(A, root * y, rcond=None)
    residual = y - constant - slope * basis
    return constant, slope, float(np.sum(weight * residual**2))
