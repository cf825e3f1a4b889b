"""Contacts with a closed form: Westergaard, Johnson, Hertz, full contact."""

import numpy as np
import pytest
from contact_cases import E_STAR, compliance, rough_surface
from known_answers import Wave, hertz_pressure, hertz_radius

from fem_seal.contact import press
from fem_seal.grid import GridField


@pytest.mark.parametrize("n", [32, 129, 512])
@pytest.mark.parametrize("relative", [0.02, 0.1, 0.35, 0.6, 0.9, 0.99])
def test_westergaard(n, relative):
    """One wave: width of the contact, and pressure."""
    wave = Wave(2e-6, 1e-3, E_STAR)
    x = np.arange(n) / n * wave.length
    height = GridField(
        wave.height * np.cos(2 * np.pi * x / wave.length)[:, None],
        (wave.length / n, 1e-5),
        periodic=True,
    )
    load = relative * wave.full
    state = press(height, E_STAR, pressure=load, tolerance=1e-9)
    # The crest is sample 0: the edge lies between the last sample that touches and the next one,
    # but for the 0.3 of a sample by which pixels carry too much at an edge (0.15 to 0.2, the
    # perimeter correction).
    width = wave.area(load) * n
    last = (np.count_nonzero(state.contact) - 1) / 2
    assert last - 0.3 <= width / 2 <= last + 1
    exact = wave.pressure(load, x)
    error = np.linalg.norm(state.pressure.values[:, 0] - exact) / np.linalg.norm(exact)
    # No more than if the edges were further out by that 0.3 of a sample.
    wider = wave.full * np.sin(np.pi / 2 * (width + 0.6) / n) ** 2
    assert error < np.linalg.norm(wave.pressure(wider, x) - exact) / np.linalg.norm(exact)


@pytest.mark.parametrize("relative", [0.002, 0.005])
def test_johnson_light_load_is_hertz(relative):
    """Two peaks in a period of cos cos, each with R = λ²/(4π²Δ) (Johnson et al., 1985)."""
    n, wavelength, amplitude = 256, 1.0, 1e-3
    wave = np.cos(2 * np.pi * np.arange(n) / n)
    height = GridField(amplitude * np.outer(wave, wave), (1 / n, 1 / n), periodic=True)
    full = 2**0.5 * np.pi * E_STAR * amplitude / wavelength
    state = press(height, E_STAR, pressure=relative * full)
    radius = wavelength**2 / (4 * np.pi**2 * amplitude)
    load = relative * full * wavelength**2 / 2
    found = (state.contact_area_fraction / (2 * np.pi)) ** 0.5
    assert abs(found - hertz_radius(load, radius, E_STAR)) < 0.5 / n  # half a sample


def test_johnson_near_full_contact():
    """1 - A/A0 -> (3/2π)(1 - p/p*): the last open spots close like Hertz contacts upside down."""
    n = 256
    wave = np.cos(2 * np.pi * np.arange(n) / n)
    height = GridField(1e-3 * np.outer(wave, wave), (1 / n, 1 / n), periodic=True)
    full = 2**0.5 * np.pi * E_STAR * 1e-3
    state = press(height, E_STAR, pressure=0.98 * full)
    # Two open spots of radius 7 samples, each known to half a sample: 15 % of the open area.
    assert 1 - state.contact_area_fraction == pytest.approx(3 / (2 * np.pi) * 0.02, rel=0.15)


@pytest.mark.parametrize("n", [96, 97])
@pytest.mark.parametrize("samples", [6, 12])
def test_hertz(n, samples):
    """Paraboloid in a cell 8 to 16 contact radii wide: a, and the pressure's profile."""
    pixel, radius = 1e-5, 5e-2
    contact_radius = samples * pixel
    load = 4 * E_STAR * contact_radius**3 / (3 * radius)
    assert hertz_radius(load, radius, E_STAR) == pytest.approx(contact_radius)
    centred = (np.arange(n) - n // 2) * pixel
    square = np.add.outer(centred**2, centred**2)
    height = GridField(-square / (2 * radius), (pixel, pixel), periodic=True)
    state = press(height, E_STAR, pressure=load / (n * pixel) ** 2, tolerance=1e-9)
    found = (state.contact.sum() / np.pi) ** 0.5
    assert abs(found - samples) < 0.5
    # Neighbouring cells flatten the paraboloid by about (a/L)³ = 2e-3. Pixels carry too much at an
    # edge, by 0.3 of a sample at most (see above): with the edge √(1 - x²) moves by x²/√(1 - x²)
    # times that over a, and the peak by its square.
    inner = square < (contact_radius - pixel) ** 2
    x2 = square[inner] / contact_radius**2
    exact = hertz_pressure(load, contact_radius, contact_radius * np.sqrt(x2))
    allowed = 0.3 / samples * x2 / np.sqrt(1 - x2) + 0.3 / samples**2 + 4e-3
    assert (np.abs(state.pressure.values[inner] - exact) < allowed * exact.max()).all()


def test_full_contact_is_linear():
    """Above p* the pressure is P + (E*/2) q h̃(q), known mode by mode."""
    rough = rough_surface((48, 40), short=3)
    inverse = compliance(rough)
    stiffness = np.divide(1, inverse, out=np.zeros_like(inverse), where=inverse > 0)
    waves = np.fft.ifft2(np.fft.fft2(rough.values) * stiffness).real
    state = press(rough, E_STAR, pressure=-1.1 * waves.min())
    assert state.contact_area_fraction == 1
    assert state.mean_gap == 0
    # float32 steers, float64 decides: the certificate's 1e-6 bounds the error of the pressure.
    exact = waves - 1.1 * waves.min()
    assert np.abs(state.pressure.values - exact).max() < 1e-4 * exact.max()
