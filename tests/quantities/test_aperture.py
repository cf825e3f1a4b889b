"""Hydraulic aperture: the cubic law read backwards."""

from functools import partial

import numpy as np
import pytest
from project import RING, leak_rate

from fem_seal.errors import Inconsistent
from fem_seal.film import GridFilm
from fem_seal.fluid import GasDrive
from fem_seal.grid import GridField
from fem_seal.leak_rate import Estimate, LeakRate
from fem_seal.patch import Patch
from fem_seal.quantities.aperture import hydraulic_aperture, uniform_rectangle
from fem_seal.quantities.of_patch import quantities
from fem_seal.scene import Scene

VISCOSITY, DROP = 1e-3, 1e5


def aperture(leak, film, viscosity, pressure_drop):
    """Aperture on a rectangle, measured by a uniform film of another height."""
    uniform = uniform_rectangle(film, 3e-6, viscosity, pressure_drop)
    return hydraulic_aperture(leak, uniform, 3e-6)


def test_bounds_of_both_leak_rates_widen_those_of_the_aperture():
    """h³ over that of the uniform film lies between the least and the largest ratio of the two."""
    rate = partial(LeakRate, state="leaking", method="")
    leak, uniform = rate(1.0, 0.5, 2.0), rate(1.0, 0.8, 1.25)
    found = hydraulic_aperture(leak, uniform, 3e-6)
    ends = 3e-6 * np.cbrt([0.5 / 1.25, 2 / 0.8])
    assert (found.lower, found.upper) == pytest.approx(ends, rel=1e-14)
    for crossed in ((1.0, 1.1, 2.0), (1.0, 0.5, 0.9), (np.nan, 0.5, 2.0)):
        with pytest.raises(Inconsistent):
            Estimate(*crossed)


def test_without_bounds_and_sealed():
    film = GridFilm(GridField(np.ones((3, 3)), (1.0, 1.0)))
    estimate = LeakRate(1 / 12, state="leaking", method="finite-difference")
    found = aperture(estimate, film, 1.0, 1.0)
    assert (found.value, found.lower, found.upper) == (pytest.approx(1.0), None, None)
    sealed = aperture(LeakRate.sealed("adaptive"), film, 1.0, 1.0)
    assert (sealed.value, sealed.lower, sealed.upper) == (0, 0, 0)


def test_the_aperture_of_a_ring_of_uniform_gap_is_that_gap():
    """The ring's own conductance, 2π/ln(r2/r1), cancels; its mesh is the same for both films."""
    asked = {"flow.rtol": 0.02, "output.products": ["hydraulic_aperture"]}
    scene = Scene.from_mapping(RING).with_(asked)
    found = quantities(Patch(scene)).hydraulic_aperture
    assert found.lower <= 3e-6 <= found.upper
    # Both leak rates are known to 2 %: together 4 %, a third of that for the height.
    assert found.upper - found.lower <= 0.04 / 3 * 3e-6 * (1 + 1e-2)
    assert found.value == pytest.approx(3e-6, rel=1e-9)


@pytest.mark.parametrize(
    ("representation", "periodic", "law", "height"),
    [
        *(
            (kind, around, None, 2e-6)
            for kind in ("linear", "constant")
            for around in (False, True)
        ),
        *(("linear", False, law, 3e-8) for law in (None, "first-order", "kinetic")),
        *(("constant", True, law, 2e-6) for law in ("first-order", "kinetic")),
    ],
)
def test_a_smooth_channel_is_its_own_aperture(representation, periodic, law, height):
    """Whatever the grid covers, (n-1) or n intervals; measured by a film of 200 nm.

    From 30 nm, where slip carries most of the gas, to 2 um.
    """
    air = GasDrive(2e5, 1e5, 293.15, 0.02896, 273.15, 101325.0)
    slip = None if law is None else air.slip(1.8e-5, 1.0, law)
    gap = GridField(np.full((6, 9), height), (1e-6, 3e-6), periodic)
    film = GridFilm(gap, "wall", representation)
    flow = {"viscosity": 1.8e-5, "pressure_drop": air.pressure_drop, "slip": slip}
    leak = leak_rate(film, rtol=0.01, **flow)
    found = hydraulic_aperture(leak, uniform_rectangle(film, 2e-7, **flow), 2e-7, slip)
    # From 30 nm on, where leaving slip out makes the aperture 5^(1/3) times as large: 70 % more.
    assert slip is None or slip.mean_gain(3e-8) > 5
    # A kinetic law is tabulated to 2e-4; it moves the height by a third of that or more.
    assert found.value == pytest.approx(height, rel=2e-4 if law == "kinetic" else 1e-7)
    assert found.lower <= height * (1 + 1e-7)
    assert found.upper >= height * (1 - 1e-7)
