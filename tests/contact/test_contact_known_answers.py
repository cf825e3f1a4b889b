"""Contacts with a closed form: Westergaard, Johnson, Hertz, full contact."""

import numpy as np
import pytest
from contact_cases import E_STAR, SOLID, compliance, rough_surface
from known_answers import Wave, hertz_pressure, hertz_radius

from fem_seal.contact import ContactStopping, Load, press
from fem_seal.grid import GridField

# Distance by which the last sample that touches may lie outside of the exact edge, in samples.
# Near an edge the contact is a half-line of samples with the compliance 1/|q|, |q| < π (Wiener and
# Hopf). For 1/|2 sin(q/2)| the pressure of the sample n from the edge is a sum of Γ(n + 3/2)/n! and
# Γ(n + 1/2)/n!, far inside √(n + c): c = -1/4 if the last sample's pressure vanishes, and 3/4 if
# the next one's gap does. The ratio of the compliances adds ∫cot u (1/u - cot u)du/(2π) = 0.06,
# u = q/2 from 0 to π/2. So an edge lies from 0.19 inside the last sample to 0.81 outside.
OUTSIDE = 0.19


@pytest.mark.parametrize("n", [32, 129, 512])
@pytest.mark.parametrize("relative", [0.02, 0.1, 0.35, 0.6, 0.9, 0.99])
def test_westergaard(n, relative):
    """One wave: its edge lies where `OUTSIDE` allows, and the pressure errs by less than if both
    edges were further out by as much.

    With the sums above the pressure of the last sample errs by 0.05 (edge 0.81 outside of it) to
    0.18 (on it) of that one sample inside the edge; the edge further out changes 0.1 to 0.44.
    """
    wave = Wave(2e-6, 1e-3, E_STAR)
    x = np.arange(n) / n * wave.length
    heights = wave.height * np.cos(2 * np.pi * x / wave.length)[:, None]
    height = GridField(heights, (wave.length / n, 1e-5), periodic=True)
    load = relative * wave.full
    state = press(height, SOLID, Load("pressure", load), ContactStopping(tolerance=1e-9))
    width = wave.area(load) * n  # the crest is sample 0
    last = (np.count_nonzero(state.contact) - 1) / 2
    assert last - OUTSIDE <= width / 2 <= last + 1 - OUTSIDE
    exact = wave.pressure(load, x)
    error = np.linalg.norm(state.pressure.values[:, 0] - exact) / np.linalg.norm(exact)
    wider = wave.full * np.sin(np.pi / 2 * (width + 2 * OUTSIDE) / n) ** 2
    assert error < np.linalg.norm(wave.pressure(wider, x) - exact) / np.linalg.norm(exact)


def test_johnson_near_full_contact():
    """1 - A/A0 -> (3/2π)(1 - p/p*): the last open spots close like Hertz contacts upside down.

    Of Δ cos cos with λ = 1, under 0.98 of the load p* = √2 π E* Δ/λ that flattens it.
    """
    n, amplitude = 256, 1e-3
    wave = np.cos(2 * np.pi * np.arange(n) / n)
    height = GridField(amplitude * np.outer(wave, wave), (1 / n, 1 / n), periodic=True)
    load = Load("pressure", 0.98 * 2**0.5 * np.pi * E_STAR * amplitude)
    area = press(height, SOLID, load).contact_area_fraction
    # Two open spots of radius 7 samples, each known to half a sample: 15 % of the open area.
    assert 1 - area == pytest.approx(3 / (2 * np.pi) * 0.02, rel=0.15)


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
    state = press(
        height, SOLID, Load("pressure", load / (n * pixel) ** 2), ContactStopping(tolerance=1e-9)
    )
    found = (state.contact.sum() / np.pi) ** 0.5
    assert abs(found - samples) < 0.5
    # Three errors. The loads of the other cells bend the solid as 9.03/L³ = Σ 1/R³ says: here the
    # paraboloid counts as sharper by 1.9 (a/L)³, and its peak is higher by two thirds of that,
    # 2.5e-3. An edge that is off by `OUTSIDE` samples changes √(1 - x²) by x²/√(1 - x²) times
    # `OUTSIDE` over a. The samples at the edge, 1/a of the radius, change the load by their part.
    inner = square < (contact_radius - pixel) ** 2
    x2 = square[inner] / contact_radius**2
    exact = hertz_pressure(load, contact_radius, contact_radius * np.sqrt(x2))
    sharper = 2 / 3 * 1.92 * (samples / n) ** 3
    allowed = OUTSIDE / samples * (x2 / np.sqrt(1 - x2) + 1 / samples) + sharper
    assert (np.abs(state.pressure.values[inner] - exact) < allowed * exact.max()).all()


def test_full_contact_is_linear():
    """Above p* the pressure is P + (E*/2) q h̃(q), known mode by mode.

    The preconditioner is then the exact inverse, and one step in single precision ends: a relative
    2^-24 in each of log2 n = 11 stages of a transform and of its inverse.
    """
    rough = rough_surface((48, 40), short=3)
    inverse = compliance(rough)
    stiffness = np.divide(1, inverse, out=np.zeros_like(inverse), where=inverse > 0)
    waves = np.fft.ifft2(np.fft.fft2(rough.values) * stiffness).real
    state = press(rough, SOLID, Load("pressure", -1.1 * waves.min()))
    assert state.contact_area_fraction == 1
    assert state.mean_gap == 0
    exact = waves - 1.1 * waves.min()
    assert np.abs(state.pressure.values - exact).max() < 2 * 11 * 2**-24 * exact.max()
