"""Waves along the flow, far longer than wide: the film sees one fluid pressure p(x) at each x.

It conducts K(P₀ - p), K from Westergaard's gap under the load that p leaves to the solid, so that
K(P₀ - p) p' is constant and Q = (W/L) ∫ K(P₀ - p) dp (docs/theory/lift.md). Where P₀ - p reaches
p*, the pressure of full contact, the channel is closed, and lower pressures add nothing. With
P₀ >= p* + p_in it is closed at the inlet already, whatever the pressure at the outlet: a load that
is affine in the inlet's pressure alone (A. G. Shvarts and V. A. Yastrebov, arXiv 1712.06312).
"""

import numpy as np
import pytest
from known_answers import Wave
from lifted_scenes import E_STAR, problem_of, scene

from fem_seal.coupling import lifted_state
from fem_seal.grid import GridField

WAVE, VISCOSITY = Wave(1e-7, 1e-5, E_STAR), 1e-3
NY, WAVES = 32, 64  # samples across a wave, and length of the seal in wavelengths
ENDS = [(0.2, 0.1), (0.7, 0.6)]  # pressures of the two ends over p*


def exact_conductivity(load):
    """Westergaard's K under a load in units of p* [m³/(Pa s)]."""
    return WAVE.conductivity(load * WAVE.full, VISCOSITY)


def conductivity_of_the_samples(load):
    """K of the dry contact on the samples of a wave."""
    drop = 1e-3
    problem = channel(load, drop, 0, nx=4, rtol=0.002)
    pressed = problem.press(problem.height, None, problem.prescribed)
    return problem.flow(problem.film(pressed.gap), 0.0).value * WAVES / (drop * WAVE.full)


def leak_rate(load, inlet, outlet, conductivity=exact_conductivity, order=40):
    """Integral with W/L = 1/WAVES, by Gauss: K is smooth [m³/s]; pressures in units of p*."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    first = max(outlet, load - 1)
    pressures = first + (inlet - first) * (nodes + 1) / 2
    values = [conductivity(load - p) for p in pressures]
    return (inlet - first) / 2 * WAVE.full * float(weights @ values) / WAVES


def channel(load, inlet, outlet, nx=64, **flow):
    """Contact and flow on nx samples along the flow; pressures in units of p*."""
    heights = WAVE.height * np.cos(2 * np.pi * np.arange(NY) / NY)
    spacing = (WAVES * WAVE.length / nx, WAVE.length / NY)
    surface = GridField(np.tile(heights, (nx, 1)), spacing, periodic=True)
    ends = {"inlet_pressure": inlet * WAVE.full, "outlet_pressure": outlet * WAVE.full}
    return problem_of(scene(load * WAVE.full, **ends, ambient_pressure=0, **flow), surface)


def test_lifted_film_follows_the_integral():
    """The integral over K of the samples, to the errors of the lift and of the flow's bounds."""
    load, inlet, rtol = 0.5, 0.4, 0.01
    state = lifted_state(channel(load, inlet, 0, nx=128, rtol=rtol))
    assert state.converged
    expected = leak_rate(load, inlet, 0, conductivity_of_the_samples, order=4)
    dry = exact_conductivity(load) * inlet * WAVE.full / WAVES
    assert expected > 1.5 * dry  # or nothing is shown
    assert state.leak_rate.value == pytest.approx(expected, rel=state.error + rtol / 2)


@pytest.mark.parametrize(("inlet", "outlet"), ENDS)
def test_leak_rate_below_the_sealing_pressure(inlet, outlet):
    """At P₀ = p_in + 0.8 p* both leak alike, at any pressure of the inlet and the outlet.

    The dry contact on these samples conducts 2 to 12 % too little at 0.8 to 0.9 p*.
    """
    load = inlet + 0.8
    state = lifted_state(channel(load, inlet, outlet))
    assert state.converged
    expected = leak_rate(1.0, 0.2, 0.1, conductivity_of_the_samples, order=4)
    assert state.leak_rate.value == pytest.approx(expected, rel=state.error)


@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_a_row_that_closes_before_the_outlet_leaves_a_range(representation):
    """Between the last vertex and the outlet no vertex holds the pressure: the last row closes.

    Only pixels far shorter than a wave, over which the solid bends, leave it open.
    """
    load, inlet, outlet = 1.3, 0.5, 0.0
    pixels = {"method": "finite-difference", "representation": representation}
    state = lifted_state(channel(load, inlet, outlet, nx=16, **pixels))
    assert state.is_range
    assert state.lowest <= leak_rate(load, inlet, outlet) <= state.highest


@pytest.mark.parametrize(("inlet", "outlet"), [*ENDS, (0.5, 0.0)])
def test_sealed_above_the_sealing_pressure(inlet, outlet):
    """Certainly so: sealed with the inlet's pressure everywhere as well."""
    state = lifted_state(channel(inlet + 1.03, inlet, outlet))
    assert (state.state, state.converged) == ("sealed", True)
