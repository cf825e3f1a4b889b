"""Persson's theory: full contact, light load, energy balance, normalisation, units."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from known_answers import area_by_law, of_slope
from project import refused_calls
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from scipy.special import erf

from fem_seal.surface.spectrum import Spectrum
from fem_seal.theory.bruggeman import effective_dimension
from fem_seal.theory.persson import (
    GAMMA,
    cumulative,
    effective_film_conductivity,
    ladder,
    persson_state,
)

approx = partial(pytest.approx, rel=1e-12)

E_STAR = 1e7
ROUGH = of_slope(Spectrum(0.8, 1e-4, 1e-6), 0.1)
ROLLOFF = of_slope(Spectrum(0.4, 1e-4, 2e-6, rolloff_wavelength=2e-5), 0.2)


def state_at(strain, spectrum=ROUGH, **options):
    return persson_state(spectrum, pressure=strain * E_STAR, contact_modulus=E_STAR, **options)


@pytest.mark.parametrize("spectrum", [ROUGH, ROLLOFF])
@pytest.mark.parametrize("strain", [1e-6, 1e-3, 0.03])
def test_area_law_at_full_resolution(spectrum, strain):
    """A/A0 = erf(√2 p0/(E* h'rms)); the quadrature is good to about 1e-9 between kinks."""
    state = state_at(strain, spectrum)
    exact = erf(np.sqrt(2) * strain / spectrum.rms_slope)
    assert state.area[-1] == approx(exact, rel=1e-8)
    assert area_by_law(strain, spectrum.rms_slope**2) == approx(exact)


def test_area_law_of_wang_and_mueser():
    """κ = (A/A0) E* h'rms/p0 → √(8/π)/√(5/9) = 2.14 at light load; complete contact at a heavy one.

    The leading correction is of the order of A, here 10⁻⁴; the table is good to 10⁻⁶.
    """
    light = 5e-6 / ROUGH.rms_slope
    kappa = area_by_law(5e-6, ROUGH.rms_slope**2, "wang-mueser") / light
    assert kappa == approx(np.sqrt(8 / np.pi) / np.sqrt(5 / 9), rel=2e-4)
    assert area_by_law(1.0, ROUGH.rms_slope**2, "wang-mueser") == approx(1)


@pytest.mark.parametrize("strain", [1e-3, 5e-3, 0.03])
def test_the_energy_of_wang_and_mueser_solves_its_equation(strain):
    """dV/dm = S(erf(strain/√V)) along m = h'rms²/2, by Runge and Kutta."""

    def slope(m, V):
        a = erf(strain / np.sqrt(V))
        return 5 / 9 - 2 / 9 * a**2 + 2 / 3 * a**4

    # In the beginning contact is complete and S = 1.
    start, end = 1e-3 * strain**2, ROUGH.rms_slope**2 / 2
    V = solve_ivp(slope, (start, end), [start], method="DOP853", rtol=1e-10, atol=0).y[0, -1]
    area = area_by_law(strain, 2 * end, "wang-mueser")
    assert area == approx(erf(strain / np.sqrt(V)), rel=1e-5)
    state = state_at(strain, area="wang-mueser")
    assert state.area[-1] == approx(area, rel=1e-6)
    # The area that leaves contact at all magnifications together is what is not in contact.
    assert state.opened_area.sum() + state.area[-1] == approx(1)
    assert (state.area >= state_at(strain).area * (1 - 1e-6)).all()


def elastic_energy(spectrum, strain):
    """U/(A0 E*) = π/2 ∫ q² C W dq, W = P [γ + (1-γ) P²], P = erf(w p/E*) (Yang and Persson)."""
    # At light load W falls from 1 within a small part of the range: steps grow from its lower end.
    first, last = spectrum.wavenumbers[0], spectrum.wavenumbers[-1]
    q = first * (last / first) ** (np.linspace(0, 1, 400_000) ** 2)
    root = np.sqrt(cumulative(lambda q: np.pi * q**3 * spectrum.density(q), q))  # 1/w
    P = erf(2 * strain / (root[1:] + root[:-1]))
    W = P * (GAMMA + (1 - GAMMA) * P**2)
    return np.sum(W * 0.5 * np.diff(root**2) / np.sqrt(q[1:] * q[:-1]))


@pytest.mark.parametrize("spectrum", [ROUGH, ROLLOFF])
@pytest.mark.parametrize("strain", [1e-4, 3e-3, 0.02])
def test_work_of_the_pressure_is_stored_as_elastic_energy(spectrum, strain):
    """p0 = -dU/dū: the mean gap follows from the energy. Centred differences, O(step²) = 1e-6."""
    step = 1e-3
    low, high = strain * (1 - step), strain * (1 + step)
    work = -strain * (state_at(high, spectrum).mean_gap[0] - state_at(low, spectrum).mean_gap[0])
    stored = elastic_energy(spectrum, high) - elastic_energy(spectrum, low)
    assert work == approx(stored, rel=1e-5)


@pytest.mark.parametrize("strain", [1e-4, 3e-3])
def test_opened_gaps_hold_the_whole_volume(strain):
    """Σ ΔA u1 = ū: the volume of the gap is that above the areas opened at all magnifications."""
    state = state_at(strain)
    assert state.opened_area.sum() == approx(1 - state.area[-1], rel=1e-12)
    volume = np.sum(state.opened_area * state.opened_gap)
    assert volume == approx(state.mean_gap[0], rel=1e-9)
    assert (state.opened_gap >= 0).all()


def test_contact_at_a_magnification_equals_contact_of_the_remaining_spectrum():
    """The area in contact at ζ has the roughness of q > ζ q0 and the pressure p0 A0/A(ζ)."""
    state = state_at(3e-3)
    for k in (10, 40):
        cut = replace_range(ROUGH, state.q[k])
        inner = state_at(3e-3 / state.area[k], cut)
        assert inner.mean_gap[0] == approx(state.mean_gap[k], rel=1e-12)
        next_cut = replace_range(ROUGH, state.q[k + 1])
        unseen = np.sqrt((cut.rms_height**2 + next_cut.rms_height**2) / 2)
        assert state.unseen_rms[k] == approx(unseen, rel=1e-11)


def replace_range(spectrum, lowest):
    """The same power law with a larger smallest wavenumber."""
    q_long = spectrum.wavenumbers[0]
    plateau = spectrum.plateau * (lowest / q_long) ** (-2 - 2 * spectrum.hurst)
    return Spectrum(spectrum.hurst, 2 * np.pi / lowest, spectrum.short_wavelength, plateau=plateau)


def test_resolution_in_magnification_is_sufficient(monkeypatch):
    """Halving the cells: the mean gap changes by the error of 1/q in them, 1e-5; the conductivity
    more, since each step of magnification has a single u1. Its change falls as the cells at least,
    so that all further ones add up to no more than the last one."""
    states = []
    for number in (6, 12, 24):
        monkeypatch.setattr("fem_seal.theory.persson.PER_OCTAVE", number)
        states.append(state_at(3e-3))
    assert states[1].mean_gap[0] == approx(states[2].mean_gap[0], rel=1e-5)
    K = [effective_film_conductivity(state, viscosity=1e-3) for state in states]
    assert abs(K[2] - K[1]) < 0.5 * abs(K[1] - K[0]) < 0.01 * K[2]


def test_light_load_gives_parallel_plates():
    """At vanishing load ū ≫ h_rms and K → ū³/12η, to second order in h_rms/ū."""
    state = state_at(1e-30)
    ratio = effective_film_conductivity(state, viscosity=1 / 12) / state.mean_gap[0] ** 3
    assert ratio == approx(1, abs=3 * (ROUGH.rms_height / state.mean_gap[0]) ** 2)


def test_leak_rate_falls_with_load_to_zero_at_the_threshold():
    """A/A0 = 0.42 is reached at p0 = erfinv(0.42) E* h'rms/√2."""
    strains = np.array([1e-4, 1e-3, 1e-2, 0.0275, 0.0285])
    states = [state_at(s) for s in strains]
    assert states[-2].area[-1] < 0.42 < states[-1].area[-1]
    K = [effective_film_conductivity(s, viscosity=1e-3) for s in states]
    assert all(a > b for a, b in pairwise(K))
    assert K[-2] > 0
    assert K[-1] == 0
    assert effective_film_conductivity(states[-1], viscosity=1e-3, threshold=0.5) > 0


@pytest.mark.parametrize(("area", "part"), [("persson", 0.5), ("wang-mueser", 0.99)])
def test_the_narrowest_gaps_are_resolved(area, part):
    """K solves Bruggeman's equation, integrated adaptively over each bell, to 1e-5 up to closing.

    Gaps whose conductivity is near K, far below the mean, decide next to the threshold.
    """
    threshold = 0.42
    strain = brentq(lambda s: state_at(s, area=area).area[-1] - part * threshold, 1e-4, 0.1)
    state = state_at(strain, area=area)
    K = effective_film_conductivity(state, viscosity=1 / 12, threshold=threshold)
    contact = state.area[-1]
    n = effective_dimension(contact, threshold)

    def bell(mean, width, K):
        """Mean of (k - K)/(k + (n-1) K) over k = |u1 + s z|³."""

        def integrand(z):
            k = abs(mean + width * z) ** 3
            return np.exp(-(z**2) / 2) * (k - K) / (k + (n - 1) * K)

        closed, near = -mean / width, K ** (1 / 3) / width * np.array([0.1, 0.5, 1, 2, 10])
        marks = np.concatenate([closed - near, [closed], closed + near])
        inside = marks[abs(marks) < 8]
        whole = quad(integrand, -8, 8, points=inside if inside.size else None, epsrel=1e-9)[0]
        return whole / np.sqrt(2 * np.pi)

    def excess(K):
        bells = zip(state.opened_area, state.opened_gap, state.unseen_rms, strict=True)
        return sum(a * bell(u, s, K) for a, u, s in bells) - contact / (n - 1)

    assert excess(K * (1 - 1e-5)) > 0 > excess(K * (1 + 1e-5))


test_bad_input = refused_calls(
    (lambda: state_at(1e-3, area="hertz"), "persson, wang-mueser"),
    (lambda: state_at(-1.0), "pressure = .* must be a positive"),
    (
        lambda: effective_film_conductivity(state_at(1e-3), viscosity=1, threshold=1),
        r"0 < A\*/A0 < 1",
    ),
    (lambda: ladder((2.0, 1.0), 4), "ascending"),
    (lambda: ladder((1.0, 1.0), 4), "no range"),
)
