"""Mean of g³ along the link between two neighbouring samples with gaps a and b.

The rules differ where the gap changes much from one sample to the next. If the gap is linear along
the link, the resistance is proportional to the mean of g⁻³: rule "linear-gap".

A rule must not fall as either gap grows. The lift conducts by "linear-gap" or "arithmetic", which
it differentiates by the gaps (`network/network.py`).
"""

from collections.abc import Callable

import numpy as np

LinkRule = Callable[[np.ndarray, np.ndarray], np.ndarray]


def arithmetic(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(a³ + b³) / 2: halves of gaps a and b in parallel."""
    return 0.5 * (a**3 + b**3)


def harmonic(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """2 a³ b³ / (a³ + b³): halves of gaps a and b in series; exact for a stepwise gap."""
    return harmonic_mean(a**3, b**3)


def geometric(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(a b)^(3/2): cube of the geometric mean of the gaps."""
    return (np.sqrt(a) * np.sqrt(b)) ** 3


def linear_gap(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """2 a² b² / (a + b) = 1 / mean(g⁻³) of the gap that is linear from a to b."""
    return harmonic_mean(a, b) * a * b


def mean_gap(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """((a + b) / 2)³: cube of the gap half-way along the link."""
    return (0.5 * (a + b)) ** 3


def harmonic_mean(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """2 u v / (u + v), zero where u = v = 0; computed as u/(u + v) v, since u v could underflow."""
    total = u + v
    return 2 * np.divide(u, total, out=np.zeros_like(total), where=total > 0) * v


LINKS: dict[str, LinkRule] = {
    "linear-gap": linear_gap,
    "arithmetic": arithmetic,
    "harmonic": harmonic,
    "geometric": geometric,
    "mean-gap": mean_gap,
}
