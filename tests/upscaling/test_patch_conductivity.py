"""K(w) of patches by contact and flow, against Westergaard's closed form."""

import numpy as np
import pytest
from scipy.integrate import quad
from westergaard import waves_along_the_flow

from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.scene import Scene
from fem_seal.upscaling import (
    EndPressures,
    Hertz,
    StraightPath,
    Uniform,
    seal_flow,
)
from fem_seal.upscaling.patch_conductivity import LoadedPatch, refined

AMPLITUDE, WAVELENGTH, E_STAR = 1e-6, 64e-6, 1e7
FULL = np.pi * E_STAR * AMPLITUDE / WAVELENGTH
WAVES = {"amplitude": AMPLITUDE, "wavelength": WAVELENGTH, "full": FULL, "viscosity": 1e-3}
STRIP = StraightPath(2e-3, 0.15)


def scene(**more):
    sections = {
        "surface": {
            "kind": "self-affine",
            "shape": [32, 32],
            "size": [32e-6, 32e-6],
            "hurst": 0.8,
            "long_wavelength": 8e-6,
            "short_wavelength": 4e-6,
            "rms_slope": 0.1,
        },
        "solid": {"contact_modulus": E_STAR},
        "contact": {"pressure": 1.0},
        "fluid": {"viscosity": 1e-3},
        "flow": {"pressure_drop": 1e5, "sides": "periodic", "rtol": 0.01},
        "output": {"products": ["leak_rate"]},
    }
    return Scene.from_mapping(sections | more)


def waves(samples):
    """Patch of one wave along the flow, with so many samples across it."""
    spacing = WAVELENGTH / samples
    y = spacing * np.arange(samples)
    heights = np.tile(AMPLITUDE * np.cos(2 * np.pi * y / WAVELENGTH), (4, 1))
    return LoadedPatch(
        Patch(scene(), surface=GridField(heights, (spacing, spacing), periodic=True))
    )


@pytest.fixture(scope="module")
def fine_waves():
    return waves(256)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.4])
def test_conductivity_of_waves(fine_waves, share):
    """The open width is known to a sample: K, which falls faster than its third power, to 3 %."""
    lower, upper = fine_waves.bounds(share * FULL)
    exact = waves_along_the_flow(share * FULL, **WAVES)
    assert lower == pytest.approx(exact, rel=0.03)
    assert lower <= upper <= 1.011 * lower


@pytest.mark.parametrize("uniform", [True, False])
def test_seal_of_waves(fine_waves, uniform):
    """A seal of waves along the flow: quadrature of Westergaard's K, in a table as fine as 400."""
    P, ends = 0.5 * FULL, EndPressures(0.3 * FULL)
    profile = Uniform(P, 2e-3) if uniform else Hertz(P, 2e-3)

    def flow_of(table):
        return seal_flow(table, profile, STRIP, ends)

    outcome = refined(fine_waves, flow_of, P, ends.inlet, 0.0, uniform=uniform, tolerance=0.2)
    assert outcome.converged
    assert outcome.flow.upper < 1.23 * outcome.flow.lower
    if uniform:
        exact, _ = quad(lambda p: waves_along_the_flow(P - p, **WAVES), 0, ends.inlet)
        exact *= 75
    else:
        from test_seal_flow import table_of

        exact = flow_of(table_of(np.linspace(0, P, 401), WAVES)).value
    assert outcome.flow.lower * 0.97 < exact < outcome.flow.upper * 1.03
    # ln K is interpolated, and K itself is off by up to 3 %.
    assert outcome.flow.value == pytest.approx(exact, rel=0.05)


def rough():
    return LoadedPatch(Patch(scene()))


def test_loads_gather_where_it_matters():
    """Between the loads that the pressure drop does not touch no load is added."""
    patch = rough()
    P, ends = 3e5, EndPressures(1e5)
    uniform = Uniform(P, 2e-3)
    outcome = refined(
        patch,
        lambda t: seal_flow(t, uniform, STRIP, ends),
        P,
        1e5,
        0.0,
        uniform=True,
        tolerance=0.3,
    )
    loads = outcome.table.loads
    assert outcome.converged
    assert (loads.min(), loads.max()) == (2e5, 3e5)
    # Under a uniform pressure the leak rate is ∫ K dp, nearly all of it at low net loads.
    assert np.diff(loads)[0] < np.diff(loads)[-1]


def test_a_seal_that_is_sealed_needs_one_contact():
    patch = rough()
    P, ends = 9e6, EndPressures(1e5)
    outcome = refined(
        patch, lambda t: seal_flow(t, Hertz(P, 2e-3), STRIP, ends), P, 1e5, 0.0, uniform=False
    )
    assert outcome.flow.state == "sealed"
    assert outcome.table.loads.tolist() == [P - 1e5]


def test_too_few_loads_are_said():
    ends = EndPressures(1e5)
    outcome = refined(
        rough(),
        lambda t: seal_flow(t, Uniform(3e5, 2e-3), STRIP, ends),
        3e5,
        1e5,
        0.0,
        uniform=True,
        tolerance=0.05,
        most_loads=4,
    )
    assert not outcome.converged
    assert "at most 4 loads" in outcome.reason


def test_order_of_the_loads_does_not_matter():
    """There is no memory in an elastic contact: K is that of a contact solved from nothing."""
    one, other = rough(), rough()
    up = [one.bounds(load) for load in (1e5, 2e5, 3e5)]
    down = [other.bounds(load) for load in (3e5, 1e5, 2e5)]
    for (lower, upper), (low, high) in zip(up, [down[1], down[2], down[0]], strict=True):
        assert lower <= high * 1.001
        assert low <= upper * 1.001
