"""A wavy channel closes at a load that is affine in the inlet's pressure alone.

Waves along the flow: where the fluid has pressure p, the channel is closed if P₀ - p reaches p*,
the pressure of full contact. With P₀ >= p* + p_in it is closed at the inlet already, whatever the
pressure at the outlet (A. G. Shvarts and V. A. Yastrebov, arXiv 1712.06312). Under smaller loads
Q = (W/L) ∫ K(P₀ - p) dp; pressures below P₀ - p* add nothing to it.
"""

import numpy as np
import pytest
from lifted_scenes import problem_of, scene
from test_waves_along_the_flow import VISCOSITY, WAVE

from fem_seal.coupling import lifted
from fem_seal.grid import GridField

NX, NY, WAVES = 64, 32, 64
ENDS = [(0.2, 0.1), (0.7, 0.6)]  # pressures of the two ends over p*


def leak_rate(load, inlet, outlet):
    """Integral with W/L = 1/WAVES [m³/s]; pressures in units of p*."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    first = max(outlet, load - 1)
    pressures = first + (inlet - first) * (nodes + 1) / 2
    values = [WAVE.conductivity((load - p) * WAVE.full, VISCOSITY) for p in pressures]
    return (inlet - first) / 2 * WAVE.full * float(weights @ values) / WAVES


def state_at(load, inlet, outlet, nx=NX, **flow):
    heights = WAVE.height * np.cos(2 * np.pi * np.arange(NY) / NY)
    spacing = (WAVES * WAVE.length / nx, WAVE.length / NY)
    surface = GridField(np.tile(heights, (nx, 1)), spacing, periodic=True)
    ends = {"inlet_pressure": inlet * WAVE.full, "outlet_pressure": outlet * WAVE.full}
    problem = problem_of(
        scene(load * WAVE.full, **ends, ambient_pressure=0, rtol=0.05, **flow), surface
    )
    return lifted(problem, 0.05)


@pytest.mark.parametrize(("inlet", "outlet"), ENDS)
def test_leak_rate_below_the_sealing_pressure(inlet, outlet):
    """At P₀ = p_in + 0.8 p* both leak alike, at any pressure of the inlet and the outlet.

    The dry contact on these samples conducts 2, 6 and 12 % too little at 0.8, 0.85 and 0.9 p*, and
    the first weighs most.
    """
    load = inlet + 0.8
    assert leak_rate(load, inlet, outlet) == pytest.approx(leak_rate(1.0, 0.2, 0.1), rel=0.04)
    state = state_at(load, inlet, outlet)
    assert state.converged
    assert state.leak_rate.value == pytest.approx(leak_rate(load, inlet, outlet), rel=0.05)


@pytest.mark.slow
def test_a_film_that_loses_its_pressure_just_before_the_outlet():
    """Closed under the outlet's pressure alone, open under the inlet's: the integral leaks.

    The pressure falls to the outlet's in the last pixel, half of which is film under a node. So the
    error is of first order in the pixel: half as long ones halve it, and what they change is the
    error that is left. One per cent is the error of 32 samples across a wave, see above.
    """
    load, inlet, outlet = 1.3, 0.5, 0.0
    assert load - outlet > 1 > load - inlet
    exact, pixels = leak_rate(load, inlet, outlet), {"representation": "constant"}
    states = [
        state_at(load, inlet, outlet, nx, method="finite-difference", **pixels) for nx in (32, 64)
    ]
    assert all(state.converged for state in states)
    coarse, fine = (state.leak_rate.value / exact for state in states)
    claims = sum(state.error for state in states)
    assert coarse < fine < 1
    assert 2 * fine - coarse == pytest.approx(1, abs=0.01 + claims)


def test_a_row_that_closes_before_the_outlet_leaves_a_range():
    """Between the last vertex and the outlet no vertex holds the pressure: the last row closes.

    Only pixels far shorter than a wave, over which the solid bends, leave it open.
    """
    load, inlet, outlet = 1.3, 0.5, 0.0
    state = state_at(load, inlet, outlet, nx=16, method="finite-difference")
    assert state.is_range
    assert state.lowest <= leak_rate(load, inlet, outlet) <= state.highest


@pytest.mark.parametrize(("inlet", "outlet"), [*ENDS, (0.5, 0.0)])
def test_sealed_above_the_sealing_pressure(inlet, outlet):
    """Certainly so: sealed with the inlet's pressure everywhere as well."""
    state = state_at(inlet + 1.03, inlet, outlet)
    assert (state.state, state.converged) == ("sealed", True)
