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


SHARES = (1e-6, 0.5, 1 - 1e-6)


@pytest.mark.parametrize("share", [*SHARES, 1.0, 1.3, 1e6], ids=lambda share: f"{share:.6g}")
def test_inlet_pressures_in_parts_of_the_load(share):
    """The contact is scaled to what the fluid leaves of the load, to rounding."""
    patch = lifted(share)
    state = patch.lifted
    assert state.converged
    if patch.lifted_off:
        assert state.fluid_load >= LOAD
    else:
        carried = state.contact.mean_pressure + state.fluid_load
        assert carried == pytest.approx(LOAD, rel=1e-12)
    low, high = lift_range(Patch(scene(LOAD, share * LOAD, N, lift="range")))
    if share >= 1:
        assert high.state == "lifted off"
        return
    assert low.lower <= patch.leak_rate.upper
    assert patch.leak_rate.lower <= high.upper


def test_more_leaks_per_pressure_drop_the_more_the_fluid_lifts():
    """By the bounds of both."""
    rates = [(lifted(share).leak_rate, share) for share in SHARES]
    for (less, low), (more, high) in pairwise(rates):
        assert more.upper / high >= less.lower / low


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
