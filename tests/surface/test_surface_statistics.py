"""Statistics and spectra of known fields; resampling and twins, which keep the waves."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from fem_seal.grid import GridField
from fem_seal.surface import (
    MapStatistics,
    Spectrum,
    radial_spectrum,
    resample,
    rms_height,
    rms_slope,
    twin,
)
from fem_seal.surface.spectrum import mode_powers, wavenumbers


def noise(shape):
    """White noise, which contains every mode, also the Nyquist modes."""
    values = np.random.default_rng(0).normal(size=shape)
    return GridField(values, (0.5, 2.0), periodic=True)


@pytest.mark.parametrize("shape", [(16, 16), (15, 17), (16, 9), (9, 16), (1, 8), (8, 1)])
def test_parseval(shape):
    """The waves hold the variance, one by one and in rings."""
    field = noise(shape)
    assert mode_powers(field).sum() == pytest.approx(rms_height(field) ** 2, rel=1e-13)
    rings = radial_spectrum(field)
    cell = (2 * np.pi) ** 2 / (field.size[0] * field.size[1])
    assert np.sum(rings.density * rings.modes) * cell == pytest.approx(rms_height(field) ** 2)
    assert rings.modes.sum() == field.values.size - 1


def test_rings_of_a_steep_power_law():
    """Waves of exactly C = q^-p: with the exponent p each ring has C of its wavenumber.

    The plain mean of a ring lies above, by p (p + 1) / 2 times the variance of q over q²: several
    per cent for the first rings, which are one step of wavenumber wide.
    """
    n, p = 32, 3.6
    white = np.fft.rfft2(np.random.default_rng(1).normal(size=(n, n)))
    q = wavenumbers((n, n), (1.0, 1.0))
    q[0, 0] = np.inf
    modes = white / np.abs(white) * q ** (-p / 2) * n**2
    field = GridField(np.fft.irfft2(modes), (1.0, 1.0), periodic=True)
    # |h̃|² = q^-p times the area of the cell over (2π)².
    level = n**2 / (2 * np.pi) ** 2
    sloped, plain = radial_spectrum(field, p), radial_spectrum(field)
    exact = level * sloped.wavenumber**-p
    np.testing.assert_allclose(sloped.density, exact, rtol=1e-10)
    assert plain.density[1] > 1.02 * exact[1]


def test_slope_of_a_wave():
    x = np.arange(24) / 24 * 3.0
    y = np.arange(20) / 20 * 2.0
    phase = 2 * np.pi * (2 * x[:, None] / 3 + 3 * y[None, :] / 2)
    field = GridField(0.7 * np.sin(phase), (3 / 24, 2 / 20), periodic=True)
    q = 2 * np.pi * np.hypot(2 / 3, 3 / 2)
    assert rms_slope(field) == pytest.approx(0.7 * q / 2**0.5, rel=1e-12)


def test_statistics_of_a_wave():
    """rms height A/√2; differences of sin by d have the rms of its slope times sinc(q d / 2)."""
    n, periods, amplitude = 64, 4, 3.0
    q = 2 * np.pi * periods / n
    wave = amplitude * np.sin(q * np.arange(n))
    field = GridField(np.repeat(wave[:, None], 5, axis=1), (0.5, 1.0), periodic=True)
    statistics = MapStatistics.of(field)
    assert statistics.rms_height == pytest.approx(amplitude / 2**0.5, rel=1e-14)
    # All n differences of the closed wave; the n - 1 inside lack one of them.
    every = np.diff(wave, append=wave[0]) ** 2
    slope = ((every.sum() - every[-1]) / (n - 1)) ** 0.5 / 0.5
    assert statistics.rms_slope == pytest.approx(slope, rel=1e-13)
    assert every.mean() == pytest.approx((2 * np.sin(q / 2) * amplitude) ** 2 / 2, rel=1e-13)
    assert (statistics.samples, statistics.missing) == ((64, 5), 0)


@pytest.mark.parametrize("scale", [1.0, 1e-120])
def test_skewness_of_two_levels(scale):
    """Share p of a plateau above pits: (1 - 2p)/√(p (1 - p)), also where cubes underflow."""
    heights = np.where(np.arange(100) < 80, 1.0, 0.0)[:, None] * np.ones(4) * scale
    statistics = MapStatistics.of(GridField(heights, (1.0, 1.0)))
    assert statistics.skewness == pytest.approx(-0.6 / 0.16**0.5, rel=1e-12)
    assert MapStatistics.of(GridField(0 * heights, (1.0, 1.0))).skewness == 0


BANDS = [(1.0, 0.01, None), (1.0, 0.01, 0.2), (3e-4, 2e-6, 5e-5)]


@pytest.mark.parametrize("hurst", [0.1, 0.4, 0.8, 1.0])
@pytest.mark.parametrize("band", BANDS)
@pytest.mark.parametrize("order", [0, 2, 4])
def test_moments_against_quadrature(hurst, band, order):
    long, short, rolloff = band
    spectrum = Spectrum(hurst, long, short, rolloff, plateau=3.0)
    q_long, q_rolloff, q_short = spectrum.wavenumbers

    def integrand(log_q):
        q = np.exp(log_q)
        return 2 * np.pi * q ** (2 + order) * float(spectrum.density(q))

    limits = np.log([q_long, q_rolloff, q_short])
    parts = [quad(integrand, a, b, epsrel=1e-11)[0] for a, b in pairwise(limits)]
    # The density's band is 1e-12 wider than the cut-offs: far below quad's 1e-11.
    assert spectrum.moment(order) == pytest.approx(sum(parts), rel=1e-9)


def test_power_law_plateau_and_cut_offs():
    spectrum = Spectrum(0.8, 1.0, 0.01, 0.1, plateau=5.0)
    q_long, q_rolloff, q_short = spectrum.wavenumbers
    q = np.array([0.99 * q_long, q_long, q_rolloff, 3 * q_rolloff, q_short, 1.01 * q_short])
    expected = np.array([0, 5, 5, 5 * 3**-3.6, 5 * (q_short / q_rolloff) ** -3.6, 0])
    assert spectrum.density(q) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("shape", [(48, 24), (48, 12), (17, 25)])
def test_a_finer_grid_has_the_same_waves(shape):
    """The samples do not change, also with the Nyquist modes of white noise."""
    field = noise((16, 12))
    fine = resample(field, shape)
    assert fine.size == pytest.approx(field.size)
    back = resample(GridField(fine.values, fine.spacing, True), (3 * 16, 2 * 12))
    np.testing.assert_allclose(back.values[::3, ::2], field.values, rtol=0, atol=1e-14)


@pytest.mark.parametrize("axis", [0, 1])
def test_waves_at_and_above_the_nyquist_wavenumber_are_left_out(axis):
    x = 2 * np.pi * np.arange(64) / 64
    values = np.add.outer(np.cos(3 * x) + np.cos(16 * x) + np.cos(20 * x), np.zeros(64))
    field = GridField(values if axis == 0 else values.T, (1.0, 1.0), periodic=True)
    coarse = resample(field, (32, 32)).values
    coarse = coarse if axis == 0 else coarse.T
    assert np.abs(coarse - np.cos(3 * x)[::2, None]).max() < 1e-13


def grooved(shape):
    """Far from Gaussian: ground grooves with plateaus, and a mean height."""
    rng = np.random.default_rng(7)
    values = np.minimum(rng.normal(size=shape[0])[:, None] + 0.1 * rng.normal(size=shape), 0.5)
    return GridField(1.5 + values, (1.0, 2.0), periodic=True)


@pytest.mark.parametrize("shape", [(32, 24), (31, 24), (32, 23), (15, 17), (1, 8)])
def test_same_power_in_every_wave(shape):
    """Also for an anisotropic surface and Nyquist waves, to the rounding of two transforms."""
    field = grooved(shape)
    other = twin(field, 3)
    powers = mode_powers(field)
    atol = 1e-14 * powers.max()
    np.testing.assert_allclose(mode_powers(other), powers, rtol=1e-11, atol=atol)
    assert other.values.mean() == pytest.approx(field.values.mean(), rel=1e-13)
    assert rms_height(other) == pytest.approx(rms_height(field), rel=1e-13)
    assert rms_slope(other) == pytest.approx(rms_slope(field), rel=1e-13)
    assert other.spacing == field.spacing
    assert np.array_equal(twin(field, 3).values, other.values)


def test_phases_are_random():
    """φ, phase of twin minus that of surface or other twin: e^{iφ} is 0 in the mean to 4/√modes."""
    field = grooved((64, 64))
    other = twin(field, 1)
    modes = (np.fft.rfft2(f.values)[1:, 1:-1] for f in (field, other, twin(field, 2)))
    for a, b in combinations(modes, 2):
        difference = np.exp(1j * (np.angle(a) - np.angle(b)))
        assert abs(difference.mean()) < 4 / difference.size**0.5
    # A Gaussian surface has no skewness; this one was cut off at the top.
    skewness = [float(np.mean((f.values - f.values.mean()) ** 3)) for f in (field, other)]
    assert abs(skewness[1]) < 0.5 * abs(skewness[0])
