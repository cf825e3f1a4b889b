"""Fourier resampling keeps the trigonometric interpolant of the samples."""

import numpy as np
import pytest

from fem_seal.grid import GridField
from fem_seal.surface import resample

NOISE = GridField(np.random.default_rng(0).normal(size=(16, 12)), (1.0, 2.0), periodic=True)


@pytest.mark.parametrize("shape", [(48, 24), (48, 12), (17, 25)])
def test_a_finer_grid_has_the_same_waves(shape):
    """The samples do not change, also with the Nyquist modes of white noise."""
    fine = resample(NOISE, shape)
    assert fine.size == pytest.approx(NOISE.size)
    back = resample(GridField(fine.values, fine.spacing, True), (3 * 16, 2 * 12))
    np.testing.assert_allclose(back.values[::3, ::2], NOISE.values, rtol=0, atol=1e-14)


@pytest.mark.parametrize("axis", [0, 1])
def test_waves_at_and_above_the_nyquist_wavenumber_are_left_out(axis):
    x = 2 * np.pi * np.arange(64) / 64
    values = np.add.outer(np.cos(3 * x) + np.cos(16 * x) + np.cos(20 * x), np.zeros(64))
    field = GridField(values if axis == 0 else values.T, (1.0, 1.0), periodic=True)
    coarse = resample(field, (32, 32)).values
    coarse = coarse if axis == 0 else coarse.T
    assert np.abs(coarse - np.cos(3 * x)[::2, None]).max() < 1e-13
