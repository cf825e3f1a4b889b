"""Mosaics of patches against exact mixing rules; how often intervals hold the true mean."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ndtr
from scipy.stats import binom, hmean, norm, t

from fem_seal.errors import InvalidInput
from fem_seal.quantities.seal import MOSAIC_BIAS
from fem_seal.upscaling import mosaic
from fem_seal.upscaling.mosaic import (
    PatchCount,
    drawn_seals,
    error_of_mean,
    generalised_interval,
    lognormal_patches,
    may_conduct,
    mosaic_conductivity,
    patches_for,
    sealed_share,
)

MANY = 10_000  # patches around a seal


def test_layers():
    """Rows across the flow are in series, columns along it in parallel; a sealed row seals."""
    K = np.array([1.0, 3.0, 1e-9, 7.0])
    assert mosaic_conductivity(np.tile(K[:, None], (1, 5))) == pytest.approx(hmean(K), rel=1e-12)
    assert mosaic_conductivity(np.tile(K, (5, 1))) == pytest.approx(K.mean(), rel=1e-12)
    assert mosaic_conductivity(K[None]) == pytest.approx(K.mean(), rel=1e-12)
    K = np.ones((4, 6))
    K[2] = 0
    assert mosaic_conductivity(K) == 0
    K[2, 3] = 1e-12
    assert 0 < mosaic_conductivity(K) < 1e-11


def test_checkerboard():
    """√(ab) from below, with an error of the power -2λ of the nodes, tan(λπ/4) = √(a/b).

    p goes as r^λ about a corner of four patches (R. B. Kellogg, Appl. Anal. 4, 101 (1975)). The
    next term, of one power more, halves what is missing from the order each time; what is missing
    from a half is halved as well, or more. Half cells at the ends, which mirror the patches.
    """
    K = np.where(np.equal.outer([0, 1, 1, 0], [0, 0, 1, 1]), 1.0, 0.5)
    errors = [1 - mosaic_conductivity(K, nodes=n) / np.sqrt(0.5) for n in (2, 4, 8, 16)]
    orders = [np.log2(coarse / fine) for coarse, fine in pairwise(errors)]
    first, before, missing = 8 / np.pi * np.arctan(np.sqrt(0.5)) - np.array(orders)
    assert missing / before == pytest.approx(1 / 2, abs=abs(before / first - 1 / 2) / 2)


@pytest.mark.parametrize("sigma", [1.0, 1.9, 5.0])
def test_many_patches_conduct_their_geometric_mean(sigma):
    """From below, the more nodes the nearer (G. Matheron, 1967); the entry's factor holds the rest.

    The tolerance is four standard errors of the twenty mosaics, whose own means differ.
    """
    normal = np.random.default_rng(0).normal(size=(20, 40, 16))
    K = np.exp(sigma * (normal - normal.mean()))
    few, default, many = (np.log(mosaic_conductivity(K, nodes=n)) for n in (1, 2, 4))
    assert np.all(few < default)
    assert np.all(default < many)
    error = 4 * many.std() / np.sqrt(len(K))
    assert many.mean() < error
    assert 0 < -default.mean() < MOSAIC_BIAS * sigma**2


def test_one_patch_along_the_path_is_the_mean():
    rates = np.array([[1, 2, 3], [0, 0, 0], [4, 5, 6]], dtype=float)
    mean, scatter = drawn_seals(rates, PatchCount(1, 100), np.random.default_rng(0))
    assert mean.tolist() == rates.mean(axis=0).tolist()
    # The mean of 100 patches scatters a tenth as much as one.
    assert scatter == pytest.approx(rates[:, 1].std() / rates[:, 1].mean() / 10)


def test_mean_of_the_drawn_seals_errs_as_said():
    """A standard deviation from n seeds scatters by 1/√(2n - 2): four of them are allowed."""
    values = lognormal_patches((6, 1), 1.0, 0.8, np.random.default_rng(5)) * np.ones(3)
    count, seeds = PatchCount(3, 640), 30
    drawn = [drawn_seals(values, count, np.random.default_rng(seed)) for seed in range(seeds)]
    means = np.array([mean[1] for mean, _ in drawn])
    claimed = np.mean([error_of_mean(scatter, count) for _, scatter in drawn])
    assert means.std(ddof=1) / means.mean() == pytest.approx(
        claimed, rel=4 / np.sqrt(2 * seeds - 2)
    )


def test_bounds_of_patches_are_bounds_of_the_seal():
    """The mosaic's leak rate is linear in all: whatever the bounds, the values scatter alike."""
    values = lognormal_patches((6, 1), 1.0, 0.8, np.random.default_rng(5))
    (_, narrow), (mean, wide) = (
        drawn_seals(values * bounds, PatchCount(5, 40), np.random.default_rng(0))
        for bounds in (np.ones(3), np.array([0.1, 1.0, 3.0]))
    )
    assert mean / mean[1] == pytest.approx([0.1, 1.0, 3.0], rel=1e-10)
    assert wide == pytest.approx(narrow, rel=1e-10)


