"""Fourier resampling keeps the trigonometric interpolant of the samples."""

import numpy as np
import pytest

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, resample, rms_height, rms_slope, self_affine


@pytest.fixture(scope="module")
def surface():
    return self_affine(Spectrum(0.8, 1 / 4, 1 / 15), (40, 36), (1, 1), rms_slope=1, seed=4)


@pytest.mark.parametrize("shape", [(80, 72), (120, 36), (41, 37), (160, 144), (97, 101)])
def test_up_and_back(surface, shape):
    fine = resample(surface, shape)
    assert rms_height(fine) == pytest.approx(rms_height(surface), rel=1e-12)
    assert rms_slope(fine) == pytest.approx(rms_slope(surface), rel=1e-12)
    back = resample(fine, surface.shape)
    assert np.abs(back.values - surface.values).max() < 1e-14
    assert fine.size == pytest.approx(surface.size)


def test_integer_refinement_interpolates():
    """The samples do not change, also with the Nyquist modes of white noise."""
    noise = GridField(np.random.default_rng(0).normal(size=(16, 12)), (1.0, 1.0), periodic=True)
    assert np.abs(resample(noise, (48, 24)).values[::3, ::2] - noise.values).max() < 1e-14


def test_coarsening_a_cosine():
    x = np.arange(64) / 64
    long, short = np.cos(2 * np.pi * 3 * x), np.cos(2 * np.pi * 20 * x)
    field = GridField(np.add.outer(long + short, np.zeros(8)), (1.0, 1.0), periodic=True)
    coarse = resample(field, (32, 8))
    assert np.abs(coarse.values - long[::2, None]).max() < 1e-13


def test_refused(surface):
    with pytest.raises(InvalidInput, match="periodic"):
        resample(GridField(surface.values, (1.0, 1.0)), (80, 80))
    with pytest.raises(InvalidInput, match="shape"):
        resample(surface, (0, 10))
