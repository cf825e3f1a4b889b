"""Westergaard's and Hertz's contacts against what defines them: displacements by quadrature."""

import numpy as np
import pytest
from known_answers import Wave, hertz_pressure, hertz_radius
from scipy.integrate import quad
from scipy.special import ellipk

WAVE = Wave(2e-6, 1e-3, 3e6)
EXACT = {"epsabs": 0, "epsrel": 1e-10, "limit": 200}


def depression(load: float, y: float) -> float:
    """-(2/(π E*)) ∫ p(t) ln|2 sin(π (y - t)/λ)| dt over a period [m]: a sum of 2/(E* q) cos qy."""
    edge = WAVE.length / 2 * WAVE.area(load)

    def part(t):
        return -np.log(abs(2 * np.sin(np.pi * (y - t) / WAVE.length))) * WAVE.pressure(load, t)

    inside = [y] if abs(y) < edge else None
    return 2 / (np.pi * WAVE.E_star) * quad(part, -edge, edge, points=inside, limit=200)[0]


@pytest.mark.parametrize("share", [0.05, 0.4, 0.9])
def test_gap_under_the_pressure_of_a_wave(share):
    """Depression less height is the gap but for a constant, in contact and beside it.

    The integral of the pressure is the load.
    """
    load = share * WAVE.full
    edge = WAVE.length / 2 * WAVE.area(load)
    y = np.array([0, 0.5 * edge, 0.9 * edge, 1.1 * edge, 0.5 * (edge + WAVE.length / 2)])
    y = np.append(y[y < WAVE.length / 2], WAVE.length / 2)
    gap = WAVE.gap(load, y)
    assert ((gap > 0) == (y > edge)).all()
    height = WAVE.height * np.cos(2 * np.pi * y / WAVE.length)
    constant = [depression(load, one) for one in y] - height - gap
    assert np.ptp(constant) < 1e-7 * WAVE.height  # quad's 1.5e-8 of integrals of order Δ
    total = quad(lambda t: WAVE.pressure(load, t), -edge, edge, **EXACT)[0]
    assert total == pytest.approx(load * WAVE.length, rel=1e-8)


def test_conductivity_of_a_wave():
    """<g³>: 5/2 Δ³ of the free wave, quadrature under load, nothing from p* on."""
    assert WAVE.conductivity(0.0, 1 / 12) == pytest.approx(2.5 * WAVE.height**3, rel=1e-9)
    load, edge = 0.3 * WAVE.full, WAVE.length / 2 * WAVE.area(0.3 * WAVE.full)
    cube = quad(lambda y: WAVE.gap(load, y) ** 3, edge, WAVE.length / 2, **EXACT)[0]
    exact = 2 * cube / WAVE.length
    assert WAVE.conductivity(load, 1 / 12) == pytest.approx(exact, rel=1e-9)
    for closed in (1.0, 1.5):
        assert WAVE.area(closed * WAVE.full) == 1
        assert WAVE.conductivity(closed * WAVE.full, 1 / 12) == 0


@pytest.mark.parametrize("part", [0.2, 0.7, 0.95])
def test_sphere(part):
    """The pressure has its load, and u(0) - u(r) = r²/(2R) in contact, by rings of pressure.

    u(r) = 4/(π E*) ∫ p(t) t K(m)/(r + t) dt, m = 4rt/(r + t)²; u(0) = a²/R (Johnson, section 4.2).
    """
    load, radius, E_star = 0.3, 5e-2, 3e6
    a = hertz_radius(load, radius, E_star)

    def depressed(r):
        def ring(t):
            return hertz_pressure(load, a, t) * t * ellipk(4 * r * t / (r + t) ** 2) / (r + t)

        return 4 / (np.pi * E_star) * quad(ring, 0, a, points=[r] if r else None, limit=200)[0]

    total = quad(lambda t: 2 * np.pi * t * hertz_pressure(load, a, t), 0, a, **EXACT)[0]
    assert total == pytest.approx(load, rel=1e-9)
    assert depressed(0.0) == pytest.approx(a**2 / radius, rel=1e-7)
    r = part * a
    assert depressed(0.0) - depressed(r) == pytest.approx(r**2 / (2 * radius), rel=1e-6)
    assert hertz_pressure(load, a, 1.01 * a) == 0
