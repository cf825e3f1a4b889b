"""Hydraulic aperture: the cubic law read backwards."""

import numpy as np
import pytest

from fem_seal.flow import leak_rate
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.quantities.aperture import hydraulic_aperture

VISCOSITY, DROP = 1e-3, 1e5


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("periodic", [False, True])
def test_a_smooth_channel_is_its_own_aperture(representation, periodic):
    """Whatever the grid covers: (n-1) or n intervals."""
    gap = GridField(np.full((6, 9), 2e-6), (1e-6, 3e-6), periodic)
    leak = leak_rate(
        gap, viscosity=VISCOSITY, pressure_drop=DROP, representation=representation, rtol=0.01
    )
    found = hydraulic_aperture(leak, gap, representation, VISCOSITY, DROP)
    assert found.value == pytest.approx(2e-6, rel=1e-7, abs=0)
    assert found.lower <= 2e-6 * (1 + 1e-11)
    assert found.upper >= 2e-6 * (1 - 1e-11)


def test_layers_across_and_along():
    """Across: h³ is the harmonic mean of g³ (bounds), along: the arithmetic one."""
    heights = np.array([1e-6, 2e-6])
    for axis, mean in ((0, 2 / np.sum(heights**-3)), (1, np.mean(heights**3))):
        layers = np.repeat(heights, 4)
        gap = np.broadcast_to(np.expand_dims(layers, 1 - axis), (8, 8))
        field = GridField(gap, (1e-6, 1e-6))
        leak = leak_rate(
            field, viscosity=VISCOSITY, pressure_drop=DROP, representation="constant", rtol=0.01
        )
        found = hydraulic_aperture(leak, field, "constant", VISCOSITY, DROP)
        assert found.lower * (1 - 1e-9) <= np.cbrt(mean) <= found.upper * (1 + 1e-9)
        assert found.upper - found.lower <= 0.01 / 3 * found.value


def test_without_bounds_and_sealed():
    gap = GridField(np.ones((3, 3)), (1.0, 1.0))
    estimate = LeakRate("leaking", "finite-difference", 1 / 12)
    found = hydraulic_aperture(estimate, gap, "linear", 1.0, 1.0)
    assert (found.value, found.lower, found.upper) == (pytest.approx(1.0), None, None)
    sealed = hydraulic_aperture(LeakRate.sealed("adaptive"), gap, "linear", 1.0, 1.0)
    assert (sealed.value, sealed.lower, sealed.upper) == (0, 0, 0)
