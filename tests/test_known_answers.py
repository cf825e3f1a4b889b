"""The closed forms of contacts that other tests rest on, against elasticity and balance."""

import numpy as np
import pytest
from known_answers import Wave, hertz_pressure, hertz_radius
from scipy.integrate import quad

WAVE = Wave(2e-6, 1e-3, 3e6)


@pytest.mark.parametrize("share", [0.02, 0.35, 0.9])
def test_wave(share):
    """The pressure carries the load, ends with the contact, and bends the solid to the gap.

    A wave of pressure of wavenumber q causes 2/(E* q) of displacement. On n samples the square
    roots at the edges cost n^(-3/2), a dozen of which is allowed.
    """
    n, load = 4096, share * WAVE.full
    y = (np.arange(n) + 0.5) / n * WAVE.length
    p, g = WAVE.pressure(load, y), WAVE.gap(load, y)
    allowed = 12 * n**-1.5
    assert p.mean() == pytest.approx(load, rel=allowed)
    assert np.mean(p > 0) == pytest.approx(WAVE.area(load), abs=2 / n)
    assert not (p * g).any()
    q = 2 * np.pi * np.fft.rfftfreq(n, WAVE.length / n)
    compliance = np.divide(2, WAVE.E_star * q, out=np.zeros_like(q), where=q > 0)
    displacement = np.fft.irfft(np.fft.rfft(p) * compliance, n)
    level = g + WAVE.height * np.cos(2 * np.pi * y / WAVE.length) - displacement
    assert np.ptp(level) < allowed * WAVE.height


def test_ends_of_the_conductivity():
    """Without load the mean of (Δ (1 - cos))³ is 5/2 Δ³; a flat wave lets nothing through."""
    free = 2.5 * WAVE.height**3
    assert 12 * WAVE.conductivity(0.0, 1.0) == pytest.approx(free, rel=1e-9)
    assert 12 * WAVE.conductivity((1 - 1e-9) * WAVE.full, 1.0) < 1e-9 * free


def test_sphere():
    """The pressure carries the load, and the solid sinks by a²/R at the centre.

    u = ∫ p/(π E* |x - x'|) dx', which is (2/E*) ∫ p dr there. Square roots cost quad two digits.
    """
    load, radius, E_star = 3.0, 5e-2, 3e6
    a = hertz_radius(load, radius, E_star)
    total, _ = quad(lambda r: 2 * np.pi * r * hertz_pressure(load, a, r), 0, a)
    assert total == pytest.approx(load, rel=1e-6)
    sunk, _ = quad(lambda r: 2 / E_star * hertz_pressure(load, a, r), 0, a)
    assert sunk == pytest.approx(a**2 / radius, rel=1e-6)
