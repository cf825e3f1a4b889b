"""A twin has the power of every wave of the surface, and independent phases."""

import numpy as np
import pytest

from fem_seal.grid import GridField
from fem_seal.surface import rms_height, rms_slope, twin
from fem_seal.surface.spectrum import mode_powers


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


def test_phases_are_random():
    """φ, phase of twin minus phase of surface: the mean of e^{iφ} is within 4/√modes of 0."""
    field = grooved((64, 64))
    other = twin(field, 1)
    a, b = (np.fft.rfft2(f.values)[1:, 1:-1] for f in (field, other))
    difference = np.exp(1j * (np.angle(a) - np.angle(b)))
    assert abs(difference.mean()) < 4 / difference.size**0.5
    # A Gaussian surface has no skewness; this one was cut off at the top.
    skewness = [float(np.mean((f.values - f.values.mean()) ** 3)) for f in (field, other)]
    assert abs(skewness[1]) < 0.5 * abs(skewness[0])


def test_seed():
    field = grooved((16, 16))
    assert np.array_equal(twin(field, 5).values, twin(field, 5).values)
    assert not np.allclose(twin(field, 5).values, twin(field, 6).values)
