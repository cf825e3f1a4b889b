"""Straight pieces of a spectrum in logarithms: below, plateau with power law, beyond."""

from dataclasses import dataclass

import numpy as np

FEWEST_BINS = 5  # of the plateau and power law together
FEWEST_BEYOND = 2  # that show a cut-off
STRADDLING = 3  # at most, at a cut-off
# A measured spectrum is a power law only so well; edges that merely trace such wiggles
# (15 % of the power) are no cut-offs. It plays no part in the fit of the exponent.
WIGGLE = 0.15
# A power law that falls more slowly than this is a plateau.
LEAST_FALL = -1.0


@dataclass(frozen=True)
class Segments:
    """Bins [start, stop) hold the plateau and the power law, which starts at bin `knee`.

    The bins start - 1 and stop, if any, straddle the cut-offs and belong to nothing, nor may a
    few next to them.
    """

    start: int
    knee: int
    stop: int


@dataclass(frozen=True)
class PowerLaw:
    """y = level + slope max(x - knee, 0), or + slope x without a knee."""

    level: float
    slope: float
    slope_error: float
    knee: float | None
    knee_error: float | None
    misfit: float

    def at(self, x: np.ndarray) -> np.ndarray:
        """Fitted ln C at ln q."""
        beyond = x if self.knee is None else np.maximum(x - self.knee, 0)
        return self.level + self.slope * beyond


def best_segments(x: np.ndarray, y: np.ndarray, variance: np.ndarray) -> Segments | None:
    """Division with the least χ² + (number of parameters) ln(number of bins).

    Parameters
    ----------
    x, y, variance : (m,) ln q, increasing, ln C and its variance

    Returns
    -------
    Segments, or None if a level spectrum does as well.
    """
    m = len(x)
    weight = 1 / (variance + WIGGLE**2)
    sums = _Sums(x, y, weight)
    price = np.log(max(m, 2))
    # A cut-off lies in one bin, or is smeared over a few by a window: each costs a parameter.
    below = [
        min(sums.constant(0, i - n) + (1 + n) * price for n in range(1, STRADDLING + 1))
        for i in range(m)
    ]
    beyond = [
        min(sums.line(j + n, m) + (2 + n) * price for n in range(1, STRADDLING + 1))
        for j in range(m)
    ]
    below[0], beyond = 0.0, [*beyond, 0.0]
    # What must be beaten: a level spectrum, such as that of white noise.
    best, found = sums.constant(0, m) + price, None
    for start in range(m):
        if 0 < start < 1 + FEWEST_BEYOND:
            continue
        for stop in range(start + FEWEST_BINS, m + 1):
            if m - FEWEST_BEYOND - 1 < stop < m:
                continue
            knees = np.arange(start, stop - FEWEST_BEYOND)
            costs = sums.broken_line(start, knees, stop) + price * (2 + (knees > start))
            k = int(np.argmin(costs))
            cost = costs[k] + below[start] + beyond[stop]
            if cost < best:
                best, found = cost, Segments(start, int(knees[k]), stop)
    return found


class _Sums:
    """Weighted least squares of any range of bins, from sums up to each bin."""

    def __init__(self, x: np.ndarray, y: np.ndarray, weight: np.ndarray):
        self.x = x
        # About the middle, so that squares of large logarithms do not cancel.
        x0, y0 = x.mean(), y.mean()
        self.x = x - x0
        terms = [np.ones_like(x), self.x, self.x**2, y - y0, self.x * (y - y0), (y - y0) ** 2]
        self.upto = np.array([np.concatenate([[0.0], np.cumsum(weight * t)]) for t in terms])

    def between(self, first: int | np.ndarray, last: int) -> np.ndarray:
        """Σ w, w x, w x², w y, w x y, w y² over bins [first, last)."""
        upto = self.upto[:, last]
        return (upto[:, None] if np.ndim(first) else upto) - self.upto[:, first]

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
        """χ² of the best line that is level up to each knee and falls from there."""
        w, _, _, wy, _, wyy = self.between(first, last)
        v, vx, vxx, vy, vxy, _ = self.between(knees, last)
        at = self.x[knees]
        b, bb, by = vx - at * v, vxx - 2 * at * vx + at**2 * v, vxy - at * vy
        slope = (w * by - b * wy) / (w * bb - b**2)
        cost = wyy - wy**2 / w - slope * (by - b * wy / w)
        return np.where(slope < LEAST_FALL, cost, np.inf)


def power_law(x: np.ndarray, y: np.ndarray, variance: np.ndarray, segments: Segments) -> PowerLaw:
    """Fit the plateau and power law of a division, with errors from the variances alone."""
    from scipy.optimize import minimize_scalar

    inside = slice(segments.start, segments.stop)
    xs, ys, weight = x[inside], y[inside], 1 / variance[inside]
    knee = None
    if segments.knee > segments.start:
        search = x[segments.knee - 1], x[min(segments.knee + 1, segments.stop - 1)]
        knee = minimize_scalar(
            lambda at: _solve(np.maximum(xs - at, 0), ys, weight)[2],
            bounds=search,
            method="bounded",
        ).x
    basis = xs if knee is None else np.maximum(xs - knee, 0)
    level, slope, chi_squared = _solve(basis, ys, weight)
    columns = [np.ones_like(xs), basis]
    if knee is not None:
        columns.append(-slope * (xs > knee))
    J = np.stack(columns)
    covariance = np.linalg.pinv((J * weight) @ J.T)
    misfit = chi_squared / max(len(xs) - len(columns), 1)
    errors = np.sqrt(np.diag(covariance) * max(misfit, 1.0))
    return PowerLaw(
        float(level),
        float(slope),
        float(errors[1]),
        None if knee is None else float(knee),
        None if knee is None else float(errors[2]),
        float(misfit),
    )


def _solve(basis: np.ndarray, y: np.ndarray, weight: np.ndarray) -> tuple[float, float, float]:
    """Level, slope and χ² of the weighted least squares y ≈ level + slope basis."""
    root = np.sqrt(weight)
    A = np.stack([root, root * basis], axis=1)
    (level, slope), *_ = np.linalg.lstsq(A, root * y, rcond=None)
    residual = y - level - slope * basis
    return level, slope, float(np.sum(weight * residual**2))
