"""Triangles halved twice: their parts, and hats on them, in terms of the whole.

A triangle (a, b, c) is halved from a to the middle m of bc, and its halves from m to the middles
d of ab and e of ca. That maps linearly from one triangle to another, so that all there is to know
of the parts are sums over the corners of the whole, with the same weights for every triangle.
"""

from dataclasses import dataclass

import numpy as np


def with_middles(corners: np.ndarray) -> np.ndarray:
    """Values (k, 6, n) at the corners a, b, c and, linear, at the middles of the sides opposite.

    Parameters
    ----------
    corners : (3, n, k), values at the corners of n triangles
    """
    six = np.empty((corners.shape[2], 6, corners.shape[1]))
    six[:, :3] = np.moveaxis(corners, -1, 0)
    for k in range(3):
        np.add(six[:, (k + 1) % 3], six[:, (k + 2) % 3], out=six[:, 3 + k])
    six[:, 3:] /= 2
    return six


def on_quarters(six: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values at the corners of the quarters, from those (6, n) of `with_middles`.

    Returns
    -------
    At (a, c, b, a), one after the other for each quarter, (2, 2, n); at d and e, (2, n), which
    every other quarter has; and at m, (n,), which all have
    """
    a, b, c, m, e, d = six
    return np.stack([a, c, b, a]).reshape(2, 2, -1), np.stack([d, e]), m


def thrice_centroids(corners: np.ndarray) -> np.ndarray:
    """Three times the centroids (k, 4, n) of the quarters, from corners (k, 3, n) in integers.

    A half of 3 a + 2 b + c, a + b + 4 c, a + 4 b + c and 3 a + b + 2 c.
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    once = a + b + c
    twice = np.stack([once + 2 * a + b, once + 3 * c, once + 3 * b, once + 2 * a + c], axis=1)
    return twice >> 1


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
        finite = np.where(np.isfinite(inverse_cube), inverse_cube, 0.0)
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
        """Of triangles with corners a, b and c at (x, y), each (3, n), seen from one of them."""
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

    def stiffness(self, c: np.ndarray) -> tuple[np.ndarray, ...]:
        """∫ c |∇φ|², each (n,), for the hats of m, e and d."""
        return (
            (c[0] + c[2]) * self.cc + (c[1] + c[3]) * self.bb,
            c[1] * self.sums + c[3] * self.differences,
            c[0] * self.differences + c[2] * self.sums,
        )

    def couplings(self, c: np.ndarray) -> tuple[np.ndarray, ...]:
        """∫ c ∇φ·∇χ, each (n,), for the hat φ of m and the hats χ of e and d."""
        return (
            c[3] * (self.bc - self.bb) - c[1] * (self.bc + self.bb),
            c[0] * (self.bc - self.cc) - c[2] * (self.bc + self.cc),
        )
