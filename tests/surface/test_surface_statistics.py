"""Parseval's identity, slopes and radial spectrum of fields with known answers."""

import numpy as np
import pytest

from fem_seal.grid import GridField
from fem_seal.surface import (
    MapStatistics,
    radial_spectrum,
    rms_height,
    rms_slope,
)
from fem_seal.surface.spectrum import mode_powers, wavenumbers


def noise(shape):
    """White noise, which contains every mode, also the Nyquist modes."""
    values = np.random.default_rng(0).normal(size=shape)
    return GridField(values, (0.5, 2.0), periodic=True)


@pytest.mark.parametrize("shape", [(16, 16), (15, 17), (16, 9), (9, 16), (1, 8), (8, 1)])
def test_parseval(shape):
    field = noise(shape)
    assert mode_powers(field).sum() == pytest.approx(rms_height(field) ** 2, rel=1e-13)


@pytest.mark.parametrize("shape", [(16, 16), (15, 17)])
def test_radial_spectrum_integrates_to_the_variance(shape):
    field = noise(shape)
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


def test_skewness_of_a_smooth_face():
    assert MapStatistics.of(GridField(np.ones((3, 3)), (1.0, 1.0))).skewness == 0
