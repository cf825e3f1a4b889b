"""Bounds of a leak rate or of a tensor: two matrices between which it lies as a form."""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import Inconsistent
from fem_seal.leak_rate import Factors, require_enclosed

# Part of the largest conductivity that rounding errors leave in a direction without flow.
NO_FLOW = 1e-14


@dataclass(frozen=True, eq=False)
class Bounds:
    """Two matrices between which a tensor lies as a quadratic form; a leak rate is (1, 1)."""

    lower: np.ndarray  #: (d, d), e·lower·e <= e·K*·e for every direction e
    upper: np.ndarray  #: (d, d), e·K*·e <= e·upper·e

    def __post_init__(self) -> None:
        d = len(self.lower)
        if not self.lower.shape == self.upper.shape == (d, d):
            raise Inconsistent(f"bounds of shapes {self.lower.shape} and {self.upper.shape}")
        if d == 1:
            require_enclosed(*self.numbers)

    @property
    def numbers(self) -> tuple[float, float]:
        """Both bounds of a leak rate."""
        return self.lower.item(), self.upper.item()

    @property
    def excess(self) -> float:
        """Largest (u - l)/l over the directions that flow."""
        return excess(self.lower, self.upper)

    @property
    def width(self) -> float:
        """Largest relative width over all directions."""
        return widest(self.lower, self.upper)[0]

    def tightened(self, other: "Bounds") -> "Bounds":
        """The narrowest pair of a lower and an upper bound, each from one of the two.

        One matrix need not exceed another in every direction, so the better one of two depends on
        its partner. Without a lower bound the smallest upper one counts. Where no pair is better
        than the others, those of `self` stay.
        """
        pairs = [Bounds(low.lower, up.upper) for low in (self, other) for up in (self, other)]
        return min(pairs, key=lambda pair: (pair.width, np.trace(pair.upper)))

    def slip_factors(self, at_mean: "Bounds") -> Factors:
        """Factors <= 1 and >= 1 from the bounds at the mean pressure to these, of any pressure."""
        (lower, upper), (mean_lower, mean_upper) = self.numbers, at_mean.numbers
        least = min(lower / mean_lower, 1.0) if mean_lower > 0 else 1.0
        return Factors(least, max(upper / mean_upper, 1.0))

    def hardly_better(self, before: "Bounds") -> bool:
        """Whether neither the width nor the upper bound is less by 1 % than `before`."""
        narrower = self.width < 0.99 * before.width
        return not (narrower or np.trace(self.upper) < 0.99 * np.trace(before.upper))

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
class TensorBounds(Bounds):
    """Bounds of a conductivity tensor [m³/(Pa s)], and how they were reached."""

    unknowns: int = 0  #: unknowns of the last mesh for one direction
    reason: str = ""  #: sentence on why the tolerance was not reached; empty if it was

    @property
    def converged(self) -> bool:
        """Whether the tolerance was reached."""
        return not self.reason

    @property
    def value(self) -> np.ndarray:
        """Matrix geometric mean of both bounds, the upper one where there is no lower one."""
        return geometric_mean(self.lower, self.upper)


def geometric_mean(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Geometric mean A # B of two positive semidefinite matrices, A <= B.

    B F (Fᵀ A F)^½ Fᵀ B with Fᵀ B F = 1 (R. Bhatia, Positive Definite Matrices, 2007, section 4.1),
    F being of the directions that flow: one for a single channel, where both are multiples of one
    matrix. B if A has no flow in one of them.
    """
    flowing = _flowing(B)
    ratios, turn = np.linalg.eigh(flowing.T @ A @ flowing)
    if not (ratios > 0).all():
        return B
    root = B @ flowing @ turn
    return (root * np.sqrt(ratios)) @ root.T


def excess(lower: np.ndarray, upper: np.ndarray) -> float:
    """Largest (u - l)/l of u = e·upper·e and l = e·lower·e over directions e that flow."""
    ratio = _least_ratio(lower, upper)[0]
    return 1 / ratio - 1 if ratio > 0 else np.inf


def widest(lower: np.ndarray, upper: np.ndarray) -> tuple[float, np.ndarray]:
    """Largest relative width of two bounds, and its direction e (d,) of length one.

    It is the largest (u - l)/√(l u) of u = e·upper·e and l = e·lower·e over directions e that flow.
    """
    ratio, direction = _least_ratio(lower, upper)
    width = float((1 - ratio) / np.sqrt(ratio)) if ratio > 0 else np.inf
    return width, direction / np.linalg.norm(direction)


def _least_ratio(lower: np.ndarray, upper: np.ndarray) -> tuple[float, np.ndarray]:
    """Smallest (e·lower·e)/(e·upper·e), and its direction e (d,).

    Directions in which the conductivity is at rounding level do not count; 1 if all are.
    """
    flowing = _flowing(upper)
    if not flowing.size:
        return 1.0, np.eye(len(upper))[0]  # nothing flows, and both bounds say so
    ratios, weights = np.linalg.eigh(flowing.T @ lower @ flowing)
    return float(ratios[0]), flowing @ weights[:, 0]


def _flowing(upper: np.ndarray) -> np.ndarray:
    """Directions F (d, k) with Fᵀ upper F = 1, without those in which only rounding errors flow."""
    # Scale the diagonal to ones: a direction of small conductivity then keeps all its digits.
    diagonal = upper.diagonal()
    scale = np.divide(1.0, np.sqrt(diagonal), out=np.zeros(len(upper)), where=diagonal > 0)
    values, vectors = np.linalg.eigh(scale[:, None] * upper * scale)
    flows = values > NO_FLOW
    return scale[:, None] * vectors[:, flows] / np.sqrt(values[flows])
