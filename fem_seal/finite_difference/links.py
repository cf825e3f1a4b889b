"""What a link between two neighbouring samples conducts: the mean of the cubed gap along it.

The rules differ where the gap changes much from one sample to the next. For a gap that is linear
between its samples only "linear-gap" is exact in series, 1 / mean(g^-3).
"""

from collections.abc import Callable

import numpy as np

LinkRule = Callable[[np.ndarray, np.ndarray], np.ndarray]


def arithmetic(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(a³ + b³) / 2: the two ends' halves side by side."""
    return 0.5 * (a**3 + b**3)


def harmonic(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """2 a³ b³ / (a³ + b³): the two ends' halves in series; exact for a stepwise gap."""
    return _half_harmonic_mean(a**3, b**3)


def geometric(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cube of the geometric mean gap, (a b)^(3/2)."""
    return (np.sqrt(a) * np.sqrt(b)) ** 3


def linear_gap(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """2 a² b² / (a + b) = 1 / mean(g⁻³) of the gap that is linear from a to b."""
    return _half_harmonic_mean(a, b) * a * b


def mean_gap(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cube of the gap half-way, ((a + b) / 2)³."""
    return (0.5 * (a + b)) ** 3


def _half_harmonic_mean(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """2 u v / (u + v), zero where both are; u / (u + v) first, so that nothing underflows."""
    total = u + v
    return 2 * np.divide(u, total, out=np.zeros_like(total), where=total > 0) * v


LINKS: dict[str, LinkRule] = {
    "linear-gap": linear_gap,
    "arithmetic": arithmetic,
    "harmonic": harmonic,
    "geometric": geometric,
    "mean-gap": mean_gap,
}
