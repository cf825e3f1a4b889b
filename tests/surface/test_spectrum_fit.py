"""Hurst exponent and cut-offs fitted to surfaces for which they are known.

The fit states a standard deviation, derived from the number of waves. Over seeds the error divided
by that deviation must have a mean near 0 and a spread near 1.
"""

from functools import partial

import numpy as np
import pytest
from known_answers import of_slope
from scipy.optimize import minimize_scalar

from fem_seal.errors import NotConverged
from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, fit_spectrum, self_affine
from fem_seal.surface.spectrum_fit import BIN_RATIO, _bins, _rings, _windowed

SEEDS = range(12)
# Means of 12 standard normal numbers stay below 4 / √12, their root mean squares below 1.9
# (χ² of 12 below 43: one in 30 000); the lower end catches errors that are claimed too large.
MEAN, SPREAD = 4 / len(SEEDS) ** 0.5, (0.35, 1.9)


def fitted(n, piece, seed, *band):
    """Fit to a piece of a surface of n samples a side whose waves end at 4 samples."""
    heights = self_affine(Spectrum(*band), (n, n), (n, n), rms_slope=0.1, seed=seed)
    return fit_spectrum(GridField(heights.values[:piece, :piece], (1.0, 1.0), piece == n))


@pytest.mark.parametrize(
    ("n", "piece", "hurst", "long", "rolloff"),
    [(128, 128, 0.3, 32, None), (256, 256, 0.8, 64, 16.0), (512, 128, 0.8, 512, None)],
)
def test_hurst_and_cut_offs(n, piece, hurst, long, rolloff):
    """A window correlates the waves of a piece; its long cut-off is longer than the piece."""
    fits = [fitted(n, piece, seed, hurst, long, 4.0, rolloff) for seed in SEEDS]
    errors = [[(fit.hurst - hurst) / fit.hurst_error for fit in fits]]
    if rolloff:
        errors.append([(fit.rolloff_wavelength - rolloff) / fit.rolloff_error for fit in fits])
    for z in map(np.array, errors):
        assert abs(z.mean()) < MEAN
        assert SPREAD[0] < np.sqrt(np.mean(z**2)) < SPREAD[1]
    for seed, fit in zip(SEEDS, fits, strict=True):
        assert (fit.rolloff_wavelength is None) == (rolloff is None), seed
        # The bin that holds the cut-off: 6 % of wavelength. A window smears it over two waves of
        # the piece, there as wide as a bin.
        bins = 1 if piece == n else 2
        assert abs(np.log(fit.short_wavelength / 4.0)) < bins * np.log(BIN_RATIO), seed
        if piece < n:
            assert fit.long_wavelength is None, seed
        else:  # within one ring of the grid
            assert abs(n / fit.long_wavelength - n / long) <= 1, seed


def test_a_roll_off_that_is_not_found_is_an_error(monkeypatch):
    fewer = partial(minimize_scalar, options={"maxiter": 1})
    monkeypatch.setattr("scipy.optimize.minimize_scalar", fewer)
    with pytest.raises(NotConverged, match="roll-off of the spectrum was not found: Max"):
        fitted(256, 256, 0, 0.8, 64, 4.0, 16.0)


def test_reported_error_is_the_scatter_over_seeds():
    """The rms of 64 standard normal numbers scatters by 1/√128."""
    n, hurst = 64, 0.8
    fits = [fitted(n, n, 100 + seed, hurst, n / 4, 4.0) for seed in range(64)]
    z = [(fit.hurst - hurst) / fit.hurst_error for fit in fits]
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1, abs=4 / 128**0.5)


def test_bins_have_no_bias_and_the_reported_variance():
    """ln C of white noise, where every wave has σ² dx² / (2π)²; four waves in the first ring.

    Over N seeds means lie within 4 standard errors and variances within 5 · √(2/N), wider than
    normal because logarithms of few exponential numbers have heavier tails.
    """
    seeds = 1600
    values = []
    for seed in range(seeds):
        noise = np.random.default_rng(seed).normal(size=(16, 16))
        spectrum = _rings(GridField(noise, (1.0, 1.0), periodic=True))
        _, y, variance = _bins(spectrum, spectrum.modes / 2)
        values.append(y - np.log(1 / (2 * np.pi) ** 2))
    values = np.array(values)
    assert np.all(np.abs(values.mean(axis=0)) < 4 * np.sqrt(variance / seeds))
    np.testing.assert_allclose(values.var(axis=0), variance, rtol=5 * (2 / seeds) ** 0.5)


def test_density_is_that_of_the_ensemble():
    """The fitted C(q) itself, within four standard deviations of its level at each end."""
    spectrum = of_slope(Spectrum(0.8, 64, 4.0), 0.1)
    fit = fit_spectrum(
        self_affine(spectrum, (256, 256), (256, 256), rms_slope=0.1, scaling="ensemble", seed=2)
    )
    inside = (fit.wavenumber > 2 * np.pi / 60) & (fit.wavenumber < 2 * np.pi / 4.2)
    ratio = np.log(fit.density[inside] / spectrum.density(fit.wavenumber[inside]))
    octaves = np.log(fit.wavenumber[inside][-1] / fit.wavenumber[inside][0])
    assert np.abs(ratio).max() < 4 * 2 * fit.hurst_error * octaves


def test_power_law_over_all_rings_has_no_cut_off():
    spectrum = Spectrum(0.7, 128, 1.0)
    fit = fit_spectrum(self_affine(spectrum, (128, 128), (128, 128), rms_slope=0.1, seed=3))
    assert (fit.long_wavelength, fit.short_wavelength) == (None, None)
    assert abs(fit.hurst - 0.7) < 4 * fit.hurst_error


def test_noise_floor_is_a_cut_off():
    """The power law ends where it falls to the white noise of the instrument.

    Over 40 seeds it is cut off at 1.26 times the wavelength where both meet, ± 6 %. There their
    powers add up, which flattens its fall: H is 0.70 ± 0.02. Four times both is allowed.
    """
    clean = self_affine(Spectrum(0.8, 64, 2.0), (256, 256), (256, 256), rms_height=1.0, seed=5)
    noise = np.random.default_rng(5).normal(scale=0.2, size=clean.shape)
    fit = fit_spectrum(GridField(clean.values + noise, clean.spacing, periodic=True))
    # C_noise = σ² dx² / (2π)²; the power law meets it here.
    floor = 0.2**2 / (2 * np.pi) ** 2
    scaled = Spectrum(0.8, 64, 2.0, plateau=1 / Spectrum(0.8, 64, 2.0).moment(0))
    q = np.geomspace(0.1, np.pi, 1000)
    meeting = 2 * np.pi / q[np.argmin(np.abs(np.log(scaled.density(q) / floor)))]
    assert fit.short_wavelength == pytest.approx(1.26 * meeting, rel=4 * 0.06)
    assert fit.hurst == pytest.approx(0.70, abs=4 * 0.02)


def test_window_keeps_the_power_of_white_noise():
    """Densities of a piece and of a cell then agree. Tolerance: 4 standard errors."""
    values = np.random.default_rng(1).normal(size=(200, 200))
    windowed, dependence = _windowed(GridField(values, (1, 1)))
    error = (2 * dependence / values.size) ** 0.5
    assert windowed.values.std() ** 2 == pytest.approx(values.std() ** 2, rel=4 * error)
