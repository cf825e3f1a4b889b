"""Surfaces and loads at the ends of what can be asked for."""

from functools import cache

import numpy as np
import pytest
from rings import fitted_hurst

from fem_seal.contact import bearing, press
from fem_seal.errors import InvalidInput, NotConverged
from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, self_affine

PART = "Contact"
pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

E_STAR = 1e7  # Pa
MICRON = 1e-6
TOLERANCE = 1e-6  # of the contact's certificate, the default


def rough_surface(shape=(32, 32), hurst=0.8, short=4.0):
    """Self-affine heights of rms slope 0.1; wavelengths in samples, the long one half the side."""
    size = tuple(n * MICRON for n in shape)
    spectrum = Spectrum(hurst, max(size) / 2, short * MICRON)
    return self_affine(spectrum, shape, size, rms_slope=0.1, seed=1)


def assert_certified(state, pressure):
    """Certificate kept, and the load carried that was asked for, to the rounding of sums."""
    assert state.certificate <= TOLERANCE
    assert state.mean_pressure == pytest.approx(pressure, rel=1e-9, abs=0)


@cache
def loaded(ratio):
    """The rough surface under a mean pressure, in units of E*."""
    return press(rough_surface(), E_STAR, pressure=ratio * E_STAR)


LOADS = (1e-8, 1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4)


@pytest.mark.parametrize("number", range(len(LOADS)), ids=lambda number: f"{LOADS[number]:g}")
def test_loads(number, show):
    """Mean pressures, in units of E*.

    At full contact the pressure varies by E* h'rms/2 = 0.05 E* rms, so that E* closes every gap.
    """
    ratio = LOADS[number]
    state = loaded(ratio)
    assert_certified(state, ratio * E_STAR)
    lighter = loaded(LOADS[max(number - 1, 0)])
    assert state.contact_area_fraction >= lighter.contact_area_fraction
    assert ratio < 1 or state.contact_area_fraction == 1
    show("right", "certificate kept, load to 1e-9, area grows up to full contact")


@pytest.mark.parametrize("unit", [1e-12, 1e-6, 1e6, 1e12], ids=lambda unit: f"{unit:g}")
def test_contact_units(unit, show):
    """Heights, lengths and moduli in other units."""
    surface, pressure = rough_surface(), 0.005 * E_STAR
    reference = press(surface, E_STAR, pressure=pressure)
    scaled = GridField(surface.values * unit, tuple(s * unit for s in surface.spacing), True)
    state = press(scaled, E_STAR / unit, pressure=pressure / unit)
    assert_certified(state, pressure / unit)
    # A sample at the edge of contact may open by rounding.
    change = np.count_nonzero(state.contact) - np.count_nonzero(reference.contact)
    assert abs(change) <= 1
    show("right", "the same contact to the sample")


def test_flat_surface(show):
    """A flat surface: everything touches at once."""
    flat = GridField(np.zeros((16, 16)), (MICRON, MICRON), periodic=True)
    state = press(flat, E_STAR, pressure=1e3)
    assert state.contact_area_fraction == 1
    assert state.pressure.values == pytest.approx(1e3, rel=1e-12)
    show("right", "full contact, uniform pressure")


@pytest.mark.parametrize("hurst", [0.05, 0.3, 0.8, 1.0], ids=lambda hurst: f"{hurst:g}")
def test_hurst_exponents(hurst, show):
    """Hurst exponents from 0.05 to 1."""
    surface = rough_surface((128, 128), hurst)
    # One realization of 128² samples between two cut-offs a decade apart.
    assert fitted_hurst(surface, 32 * MICRON, 5 * MICRON) == pytest.approx(hurst, abs=0.15)
    assert_certified(press(surface, E_STAR, pressure=5e4), 5e4)
    show("right", "spectrum falls as asked, contact certified")


def test_shortest_waves(show):
    """Shortest wavelength one sample."""
    assert_certified(press(rough_surface(short=1.0), E_STAR, pressure=5e4), 5e4)
    show("right", "certificate kept")


@pytest.mark.parametrize("open_samples", [1024, 1], ids=["0", "1 - one sample"])
def test_contact_areas(open_samples, show):
    """Contact areas 0 and 1 - one sample, elastic and bearing."""
    surface = rough_surface()
    one = 1 / surface.values.size
    area = 1 - open_samples * one
    # The highest point always touches; the elastic area is reached to 1 part in 1000.
    elastic = press(surface, E_STAR, area_fraction=area)
    assert elastic.contact_area_fraction == pytest.approx(area, abs=1e-3 + one)
    cut = bearing(surface, area_fraction=area)
    assert cut.contact_area_fraction == pytest.approx(area, abs=one)
    show("right", "reached to one sample (bearing) and 1 part in 1000 (elastic)")


@pytest.mark.parametrize(
    "shape", [(3, 3), (31, 37), (2000, 2), (1, 64)], ids=lambda shape: "{} x {}".format(*shape)
)
def test_odd_shapes(shape, show):
    """Surfaces of few samples, of primes, and of Lx/Ly = 1000."""
    heights = np.random.default_rng(0).normal(size=shape) * MICRON
    surface = GridField(heights, (MICRON, MICRON), periodic=True)
    assert_certified(press(surface, E_STAR, pressure=1e6), 1e6)
    show("right", "certificate kept")


def test_iterations_too_few(show):
    """A tolerance that one iteration cannot reach."""
    with pytest.raises(NotConverged, match=r"certificate .* after 1 iterations") as error:
        press(rough_surface(), E_STAR, pressure=5e4, max_iterations=1)
    show("refused", str(error.value))


@pytest.mark.parametrize("tolerance", [1e-9, 1e-12], ids=lambda tolerance: f"{tolerance:g}")
def test_tight_tolerances(tolerance, show):
    """Certificates far below the default of 1e-6."""
    state = press(rough_surface(), E_STAR, pressure=5e4, tolerance=tolerance)
    assert state.certificate <= tolerance
    show("right", "reached")


@pytest.mark.parametrize("tolerance", [1e-15, 1e-18], ids=lambda tolerance: f"{tolerance:g}")
def test_tolerances_below_rounding(tolerance, show):
    """Certificates below the rounding of double precision."""
    with pytest.raises(InvalidInput, match="tolerance must lie in") as error:
        press(rough_surface(), E_STAR, pressure=5e4, tolerance=tolerance)
    show("refused", str(error.value))
