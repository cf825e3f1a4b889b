"""Elastic contact on small grids by dense linear algebra, without any code of fem_seal.

The samples F that carry pressure are guessed. Their pressures follow from one dense linear solve.
Then F loses the samples under tension and gains those that overlap, until nothing changes
(primal-dual active set method: M. Hintermüller, K. Ito, K. Kunisch, SIAM J. Optim. 13, 865 (2002)).
"""

from dataclasses import dataclass

import numpy as np

# Rounding of a dense solve, relative to the largest pressure or length in it.
ROUNDING = 1e-12
MOST_STEPS = 200


@dataclass(frozen=True)
class PlainLayer:
    """A layer on a rigid plane base, bonded to it or sliding on it without friction."""

    thickness: float
    base: str
    poisson_ratio: float

    def factor(self, q: np.ndarray) -> np.ndarray:
        """Compliance over that of the half-space (Johnson, Contact Mechanics, section 5.8)."""
        x = np.minimum(q * self.thickness, 50.0)  # from there on the factor is 1 to rounding
        if self.base == "sliding":
            return (np.cosh(2 * x) - 1) / (np.sinh(2 * x) + 2 * x)
        k = 3 - 4 * self.poisson_ratio
        return (2 * k * np.sinh(2 * x) - 4 * x) / (2 * k * np.cosh(2 * x) + 4 * x**2 + 1 + k**2)


def influence(
    shape: tuple[int, int], spacing: tuple[float, float], layer: PlainLayer | None = None
) -> np.ndarray:
    """S (n, n): displacement, zero in the mean, of each sample under unit pressure on another.

    E* = 1: a wave of pressure of wavenumber q causes the same wave of displacement times 2/q.
    """
    kx, ky = (2 * np.pi * np.fft.fftfreq(n, d) for n, d in zip(shape, spacing, strict=True))
    q = np.hypot(kx[:, None], ky[None, :])
    q[0, 0] = np.inf
    compliance = 2 / q
    if layer is not None:
        q[0, 0] = 1.0
        compliance *= layer.factor(q)
    kernel = np.fft.ifft2(compliance).real
    i, j = (index.ravel() for index in np.indices(shape))
    return kernel[(i[:, None] - i) % shape[0], (j[:, None] - j) % shape[1]]


def plain_contact(
    heights: np.ndarray,
    matrix: np.ndarray,
    *,
    pressure: float | None = None,
    mean_gap: float | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Pressure and gap, of the shape of the heights, under a mean pressure or at a mean gap.

    Raises
    ------
    RuntimeError
        If the sets do not become steady, or the result is no contact.
    """
    h = heights.ravel() - heights.mean()
    n, span = h.size, np.ptp(h)
    pressed = np.ones(n, bool) if mean_gap is None else h > mean_gap - 1e-3 * span
    for _ in range(MOST_STEPS):
        members = np.flatnonzero(pressed)
        p = np.zeros(n)
        block = matrix[np.ix_(members, members)]
        if mean_gap is None:
            # S p + separation = h on F, and the load.
            ones = np.ones((len(members), 1))
            system = np.block([[block, ones], [ones.T, np.zeros((1, 1))]])
            solution = np.linalg.solve(system, np.append(h[members], pressure * n))
            p[members], separation = solution[:-1], solution[-1]
        else:
            p[members], separation = np.linalg.solve(block, h[members] - mean_gap), mean_gap
        gap = matrix @ p - h + separation
        gap[members] = 0.0
        smallest_gap = ROUNDING * (span + np.abs(matrix @ p).max())
        tension = pressed & (p < -ROUNDING * np.abs(p).max())
        overlap = ~pressed & (gap < -smallest_gap)
        if not tension.any() and not overlap.any():
            return np.maximum(p, 0).reshape(heights.shape), gap.reshape(heights.shape)
        pressed = (pressed & ~tension) | overlap
        if not pressed.any():
            pressed[h.argmax()] = True
    raise RuntimeError("the plain contact solver did not become steady")
