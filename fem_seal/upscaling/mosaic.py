"""Many patches of rough contact side by side: conductivity and scatter of such mosaics.

The mean over patches is right only where one patch spans the leak path. With m patches along it and
n across, a sealed patch blocks the patches before and behind it, and the fluid flows around patches
that leak little. Each patch is a square of constant conductivity, cut into nodes, whose elimination
yields the conductance of the mosaic at any contrast. For many log-normal patches, none of them
sealed, exp<ln K> is exact (G. Matheron 1967). With the default of 2 × 2 nodes for each patch, the
conductivity of the mosaic is below it by 6 % at a scatter of ln K of 1, and by 17 % at 1.9.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_seal.arguments import require_count
from fem_seal.error_budget import MOST_LOG
from fem_seal.errors import InvalidInput
from fem_seal.finite_difference.links import harmonic_mean
from fem_seal.finite_difference.star_mesh import star_mesh
from fem_seal.leak_rate import Bounded

NODES = 2  # nodes along a side of a patch
# Most patches of a drawn mosaic along the path and across it. More patches along the path change
# the conductivity little; a wider seal is an average of independent blocks of this width.
MOST_ALONG, BLOCK = 40, 16
DRAWS = 24  # mosaics that are drawn for a seal
# Draws of the pivots of an interval: of single patches, and of mosaics, which cost more.
PIVOTS, PIVOTS_OF_MOSAICS = 20_000, 200
# Patches around a seal of one along the path up to which the seals of one scatter differ notably.
FEW_AROUND = 256
SEED = 0  # of all draws of a seal
# Largest standard deviation σ of ln K that is drawn. The mean of log-normal patches is exp(σ²/2)
# times their median: exp(200) here.
MOST_SCATTER = 20.0
DRAWN_BLOCKS = 100  # drawn blocks of a seal, through one of which leaking patches may conduct
CONFIDENCE = 0.95  # probability of a confidence interval
# Fewest leaking patches from which the scatter of their logarithms is estimated.
LEAST_LEAKING = 3


def mosaic_conductivity(conductivity: np.ndarray, *, nodes: int = NODES) -> np.ndarray:
    """Effective conductivity of mosaics of patches, each periodic across the flow.

    `conductivity` (..., m, n) are those of m patches along the flow and n across it, with some
    nodes along each side of a patch. The result (...) is the conductance between both ends times
    m/n.

    From the inlet on, the nodes of one row after the other are eliminated (`star_mesh`).
    """
    K = np.asarray(conductivity, dtype=float).repeat(nodes, axis=-2).repeat(nodes, axis=-1)
    *shape, m, n = K.shape
    K = K.reshape(-1, m, n)
    largest = K.max(axis=(1, 2))
    K = K / np.where(largest > 0, largest, 1.0)[:, None, None]
    along = [2 * K[:, :1], harmonic_mean(K[:, :-1], K[:, 1:]), 2 * K[:, -1:]]
    along, across = np.concatenate(along, axis=1), harmonic_mean(K, np.roll(K, -1, axis=2))
    row, right = np.arange(n), (np.arange(n) + 1) % n
    # Links between the nodes of a row and, last, the inlet.
    links = np.zeros((len(K), n + 1, n + 1))
    links[:, row, n] = links[:, n, row] = along[:, 0]
    for k in range(m):
        links[:, row, right] += across[:, k]
        links[:, right, row] += across[:, k]
        # Between the row and the inlet comes the next row, or the outlet, which is one node.
        following = row if k < m - 1 else np.zeros(n, dtype=int)
        size, own = n + following[-1] + 2, np.append(row, -1)
        joined = np.zeros((len(K), size, size))
        joined[:, own[:, None], own] = links
        joined[:, row, n + following] = joined[:, n + following, row] = along[:, k + 1]
        links = star_mesh(joined, n)
    return (links[:, 0, 1] * m / n * largest).reshape(shape)


@dataclass(frozen=True)
class PatchCount:
    """Number of patches of a seal."""

    #: patches along the part of the leak path that decides the leak rate, and around the seal
    along: int
    across: int

    def __post_init__(self) -> None:
        require_count(along=self.along, across=self.across)

    @classmethod
    def of(
        cls, sealing_length: float, circumference: float, patch: tuple[float, float]
    ) -> "PatchCount":
        """Count patches of a size (Lx, Ly) [m] along a length and a circumference [m]."""
        return cls(
            max(1, round(sealing_length / patch[0])), max(1, round(circumference / patch[1]))
        )


def _block(count: PatchCount) -> tuple[int, int]:
    """Patches of a drawn mosaic, along the path and across it."""
    return min(count.along, MOST_ALONG), min(count.across, BLOCK)


def drawn_seals(
    rates: np.ndarray, count: PatchCount, rng: np.random.Generator
) -> tuple[np.ndarray, float]:
    """Draw patches into the mosaic of a seal, again and again.

    `rates` (N, 3) are lower bound, value and upper bound of the leak rate that the seal would have
    if all its patches were alike, for each realization. Returns their means (3,) over the draws,
    and the standard deviation of a seal's leak rate over its mean. One realization, and one patch
    along the path, need no draws.
    """
    # Seals are drawn from these realizations: their own deviation is that of a draw.
    seals, independent, deviation = rates, float(count.across), np.std(rates[:, 1])
    if len(rates) > 1 and count.along > 1:
        shape = _block(count)
        chosen = rng.integers(len(rates), size=(DRAWS, *shape))
        seals = np.stack([mosaic_conductivity(of_side[chosen]) for of_side in rates.T], axis=1)
        independent, deviation = count.across / shape[1], np.std(seals[:, 1], ddof=1)
    mean = seals.mean(axis=0)
    scatter = deviation / np.sqrt(independent) / mean[1] if mean[1] > 0 else 0.0
    return mean, float(scatter)


def error_of_mean(relative_scatter: float, count: PatchCount) -> float:
    """Standard error of the mean of `DRAWS` mosaics over that mean, from the scatter of seals.

    A seal wider than a mosaic is an average of several, which scatters less than each.
    """
    return float(relative_scatter * np.sqrt(count.across / _block(count)[1] / DRAWS))


def generalised_interval(
    rates: Sequence[float] | np.ndarray, count: PatchCount, rng: np.random.Generator
) -> Bounded | None:
    """Median and confidence interval of the leak rate of a seal of so many patches, from a few.

    The leak rates of leaking patches are taken to be log-normal. Let ȳ and s² be mean and variance
    of the logarithms of the n leaking patches out of N. Generalised pivots are (K. Krishnamoorthy
    and T. Mathew, J. Stat. Plan. Inference 115, 103 (2003); L. Tian, Stat. Med. 24, 3223 (2005))

        σ² = s² (n - 1)/χ²(n - 1),  μ = ȳ + Z σ/√n,  leaking share δ ~ Beta(n + 1/2, N - n + 1/2).

    The interval lies between quantiles of δ exp(μ + σ²/2), the mean over patches, or, with several
    patches along the path or few around the seal, of the conductivity of mosaics of patches drawn
    with μ, σ and δ. None with fewer than three leaking patches, too few to estimate the scatter.
    """
    rates = np.asarray(rates, dtype=float)
    if not np.isfinite(rates).all() or rates.min(initial=0) < 0:
        raise InvalidInput("leak rates of patches must be finite numbers, not negative")
    logs = np.log(rates[rates > 0])
    leaking, sealed = logs.size, rates.size - logs.size
    if leaking < LEAST_LEAKING:
        return None
    draws = PIVOTS if count.along == 1 else PIVOTS_OF_MOSAICS
    sigma = logs.std(ddof=1) * np.sqrt((leaking - 1) / rng.chisquare(leaking - 1, draws))
    mu = logs.mean() + rng.standard_normal(draws) * sigma / np.sqrt(leaking)
    share = rng.beta(leaking + 0.5, sealed + 0.5, draws) if sealed else np.ones(draws)
    log_mean = mu + sigma**2 / 2 + np.log(share)
    if count.along > 1 or count.across <= FEW_AROUND:
        shape = _block(count) if count.along > 1 else (1, count.across)
        drawn = zip(np.minimum(sigma, MOST_SCATTER), share, strict=True)
        patches = np.array([lognormal_patches(shape, s, d, rng) for s, d in drawn])
        alike = patches.mean(axis=2)[:, 0] if count.along == 1 else mosaic_conductivity(patches)
        with np.errstate(divide="ignore"):
            log_mean = mu + np.log(alike)
    seals = np.exp(np.minimum(log_mean, MOST_LOG))
    tail = (1 - CONFIDENCE) / 2
    lower, median, upper = map(float, np.quantile(seals, [tail, 0.5, 1 - tail]))
    return Bounded(median, lower, upper)


def lognormal_patches(
    shape: tuple[int, int], sigma: float, leaking: float, rng: np.random.Generator
) -> np.ndarray:
    """Conductivities exp(σ Z) of patches; 0 for all but the `leaking` share of them."""
    K = np.exp(sigma * rng.standard_normal(shape))
    return np.where(rng.random(shape) < leaking, K, 0.0)


def sealed_share(sealed: int, patches: int) -> Bounded:
    """Share of sealed patches, and its confidence interval by Clopper and Pearson."""
    from scipy.stats import binomtest

    interval = binomtest(sealed, patches).proportion_ci(CONFIDENCE, method="exact")
    return Bounded(sealed / patches, float(interval.low), float(interval.high))


def may_conduct(leaking: float, count: PatchCount) -> bool:
    """Whether patches, of which a share leaks, conduct through one of many drawn blocks."""
    rng = np.random.default_rng(SEED)
    patches = [lognormal_patches(_block(count), 0.0, leaking, rng) for _ in range(DRAWN_BLOCKS)]
    return bool((mosaic_conductivity(np.array(patches), nodes=1) > 0).any())


def patches_for(sigma: float, factor: float) -> int:
    """Estimate how many leaking patches narrow the confidence interval of the mean to a factor.

    With n log-normal patches of scatter σ the logarithm of the estimated mean, ȳ + s²/2, has the
    variance (σ² + σ⁴/2)/n.
    """
    from scipy.stats import norm

    width = 2 * norm.ppf(0.5 + CONFIDENCE / 2) / np.log(factor)
    return max(LEAST_LEAKING, int(np.ceil(width**2 * (sigma**2 + sigma**4 / 2))))
