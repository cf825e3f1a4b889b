"""Triangles halved twice: their parts, and hats on them, in terms of the whole.

A triangle (a, b, c) is halved from a to the middle m of bc, and its halves from m to the middles
d of ab and e of ca. That maps linearly from one triangle to another, so that all there is to know
of the parts are sums over the corners of the whole, with the same weights for every triangle.
"""

from dataclasses import dataclass

import numpy as np

# Of the quarters (d, m, a), (e, m, c), (d, b, m) and (e, a, m) the first, the second and the third
# corner (3, 4); places in (a, b, c, m, e, d), a middle being that of the side opposite a corner.
_CORNERS = np.array([[5, 4, 5, 4], [3, 3, 1, 0], [0, 2, 3, 3]])
# Twice the sum of the corners of each quarter, from a, b and c.
_SUMS = np.array([[3, 2, 1], [1, 1, 4], [1, 4, 1], [3, 1, 2]])


def middles(corners: np.ndarray) -> np.ndarray:
    """Means (3, ...) of the two ends of the sides opposite to the corners a, b and c (3, ...)."""
    a, b, c = corners
    return np.stack([b + c, c + a, a + b]) / 2


def on_quarters(corners: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Values (k, 3, 4, n) at the corners of the quarters of n triangles.

    Parameters
    ----------
    corners, middle : (3, n, k), values at the corners a, b, c and at the middles opposite to them
    """
    return np.moveaxis(np.concatenate([corners, middle]), -1, 0).take(_CORNERS, axis=1)


def thrice_centroids(xy: np.ndarray) -> np.ndarray:
    """Three times the centroids (2, 4, n) of the quarters, from corners (3, n, 2) in integers."""
    return np.tensordot(_SUMS, xy, axes=1).transpose(2, 0, 1) // 2


@dataclass(frozen=True, eq=False)
class QuarterData:
    """What the two energies need of the quarters of n cells: all first ones, all second ones, ...

    K : (4 n,), mean of g³
    resistivity : (4 n, 1), mean of 1/g³; zero where it is infinite
    """

    K: np.ndarray
    resistivity: np.ndarray

    @classmethod
    def of(cls, cube: np.ndarray, inverse_cube: np.ndarray) -> "QuarterData":
        """From the two means (4, n)."""
        finite = np.where(np.isinf(inverse_cube), 0.0, inverse_cube)
        return cls(cube.ravel(), finite.reshape(-1, 1))


@dataclass(frozen=True, eq=False)
class Shape:
    """Products ∫∇λ·∇λ, each (n,), of barycentric coordinates λ_b and λ_c of n triangles.

    bb, bc, cc : of the two with each other
    sums, differences : of λ_b + λ_c, and of λ_b - λ_c, with itself
    """

    bb: np.ndarray
    bc: np.ndarray
    cc: np.ndarray
    sums: np.ndarray
    differences: np.ndarray

    @classmethod
    def of(cls, x: np.ndarray, y: np.ndarray) -> "Shape":
        """Of triangles with corners a, b and c at (x, y), each (3, n)."""
        # ∇λ is the opposite side, turned, over twice the area.
        bx, by, cx, cy = x[0] - x[2], y[0] - y[2], x[1] - x[0], y[1] - y[0]
        scale = 0.5 / np.abs(bx * cy - by * cx)
        bc = scale * (bx * cx + by * cy)
        px, py, mx, my = bx + cx, by + cy, bx - cx, by - cy
        return cls(
            bb=scale * (bx * bx + by * by),
            bc=bc,
            cc=scale * (cx * cx + cy * cy),
            sums=scale * (px * px + py * py),
            differences=scale * (mx * mx + my * my),
        )

    def slopes(self, corner_values: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, ...]:
        """∫ c ∇φ·∇v, each (n,), for the hats φ of m, e and d.

        Parameters
        ----------
        corner_values : (n, 3), of v
        c : (4, n), of the quarters

        Notes
        -----
        Each of the hats is twice a sum of barycentric coordinates: that of m is 2 λ_c on the first
        half (m, a, b) and 2 λ_b on the other one; that of d is 2 (λ_b - λ_c) on (d, m, a) and 2 λ_a
        on (d, b, m); that of e is 2 λ_a on (e, m, c) and 2 (λ_c - λ_b) on (e, a, m).
        """
        # From differences of the corner values: the same added to all is not even rounded.
        v_a, v_b, v_c = corner_values.T
        v_b, v_c = (v_b - v_a) / 2, (v_c - v_a) / 2
        b, c_ = self.bb * v_b + self.bc * v_c, self.bc * v_b + self.cc * v_c
        plus, minus = b + c_, b - c_
        return (
            (c[1] + c[3]) * b + (c[0] + c[2]) * c_,
            -(c[1] * plus + c[3] * minus),
            c[0] * minus - c[2] * plus,
        )

    def stiffness(self, c: np.ndarray) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
        """∫ c ∇φ·∇φ of the hats of m, e and d with themselves; of that of m with those of e and d.

        Parameters
        ----------
        c : (4, n), of the quarters
        """
        own = (
            (c[0] + c[2]) * self.cc + (c[1] + c[3]) * self.bb,
            c[1] * self.sums + c[3] * self.differences,
            c[0] * self.differences + c[2] * self.sums,
        )
        with_m = (
            c[3] * (self.bc - self.bb) - c[1] * (self.bc + self.bb),
            c[0] * (self.bc - self.cc) - c[2] * (self.bc + self.cc),
        )
        return own, with_m