@pytest.mark.parametrize(
    ("along", "sigma", "leaking", "patches"),
    # In the last of single patches hardly anything but the share of sealed ones scatters.
    [
        *((1, 0.4, 1.0, 20), (1, 0.9, 1.0, 20), (1, 1.9, 0.85, 20), (1, 0.9, 1.0, 8)),
        (1, 0.1, 0.7, 20),
        *(
            pytest.param(4, *case, 20, marks=pytest.mark.slow)
            for case in ((0.4, 1.0), (0.9, 1.0), (1.9, 0.85))
        ),
    ],
)
def test_intervals_cover(monkeypatch, along, sigma, leaking, patches):
    """As many of 200 intervals of 95 % hold the mean as a binomial number in 99.7 % of all cases;
    of four patches along the path the truth is the mean of 300 blocks."""
    rng = np.random.default_rng(10 if along == 1 else 11)
    exact = leaking * np.exp(sigma**2 / 2)
    if along > 1:
        blocks = (lognormal_patches((along, 16), sigma, leaking, rng) for _ in range(300))
        exact = np.mean([mosaic_conductivity(block) for block in blocks])
    monkeypatch.setattr(mosaic, "PIVOTS", 2000)
    monkeypatch.setattr(mosaic, "PIVOTS_OF_MOSAICS", 100)
    covered = []
    for repeat in range(200):
        sample = lognormal_patches((patches, 1), sigma, leaking, rng).ravel()
        lower, upper = generalised_interval(
            sample, PatchCount(along, MANY), np.random.default_rng(repeat)
        ).range
        covered.append(lower <= exact <= upper)
    fewest, most = binom.interval(0.997, len(covered), 0.95)
    assert fewest <= sum(covered) <= most


@pytest.mark.parametrize(
    ("size", "sigma", "leaking"), [((1, 1), 0.9, 1.0), ((1, 4), 1.9, 0.85), ((4, 2), 0.9, 1.0)]
)
def test_intervals_cover_seals_of_few_patches(monkeypatch, size, sigma, leaking):
    """Small seals differ: of 100 intervals as many hold one more seal, of other patches."""
    rng = np.random.default_rng(12)
    monkeypatch.setattr(mosaic, "PIVOTS", 500)
    covered = []
    for repeat in range(100):
        sample = lognormal_patches((20, 1), sigma, leaking, rng).ravel()
        count, pivots = PatchCount(*size), np.random.default_rng(repeat)
        lower, upper = generalised_interval(sample, count, pivots).range
        seal = mosaic_conductivity(lognormal_patches(size, sigma, leaking, rng))
        covered.append(lower <= seal <= upper)
    fewest, _ = binom.interval(0.997, len(covered), 0.95)
    assert fewest <= sum(covered)


@pytest.mark.parametrize("patches", [3, 6])
def test_interval_is_that_of_the_likelihood(patches):
    """Without a mosaic its ends are quantiles under p(μ, σ) ∝ likelihood/σ, here by quadrature.

    The ends come from 20 000 draws: their probability is off by √(0.025 × 0.975/20000) = 0.0011.
    """
    rates = np.exp(0.5 * np.random.default_rng(4).standard_normal(patches))
    logs = np.log(rates)
    squares = ((logs - logs.mean()) ** 2).sum()

    def density(log_sigma):  # of σ dσ/σ, μ integrated out
        return np.exp(-(patches - 1) * log_sigma - squares / (2 * np.exp(2 * log_sigma)))

    def below(q):
        def part(t):
            z = (np.log(q) - np.exp(2 * t) / 2 - logs.mean()) * np.sqrt(patches) / np.exp(t)
            return density(t) * ndtr(z)

        return quad(part, -6, 6, limit=400)[0] / quad(density, -6, 6, limit=400)[0]

    found = generalised_interval(rates, PatchCount(1, MANY), np.random.default_rng(0))
    assert below(found.lower) == pytest.approx(0.025, abs=0.0045)
    assert below(found.upper) == pytest.approx(0.975, abs=0.0045)


def test_rates_without_an_interval():
    """Too few that leak, and none that can be."""
    rng = np.random.default_rng(0)
    assert generalised_interval([1.0, 2.0, 0.0, 0.0], PatchCount(1, MANY), rng) is None
    with pytest.raises(InvalidInput, match="not negative"):
        generalised_interval([-1.0, 2.0, 3.0], PatchCount(1, MANY), rng)


def test_share_of_sealed_patches():
    """Closed forms of none and all: 1 - 0.025^(1/n)."""
    edge = 1 - 0.025 ** (1 / 8)
    assert sealed_share(0, 8).range == pytest.approx((0, edge))
    assert sealed_share(8, 8).range == pytest.approx((1 - edge, 1))


@pytest.mark.parametrize("sigma", [0.4, 0.9])
def test_patches_for_a_narrow_interval(sigma):
    """With so many patches the median interval is a factor of 2 wide, or somewhat more.

    At σ = 0.4 they are 6, whose scatter is hardly known: Student's quantile of 5 degrees of freedom
    is 1.3 times that of the normal distribution. The median of the estimated scatter is 7 % below
    σ, and that of 100 samples errs by 4 %.
    """
    rng = np.random.default_rng(4)
    number = patches_for(sigma, 2.0)
    widths = []
    for repeat in range(100):
        sample = lognormal_patches((number, 1), sigma, 1.0, rng).ravel()
        lower, upper = generalised_interval(
            sample, PatchCount(1, MANY), np.random.default_rng(repeat)
        ).range
        widths.append(np.log(upper / lower))
    student = t.ppf(0.975, number - 1) / norm.ppf(0.975)
    assert np.median(widths) == pytest.approx(student * np.log(2), rel=0.07 + 2 * 0.04)


def test_paths_of_leaking_patches():
    """Sites of a square lattice percolate at a share of 0.593; one row leaks if any patch does."""
    long, row = PatchCount(40, 1000), PatchCount(1, 1000)
    assert may_conduct(1.0, long)
    assert may_conduct(0.75, long)
    assert not may_conduct(0.4, long)
    assert may_conduct(0.1, row)
    assert not may_conduct(0.0, row)
