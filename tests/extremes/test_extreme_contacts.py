"""Surfaces and loads at the ends of what can be asked for."""

import numpy as np
import pytest
from contact_cases import rough_surface

from fem_seal.contact import bearing, press
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField

E_STAR = 1e7  # Pa
TOLERANCE = 1e-6  # of the contact's certificate, the default
ROUGH = rough_surface((32, 32), long=16)


def test_loads():
    """From 1e-8 E* to 1e4 E*: at full contact the pressure varies by E* h'rms/2 = 0.05 E* rms, so
    that E* closes every gap."""
    areas = []
    for ratio in (1e-8, 1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4):
        state = press(ROUGH, E_STAR, pressure=ratio * E_STAR)
        assert state.certificate <= TOLERANCE
        # To the rounding of sums.
        assert state.mean_pressure == pytest.approx(ratio * E_STAR, rel=1e-9)
        areas.append(state.contact_area_fraction)
    assert areas == sorted(areas)
    assert areas[-3:] == [1, 1, 1]


def test_flat_surface():
    """Everything touches at once."""
    flat = GridField(np.zeros((16, 16)), (1e-6, 1e-6), periodic=True)
    state = press(flat, E_STAR, pressure=1e3)
    assert state.contact_area_fraction == 1
    assert state.pressure.values == pytest.approx(1e3, rel=1e-12)


@pytest.mark.parametrize("open_samples", [1024, 1])
def test_areas_of_0_and_of_all_but_one_sample(open_samples):
    """The highest point always touches; the elastic area is reached to 1 part in 1000."""
    one = 1 / ROUGH.values.size
    area = 1 - open_samples * one
    elastic, cut = press(ROUGH, E_STAR, area_fraction=area), bearing(ROUGH, area_fraction=area)
    assert elastic.contact_area_fraction == pytest.approx(area, abs=1e-3 + one)
    assert cut.contact_area_fraction == pytest.approx(area, abs=one)


@pytest.mark.parametrize("shape", [(3, 3), (31, 37), (2000, 2), (1, 64)])
def test_few_samples_primes_and_slender_cells(shape):
    heights = 1e-6 * np.random.default_rng(0).normal(size=shape)
    state = press(GridField(heights, (1e-6, 1e-6), periodic=True), E_STAR, pressure=1e6)
    assert state.certificate <= TOLERANCE
    assert state.mean_pressure == pytest.approx(1e6, rel=1e-9)


@pytest.mark.parametrize("tolerance", [1e-15, 1e-18])
def test_certificates_below_rounding_are_refused(tolerance):
    with pytest.raises(InvalidInput, match="tolerance must lie in"):
        press(ROUGH, E_STAR, pressure=5e4, tolerance=tolerance)
