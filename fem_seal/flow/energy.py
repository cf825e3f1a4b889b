"""An energy ∫ ∇v·T·∇v, summed cell by cell, with a bound of its rounding error.

The stored function is exactly admissible, so only the arithmetic of its energy can spoil a bound.
Each cell adds |T| G·T·G. In a slender cell a component of the gradient G is a difference of terms
that exceed it by the ratio of the cell's sides, and its rounding error grows by the same ratio.
Since the terms are known, the error of this very sum can be bounded (running error analysis:
Higham, Accuracy and Stability of Numerical Algorithms, 2002, section 3.3).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import fsum

import numpy as np

# Relative error of averages and of sums of positive terms. Each step on positive numbers adds at
# most u = eps/2. A gap is averaged 24 times at midpoints of edges of a grid and 42 times at those
# of a shape (`SHORTEST_EDGE`), two steps each, which count three times in its cube; a mean over a
# triangle takes at most 100 steps, the pyramid of averages 24, the sum in pairs over a batch of
# cells 32: 408 u. Averages on cells and on their quarters may differ by as much, so that it counts
# three times: 1.4e-13. This is seven times as much.
SUM_ROUNDING = 1e-12
# Relative error of each term of a cell: 12 steps in a component of the gradient, which counts
# twice, 40 in the tensor (of which 15 in its moments), 10 in the area and the sums. For bubble
# functions: 35 in a product of two gradients, 10 in the sums at an edge, 35 in the sum in pairs
# over the edges of a block, 80 in the sum over the blocks of 1e7 cells.
_TERM = 160 * np.finfo(float).eps / 2


def shape_gradients(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradients (C, 3, 2) of the barycentric coordinates of triangles (C, 3, 2), and areas (C,)."""
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


@dataclass(frozen=True)
class Energy:
    """An energy ∫ ∇v·T·∇v with a bound of its rounding error."""

    value: float  #: energy as computed
    error: float = 0.0  #: bound of the rounding errors of its terms
    terms: float = 0.0  #: energy with every term of each gradient replaced by its absolute value

    @classmethod
    def sum(cls, energies: Iterable["Energy"]) -> "Energy":
        """Sum of energies, of their errors and of their terms."""
        rows = [(energy.value, energy.error, energy.terms) for energy in energies]
        return cls(*(fsum(column) for column in zip(*rows, strict=True)))

    @classmethod
    def of_cells(
        cls, corners: np.ndarray, tensor: np.ndarray, corner_values: np.ndarray, blur: float
    ) -> "Energy":
        """Energy of a function v that is linear on n triangles.

        Parameters
        ----------
        corners : (n, 3, 2)
            Corners, the first one at the origin.
        tensor : (n, 3)
            Components xx, xy, yy of T.
        corner_values : (n, 3)
            Values of v.
        blur
            Largest error of a coordinate in units of the rounding unit.
        """
        slopes, areas = shape_gradients(corners)
        gx, gy = gradients(slopes, corner_values).T
        Gx, Gy = _terms_of_gradients(corners, slopes, areas, corner_values, blur)
        xx, xy, yy = tensor.T
        hx, hy = np.abs(gx), np.abs(gy)
        value = areas * (xx * gx * gx + 2 * xy * gx * gy + yy * gy * gy)
        error = areas * (xx * Gx * hx + np.abs(xy) * (Gx * hy + Gy * hx) + yy * Gy * hy)
        terms = areas * (xx * Gx * Gx + 2 * np.abs(xy) * Gx * Gy + yy * Gy * Gy)
        total = terms.sum()
        return cls(value.sum(), _TERM * error.sum() + _TERM**2 * total, total)

    def upper_bound(self) -> float:
        """Upper bound of the energy."""
        return float(self.value * (1 + SUM_ROUNDING) + self.error)

    def error_of_drop(self, plain: float, terms: float) -> float:
        """Bound of the rounding error of the amount by which bubble functions lower the energy.

        The drop is -2 s·r - s·A·s, with r = ∫ c ∇v·∇φ and A = ∫ c ∇φ·∇φ for bubble functions φ of
        coefficients s. `plain` is the energy with the gradient of Σ s φ replaced by a bound of its
        absolute terms, `terms` the same times the condition of the triangles. The inequality of
        Cauchy and Schwarz bounds the sum of the errors (docs/theory/mathematics.md, Rounding).
        """
        t, x_0, x = np.sqrt([self.terms, plain, terms])
        return float(_TERM * (2 * t + x) * x_0 + _TERM**2 * (2 * t + x) * x)


def _terms_of_gradients(
    corners: np.ndarray,
    slopes: np.ndarray,
    areas: np.ndarray,
    corner_values: np.ndarray,
    blur: float,
) -> np.ndarray:
    """Sums (2, n) of the absolute terms of `gradients`, times the condition of the triangles."""
    (ux, uy), (vx, vy) = corners[:, 1:].transpose(1, 2, 0)
    # Twice the area is ux vy - uy vx; beside right angles along the axes one of them is zero.
    products = np.abs(ux * vy) + np.abs(uy * vx)
    size = np.abs(ux) + np.abs(uy) + np.abs(vx) + np.abs(vy)
    twice = 2 * areas
    uncertain = (products + blur * size) / twice
    v_a, v_b, v_c = corner_values.T
    b, c = np.abs(v_b - v_a), np.abs(v_c - v_a)
    grown = np.abs(slopes[:, 1]) * b[:, None] + np.abs(slopes[:, 2]) * c[:, None]
    return uncertain * grown.T + blur * (b + c) / twice
