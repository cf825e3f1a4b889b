"""An energy, summed cell by cell, and how far rounding can have moved it.

The functions are exact as they are stored, and so are the bounds but for the arithmetic of the
energy: each cell adds |T| G·T·G. In a slender cell a component of the gradient G is a difference of
terms that may exceed it by the ratio of the cell's sides, and what rounding does to it grows alike.
The terms themselves are known, so the error is bounded for the function at hand (running error
analysis: Higham, Accuracy and Stability of Numerical Algorithms, 2002, section 3.3).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import fsum

import numpy as np

from fem_seal.flow.gradients import gradients, shape_gradients

# Relative error of what no cell shows: sums of positive terms over up to 1e7 cells and up the
# pyramid of averages, and gaps halved 2 · 24 times at middles of edges.
ROUNDING = 1e-12
# Relative error of each term of a cell: 12 roundings in a component of the gradient, which counts
# twice, 40 in the tensor (of which 15 in its moments), 10 in the area and the sums.
_TERM = 80 * np.finfo(float).eps


@dataclass(frozen=True)
class Energy:
    """∫ ∇v·T·∇v.

    value : as computed
    error : what rounding in its terms can have done to it
    terms : the energy if no two terms of a gradient had opposite signs
    """

    value: float
    error: float = 0.0
    terms: float = 0.0

    @classmethod
    def sum(cls, some: Iterable["Energy"]) -> "Energy":
        """All of them together."""
        rows = [(one.value, one.error, one.terms) for one in some]
        return cls(*(fsum(column) for column in zip(*rows, strict=True)))

    @classmethod
    def of_cells(
        cls, corners: np.ndarray, tensor: np.ndarray, corner_values: np.ndarray, blur: float
    ) -> "Energy":
        """Of a function that is linear on n triangles.

        Parameters
        ----------
        corners : (n, 3, 2), the first one at the origin
        tensor : (n, 3), components xx, xy, yy of T
        corner_values : (n, 3)
        blur : coordinates are off by this times the rounding unit at most
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

    def least_upper(self, drop: float = 0.0) -> float:
        """An upper bound of the energy after hats have lowered it by `drop`.

        The drop is 2 r·s - s·A·s with the residual r of hats s. Each r is a sum over cells, in each
        of them off by _TERM times √(terms of the cell · stiffness of the hat) at most, and
        s·diag(A)·s ≤ 3 s·A·s, as a cell has three hats: Cauchy and Schwarz.
        """
        drop = max(drop, 0.0)
        off = 2 * _TERM * np.sqrt(3 * self.terms) * np.sqrt(drop)
        return float(self.value * (1 + ROUNDING) - drop + self.error + off)


def _terms_of_gradients(
    corners: np.ndarray,
    slopes: np.ndarray,
    areas: np.ndarray,
    corner_values: np.ndarray,
    blur: float,
) -> np.ndarray:
    """Sums (2, n) of the absolute terms of `gradients`, times how uncertain the triangles are."""
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
