"""Waves along the flow, far longer than wide: the film sees one fluid pressure p(x) at each x.

It conducts K(P₀ - p), K from Westergaard's gap under the load that p leaves to the solid, so that
K(P₀ - p) p' is constant and Q = (W/L) ∫ K(P₀ - p) dp (docs/theory/lift.md).
"""

import numpy as np
import pytest
from lifted_scenes import E_STAR, problem_of, scene

from fem_seal.coupling import lifted
from fem_seal.grid import GridField

LENGTH, HEIGHT, VISCOSITY = 1e-5, 1e-7, 1e-3  # λ, Δ [m], η [Pa s]
FULL = np.pi * E_STAR * HEIGHT / LENGTH  # pressure that closes the gap, p*


def conductivity(load):
    """K [m³/(Pa s)]: mean of g³/(12 η) over a wave under a load [Pa].

    Westergaard: p = p* 2 cos ψ √(s_a² - s²), s = sin ψ, ψ = πy/λ, s_a² = P/p*, is the real part of
    a function whose imaginary part is E*/2 times the slope of the gap; integrated over s,
    g = 2 Δ (s √(s² - s_a²) - s_a² arcosh(s/s_a)). Without load it is Δ (1 - cos 2ψ).
    """
    a = np.sqrt(load / FULL)
    psi = (np.arange(1000) + 0.5) * np.pi / 1000
    s = np.maximum(np.sin(psi), a)
    root = np.sqrt(np.maximum(s**2 - a**2, 0))
    gap = 2 * HEIGHT * (s * root - a**2 * np.arccosh(np.maximum(s / a, 1)))
    return float(np.mean(gap**3)) / (12 * VISCOSITY)


def integral(load, inlet):
    """∫ K(P₀ - p) dp from 0 to p_in, by Gauss: K is smooth."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    pressures = inlet * (nodes + 1) / 2
    return (
        inlet / 2 * sum(w * conductivity(load - p) for w, p in zip(weights, pressures, strict=True))
    )


def finite_volumes(load, inlet, cells=100):
    """Q L/W of plain Picard steps: K at the last pressures, in series, until they stay."""
    pressure = np.linspace(inlet, 0, cells)
    for _ in range(100):
        before = pressure
        resistance = np.array([1 / conductivity(load - p) for p in pressure])
        drops = np.cumsum(resistance) - resistance / 2
        pressure = inlet * (1 - drops / resistance.sum())
        if np.abs(pressure - before).max() < 1e-9 * inlet:
            return inlet * cells / resistance.sum()
    raise AssertionError("Picard steps have not settled")


def test_closed_form_at_its_ends():
    """Light loads: the mean of (Δ (1 - cos))³ is 5/2 Δ³; full contact closes the film."""
    assert conductivity(1e-12 * FULL) * 12 * VISCOSITY == pytest.approx(2.5 * HEIGHT**3, rel=1e-6)
    assert conductivity((1 - 1e-9) * FULL) * 12 * VISCOSITY < 1e-9 * HEIGHT**3


def test_integral_is_that_of_finite_volumes():
    """Two ways to the same one-dimensional answer; 100 cells, second order."""
    load, inlet = 0.5 * FULL, 0.35 * FULL
    assert finite_volumes(load, inlet) == pytest.approx(integral(load, inlet), rel=1e-3)


@pytest.mark.parametrize(("share", "inlet"), [(0.4, 0.2), (0.5, 0.4)])
def test_lifted_film_follows_the_integral(share, inlet):
    """Seal of 64 wavelengths: what the lift multiplies is that of the integral.

    The solid bends along x as well, which costs pressures of p* λ/(π L) or so; the grid's error,
    n = 32 across a wave, is in the dry leak rate too and leaves the ratio.
    """
    load, inlet = share * FULL, inlet * FULL
    nx, ny, waves = 128, 32, 64
    heights = HEIGHT * np.cos(2 * np.pi * np.arange(ny) / ny)
    spacing = (waves * LENGTH / nx, LENGTH / ny)
    surface = GridField(np.tile(heights, (nx, 1)), spacing, periodic=True)
    problem = problem_of(scene(load, inlet, rtol=0.01), surface)
    state = lifted(problem, 0.01)
    assert state.converged
    dry = problem.flow(problem.film(problem.press(surface, load, None).gap), 0.0)
    lift = state.leak_rate.value / dry.value
    exact = integral(load, inlet) / (conductivity(load) * inlet)
    assert exact > 1.5  # or nothing is shown
    assert lift == pytest.approx(exact, rel=0.02)
