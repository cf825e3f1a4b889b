"""Fluids that hardly press, and fluids that carry nearly the whole load."""

from functools import cache
from itertools import pairwise

import pytest
from lifted_scenes import scene

from fem_seal.patch import Patch
from fem_seal.quantities.lift import lift_range

LOAD = 1.5e5  # Pa, what solid and fluid carry together
N = 16  # samples a side


@cache
def lifted(share):
    """The rough rubber with an inlet pressure in parts of the load, its outlet at ambient."""
    return Patch(scene(LOAD, share * LOAD, N))


def assert_loads_balance(patch):
    """The contact is scaled to what the fluid leaves of the load, to rounding."""
    state = patch.lifted
    assert state.contact.mean_pressure + state.fluid_load == pytest.approx(LOAD, rel=1e-12)


SHARES = (1e-6, 0.5, 1 - 1e-6)


@pytest.mark.parametrize("share", SHARES, ids=lambda share: f"{share:.6g}")
def test_shares(share):
    """Inlet pressures in parts of the load, from 1e-6 to 1."""
    patch = lifted(share)
    assert patch.lifted.converged
    assert_loads_balance(patch)
    low, high = lift_range(Patch(scene(LOAD, share * LOAD, N, lift="range")))
    leak = patch.leak_rate
    assert low.lower <= leak.upper
    assert leak.lower <= high.upper


def test_more_leaks_per_pressure_drop_the_more_the_fluid_lifts():
    """By the bounds of both."""
    rates = [(lifted(share).leak_rate, share) for share in SHARES]
    for (less, low), (more, high) in pairwise(rates):
        assert more.upper / high >= less.lower / low


@pytest.mark.parametrize("share", [1.0, 1.3, 1e6], ids=lambda share: f"{share:g}")
def test_inlet_above_the_load(share):
    """Inlet pressures at and above the load, from 1 to 1e6 times."""
    patch = lifted(share)
    state = patch.lifted
    assert state.converged
    assert lift_range(Patch(scene(LOAD, share * LOAD, N, lift="range")))[1].state == "lifted off"
    if patch.lifted_off:
        assert state.fluid_load >= LOAD
        return
    assert_loads_balance(patch)


def test_lift_units():
    """Pressures and moduli in another unit."""
    unit = 1e9
    solid = {"contact_modulus": 1e7 * unit}
    reference = lifted(2 / 3)
    scaled = Patch(scene(LOAD * unit, 1e5 * unit, N, solid=solid))
    assert scaled.lifted.steps == reference.lifted.steps
    value = reference.leak_rate.value * unit
    # Rounding moves single samples at the rim of contact.
    assert scaled.leak_rate.value == pytest.approx(value, rel=reference.lifted.error)
