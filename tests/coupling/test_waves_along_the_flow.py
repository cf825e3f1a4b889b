"""Waves along the flow, far longer than wide: the film sees one fluid pressure p(x) at each x.

It conducts K(P₀ - p), K from Westergaard's gap under the load that p leaves to the solid, so that
K(P₀ - p) p' is constant and Q = (W/L) ∫ K(P₀ - p) dp (docs/theory/lift.md).
"""

import numpy as np
import pytest
from known_answers import Wave
from lifted_scenes import E_STAR, problem_of, scene

from fem_seal.coupling import lifted
from fem_seal.grid import GridField

WAVE, VISCOSITY = Wave(1e-7, 1e-5, E_STAR), 1e-3


def integral(load, inlet):
    """∫ K(P₀ - p) dp from 0 to p_in, by Gauss: K is smooth."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    pressures = inlet * (nodes + 1) / 2
    return inlet / 2 * weights @ [WAVE.conductivity(load - p, VISCOSITY) for p in pressures]


def test_lifted_film_follows_the_integral():
    """Seal of 64 wavelengths: what the lift multiplies is that of the integral.

    The solid bends along x as well, which costs pressures of p* λ/(π L) or so; the grid's error,
    n = 32 across a wave, is in the dry leak rate too and leaves the ratio.
    """
    load, inlet = 0.5 * WAVE.full, 0.4 * WAVE.full
    nx, ny, waves = 128, 32, 64
    heights = WAVE.height * np.cos(2 * np.pi * np.arange(ny) / ny)
    spacing = (waves * WAVE.length / nx, WAVE.length / ny)
    surface = GridField(np.tile(heights, (nx, 1)), spacing, periodic=True)
    problem = problem_of(scene(load, inlet, rtol=0.01), surface)
    state = lifted(problem, 0.01)
    assert state.converged
    dry = problem.flow(problem.film(problem.press(surface, None, problem.prescribed).gap), 0.0)
    lift = state.leak_rate.value / dry.value
    exact = integral(load, inlet) / (WAVE.conductivity(load, VISCOSITY) * inlet)
    assert exact > 1.5  # or nothing is shown
    assert lift == pytest.approx(exact, rel=0.02)
