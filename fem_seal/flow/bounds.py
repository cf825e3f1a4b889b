"""Bounds of a leak rate, and of a tensor: two matrices between which it lies as a form."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fem_seal.leak_rate import relative_width

# Part of the largest conductivity that rounding errors leave in a direction without flow.
ROUNDING = 1e-14


class Bounds(NamedTuple):
    """Two numbers between which the leak rate lies."""

    lower: float = 0.0
    upper: float = np.inf

    @property
    def excess(self) -> float:
        """(upper - lower)/lower; infinite if the lower bound is 0."""
        return self.upper / self.lower - 1 if self.lower > 0 else np.inf

    @property
    def width(self) -> float:
        """Relative width, see `leak_rate.relative_width`."""
        return relative_width(self.lower, self.upper)

    def tightened(self, other: "Bounds") -> "Bounds":
        """The larger lower bound and the smaller upper bound of the two."""
        return Bounds(max(self.lower, other.lower), min(self.upper, other.upper))

    def over(self, mean: "Bounds") -> tuple[float, float]:
        """Factors <= 1 and >= 1 by which these bounds exceed those without the effect of slip."""
        lower = min(self.lower / mean.lower, 1.0) if mean.lower > 0 else 1.0
        return lower, max(self.upper / mean.upper, 1.0)

    def hardly_better(self, before: "Bounds") -> bool:
        """Whether both bounds are less than 1 % better than `before`."""
        return self.upper > 0.99 * before.upper and self.lower <= 1.01 * before.lower


@dataclass(frozen=True, eq=False)
class MatrixBounds:
    """Two matrices between which the tensor lies as a quadratic form."""

    lower: np.ndarray  #: (2, 2), e·lower·e <= e·K*·e for every direction e
    upper: np.ndarray  #: (2, 2), e·K*·e <= e·upper·e

    @property
    def value(self) -> np.ndarray:
        """Matrix geometric mean of both bounds, the upper one where there is no lower one."""
        return geometric_mean(self.lower, self.upper)

    @property
    def excess(self) -> float:
        """Largest (u - l)/l of u = e·upper·e and l = e·lower·e over directions e that flow."""
        ratio = _least_ratio(self.lower, self.upper)[0]
        return 1 / ratio - 1 if ratio > 0 else np.inf

    @property
    def width(self) -> float:
        """Largest relative width over all directions."""
        return widest(self.lower, self.upper)[0]

    def tightened(self, other: "MatrixBounds") -> "MatrixBounds":
        """The narrowest pair of a lower and an upper bound, each from one of the two.

        One matrix need not exceed another in every direction, so the better one of two depends on
        its partner. Where no pair is narrower than the others, those of `self` stay.
        """
        pairs = [(lower.lower, upper.upper) for lower in (self, other) for upper in (self, other)]
        return MatrixBounds(*min(pairs, key=lambda pair: widest(*pair)[0]))

    def hardly_better(self, before: "MatrixBounds") -> bool:
        """Whether the bounds are less than 1 % narrower than `before`."""
        return not self.width < 0.99 * before.width

    def widened(self, part: float) -> "MatrixBounds":
        """Bounds lowered and raised by a part of their values."""
        return MatrixBounds(self.lower * (1 - part), self.upper * (1 + part))

    def interval(self, i: int, j: int) -> tuple[float, float]:
        """Bounds of one component, diagonal or not.

        For 0 <= D <= W as quadratic forms |D_ij - W_ij/2| <= √(W_ii W_jj)/2, by Cauchy and Schwarz
        for D - W/2, which lies between -W/2 and W/2.
        """
        W = self.upper - self.lower
        middle = (self.lower + W / 2)[i, j]
        half = np.sqrt(max(W[i, i], 0.0) * max(W[j, j], 0.0)) / 2
        return float(middle - half), float(middle + half)


@dataclass(frozen=True, eq=False)
class TensorBounds(MatrixBounds):
    """Bounds of a conductivity tensor [m³/(Pa s)], and how they were reached."""

    unknowns: int = 0  #: unknowns of the last mesh for one direction
    converged: bool = True  #: whether the tolerance was reached
    reason: str = ""  #: sentence on why it was not; empty if it was
    levels: tuple[tuple[int, float], ...] = ()  #: unknowns and relative width of each mesh


def geometric_mean(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Geometric mean A # B of two positive definite 2 × 2 matrices; B if A is singular.

    √(ab)/√det(A/a + B/b) (A/a + B/b) with a = √det A, b = √det B (R. Bhatia, Positive Definite
    Matrices, 2007, prop. 4.1.12). For a single channel both matrices are multiples of one.
    """
    a, b = (np.sqrt(max(np.linalg.det(M), 0.0)) for M in (A, B))
    if a > 0 and b > 0:
        total = A / a + B / b
        return np.sqrt(a * b / np.linalg.det(total)) * total
    traces = np.trace(A), np.trace(B)
    if min(traces) > 0 and np.linalg.matrix_rank(B, tol=ROUNDING * traces[1]) == 1:
        return B * np.sqrt(traces[0] / traces[1])
    return B


def widest(lower: np.ndarray, upper: np.ndarray) -> tuple[float, np.ndarray]:
    """Largest relative width of two bounds, and its direction e (2,) of length one.

    It is the largest (u - l)/√(l u) of u = e·upper·e and l = e·lower·e over directions e that flow.
    """
    ratio, direction = _least_ratio(lower, upper)
    width = float((1 - ratio) / np.sqrt(ratio)) if ratio > 0 else np.inf
    return width, direction / np.linalg.norm(direction)


def _least_ratio(lower: np.ndarray, upper: np.ndarray) -> tuple[float, np.ndarray]:
    """Smallest (e·lower·e)/(e·upper·e), and its direction e (2,).

    Directions in which the conductivity is at rounding level do not count.
    """
    # Scale the diagonal to ones: a direction of small conductivity then keeps all its digits.
    diagonal = upper.diagonal()
    scale = np.divide(1.0, np.sqrt(diagonal), out=np.zeros(2), where=diagonal > 0)
    values, vectors = np.linalg.eigh(scale[:, None] * upper * scale)
    flows = values > ROUNDING
    flowing = scale[:, None] * vectors[:, flows] / np.sqrt(values[flows])
    ratios, weights = np.linalg.eigh(flowing.T @ lower @ flowing)
    return float(ratios[0]), flowing @ weights[:, 0]
