"""Every state is an equilibrium, whatever the method, grid, units and start."""

import numpy as np
import pytest
from contact_cases import E_STAR, SLOPE, check_equilibrium, energy_distance, pressed, rough_surface
from hypothesis import given, settings
from hypothesis import strategies as st

from fem_seal.contact import CONTACT_METHODS, Arithmetic, ContactStopping
from fem_seal.contact.halfspace import HalfSpace
from fem_seal.contact.problem import Problem
from fem_seal.grid import GridField
from fem_seal.surface import rms_height

LOADS = [0.004, 0.05, 0.2, 0.6]


@pytest.mark.parametrize("solver", CONTACT_METHODS)
@pytest.mark.parametrize("load", LOADS)
def test_methods_agree_to_the_certificate(rough, solver, load):
    """F(p) - F* <= ε P h_rms per area, and F is the S-norm's square plus a linear part, so that
    two certified pressures are closer than (√ε1 + √ε2)² P h_rms in energy."""
    pressure = load * E_STAR * SLOPE
    state = pressed(rough, load, ContactStopping(solver))
    exact = pressed(rough, load, ContactStopping(tolerance=1e-10), Arithmetic(precision="double"))
    check_equilibrium(state, rough, 1e-6)
    assert state.mean_pressure == pytest.approx(pressure, rel=1e-13)
    bound = (state.certificate**0.5 + exact.certificate**0.5) ** 2 * pressure * rms_height(rough)
    assert energy_distance(state.pressure, exact.pressure) <= bound
    # A sample may change sides only where it is undecided at 1e-6 of the rms height.
    assert np.count_nonzero(state.contact != exact.contact) <= 1


@pytest.mark.parametrize("part", [-1e-2, 1e-5, 1e-2])
def test_the_certificate_of_a_prescribed_mean_gap(part):
    """A spike with a wrong total p: F = S p²/2 - (h - ḡ) p is S (p - p*)²/2 above its minimum."""
    solid, heights = HalfSpace((8, 8), (1.0, 1.0)), np.zeros((8, 8))
    heights[2, 3] = 1.0
    own = solid.displacement(heights)[2, 3]
    problem = Problem(heights - heights.mean(), solid, mean_gap=0.5)
    pressure = np.zeros((8, 8))
    exact = (problem.heights[2, 3] - 0.5) / own
    pressure[2, 3] = total = (1 + part) * exact
    gap = problem.gap(pressure)
    found = problem.measures(pressure, gap)
    rise = own * (total - exact) ** 2 / 2
    assert rise <= found.certificate * total * max(1, 2 * exact / total - 1)
    # The spike's own gap.
    assert found.certificate == pytest.approx(own * abs(total - exact), rel=1e-9)


GRIDS = st.sampled_from([(32, 24), (37, 53), (61, 61), (128, 8), (7, 64), (64, 1), (2000, 2)])


@given(st.integers(0, 1000), GRIDS, st.floats(-8, 1).map(lambda x: 10**x), st.floats(0.05, 1))
@settings(max_examples=40, deadline=None)
def test_random_surfaces(seed, shape, load, hurst):
    height = rough_surface(shape, hurst=hurst, short=1, seed=seed)
    check_equilibrium(pressed(height, load), height, 1e-6)


def test_height_offset_does_not_matter(rough):
    """A plane 1e6 rms heights away costs six digits of the heights, not the contact."""
    shifted = GridField(rough.values + 1e6 * rms_height(rough), rough.spacing, periodic=True)
    one, other = (pressed(height, 0.1) for height in (rough, shifted))
    assert np.count_nonzero(one.contact != other.contact) <= 1


SYMMETRIES = {
    "shift": lambda a: np.roll(a, (5, 11), (0, 1)),
    "mirror": lambda a: a[::-1],
    "swap": lambda a: a.T,
}


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_symmetries(rough, symmetry):
    moved = SYMMETRIES[symmetry]
    state = pressed(rough, 0.15, ContactStopping(tolerance=1e-8))
    height = GridField(moved(rough.values), rough.spacing, periodic=True)
    other = pressed(height, 0.15, ContactStopping(tolerance=1e-8))
    assert np.array_equal(moved(state.contact), other.contact)
    assert other.mean_gap == pytest.approx(state.mean_gap, rel=1e-9)


def test_start_changes_the_work_only(rough):
    sharp = ContactStopping(tolerance=1e-9)
    cold, near = pressed(rough, 0.1, sharp), pressed(rough, 0.12)
    for start in (near, near.pressure.values, np.zeros(rough.shape)):
        warm = pressed(rough, 0.1, sharp, start=start)
        assert np.array_equal(warm.contact, cold.contact)
    assert pressed(rough, 0.1, start=cold).iterations == 0


def test_order_of_the_methods(rough):
    """Each method needs fewer transforms than the one it came from.

    On ten surfaces FISTA takes 1.5 times fewer than the damped dynamics (without its momentum twice
    as many), and free-set-cg 3.1 to 4.1 times fewer than Polonsky and Keer's method.
    """
    pairs = {
        solver: pressed(rough, 0.2, ContactStopping(solver)).fft_pairs for solver in CONTACT_METHODS
    }
    assert pairs["fista"] < pairs["damped"]
    assert 2 * pairs["free-set-cg"] < pairs["polonsky-keer"]
