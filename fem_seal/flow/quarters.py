"""The quarters of triangles that are halved twice, and the bubble functions on them.

A triangle (a, b, c) is halved from a to the midpoint m of bc, and its halves from m to the
midpoints d of ab and e of ca. Linear maps carry this from one triangle to another, so that all
data of the quarters are sums over the corners of the triangle, with the same weights for all
triangles.
"""

from dataclasses import dataclass

import numpy as np


def with_middles(corners: np.ndarray) -> np.ndarray:
    """Values (k, 6, n) of linear functions at corners a, b, c and opposite midpoints.

    `corners` (3, n, k) are the values at the corners of n triangles.
    """
    six = np.empty((corners.shape[2], 6, corners.shape[1]))
    six[:, :3] = np.moveaxis(corners, -1, 0)
    for k in range(3):
        np.add(six[:, (k + 1) % 3], six[:, (k + 2) % 3], out=six[:, 3 + k])
    six[:, 3:] /= 2
    return six


def on_quarters(six: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values at the corners of the quarters, from those (6, n) of `with_middles`.

    Returns (2, 2, n), (2, n) and (n,): values at a, c, b, a, one for each quarter; values at d and
    e, each for every other quarter; and values at m, for all quarters.
    """
    a, b, c, m, e, d = six
    return np.stack([a, c, b, a]).reshape(2, 2, -1), np.stack([d, e]), m


def thrice_centroids(corners: np.ndarray) -> np.ndarray:
    """Three times the centroids (k, 4, n) of the quarters, from corners (k, 3, n) in integers.

    They are 3 a + 2 b + c, a + b + 4 c, a + 4 b + c and 3 a + b + 2 c, divided by 2.
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    once = a + b + c
    twice = np.stack([once + 2 * a + b, once + 3 * c, once + 3 * b, once + 2 * a + c], axis=1)
    return twice >> 1


@dataclass(frozen=True, eq=False)
class QuarterData:
    """Averages on the quarters of n cells."""

    K: np.ndarray  #: (4, n), mean of the conductivity
    resistivity: np.ndarray  #: (4, n), mean of its inverse; zero where that is infinite

    @classmethod
    def of(cls, mean_K: np.ndarray, mean_inverse_K: np.ndarray) -> "QuarterData":
        """From the two means (4, n)."""
        return cls(mean_K, np.where(np.isfinite(mean_inverse_K), mean_inverse_K, 0.0))


@dataclass(frozen=True, eq=False)
class QuarterShape:
    """Products ∫ ∇λ·∇λ, each (n,), of the barycentric coordinates λ_b and λ_c of n triangles."""

    bb: np.ndarray  #: products λ_b λ_b
    bc: np.ndarray  #: products λ_b λ_c
    cc: np.ndarray  #: products λ_c λ_c
    sums: np.ndarray  #: of λ_b + λ_c with itself
    differences: np.ndarray  #: of λ_b - λ_c with itself
    #: ∫ |G|² with G_x = |∂λ_b/∂x| + |∂λ_c/∂x|, G_y alike: terms of the bubble functions
    plain: np.ndarray
    #: `plain` times the condition of the triangle: what `Energy.terms` is for v, for the bubbles
    terms: np.ndarray

    @classmethod
    def of(cls, x: np.ndarray, y: np.ndarray, blur: float = 0.0) -> "QuarterShape":
        """Products of triangles with corners a, b, c at (x, y), each (3, n), relative to one.

        `blur` is the largest error of a coordinate in units of the rounding unit.
        """
        # ∇λ is the opposite side, rotated, over twice the area.
        bx, by, cx, cy = x[0] - x[2], y[0] - y[2], x[1] - x[0], y[1] - y[0]
        twice = np.abs(bx * cy - by * cx)
        scale = 0.5 / twice
        bc = scale * (bx * cx + by * cy)
        px, py, mx, my = bx + cx, by + cy, bx - cx, by - cy
        Gx, Gy = np.abs(by) + np.abs(cy), np.abs(bx) + np.abs(cx)
        uncertain = (np.abs(bx * cy) + np.abs(by * cx) + blur * (Gx + Gy)) / twice
        plain = scale * (Gx * Gx + Gy * Gy)
        Gx, Gy = uncertain * Gx + 2 * blur, uncertain * Gy + 2 * blur
        return cls(
            bb=scale * (bx * bx + by * by),
            bc=bc,
            cc=scale * (cx * cx + cy * cy),
            sums=scale * (px * px + py * py),
            differences=scale * (mx * mx + my * my),
            plain=plain,
            terms=scale * (Gx * Gx + Gy * Gy),
        )

    def slopes(self, corner_values: np.ndarray, K: np.ndarray) -> tuple[np.ndarray, ...]:
        """∫ K ∇φ·∇v, each (n,), for the bubble functions φ of m, e and d.

        Each bubble function is twice a sum of barycentric coordinates: for m it is 2 λ_c on the
        half (m, a, b) and 2 λ_b on the other half; for d it is 2 (λ_b - λ_c) on (d, m, a) and 2 λ_a
        on (d, b, m); for e it is 2 λ_a on (e, m, c) and 2 (λ_c - λ_b) on (e, a, m). v has the
        corner values (n, 3), and the quarters the coefficients K (4, n).
        """
        # Use differences of the corner values: a common constant then cancels exactly.
        v_a, v_b, v_c = corner_values.T
        v_b, v_c = (v_b - v_a) / 2, (v_c - v_a) / 2
        along_b, along_c = self.bb * v_b + self.bc * v_c, self.bc * v_b + self.cc * v_c
        plus, minus = along_b + along_c, along_b - along_c
        return (
            (K[1] + K[3]) * along_b + (K[0] + K[2]) * along_c,
            -(K[1] * plus + K[3] * minus),
            K[0] * minus - K[2] * plus,
        )

    def stiffness(self, K: np.ndarray) -> tuple[np.ndarray, ...]:
        """∫ K |∇φ|², each (n,), for the bubbles of m, e and d."""
        return (
            (K[0] + K[2]) * self.cc + (K[1] + K[3]) * self.bb,
            K[1] * self.sums + K[3] * self.differences,
            K[0] * self.differences + K[2] * self.sums,
        )

    def couplings(self, K: np.ndarray) -> tuple[np.ndarray, ...]:
        """∫ K ∇φ·∇χ, each (n,), for the bubble φ of m and the bubbles χ of e and d."""
        return (
            K[3] * (self.bc - self.bb) - K[1] * (self.bc + self.bb),
            K[0] * (self.bc - self.cc) - K[2] * (self.bc + self.cc),
        )
