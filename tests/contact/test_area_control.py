"""Load control by the contact area, a step function of the pressure."""

import numpy as np
import pytest
from contact_cases import E_STAR, SOLID, check_equilibrium, rough_surface

from fem_seal.contact import CONTACT_METHODS, ContactStopping, Load, press
from fem_seal.contact.area_control import SMALLEST_STEP
from fem_seal.grid import GridField


@pytest.mark.parametrize(
    ("hurst", "wanted", "solver"),
    [
        (0.4, 0.003, "free-set-cg"),
        *((0.8, 0.2, solver) for solver in CONTACT_METHODS),
        (0.4, 0.95, "free-set-cg"),
    ],
)
def test_area_is_reached(hurst, wanted, solver):
    height, stopping = rough_surface((96, 96), hurst=hurst, short=1), ContactStopping(solver)
    state = press(height, SOLID, Load("area_fraction", wanted), stopping)
    check_equilibrium(state, height, 1e-6)
    within = max(1e-3 * wanted, 0.5 / height.values.size)
    # One sample more: the last digits of the solution may turn an undecided one.
    assert abs(state.contact_area_fraction - wanted) <= within + 1 / height.values.size
    back = press(height, SOLID, Load("pressure", state.mean_pressure), stopping)
    assert np.count_nonzero(state.contact != back.contact) <= 1


@pytest.mark.parametrize("wanted", [0.05, 0.45, 0.6, 0.95])
def test_jumps_of_the_area(wanted):
    """Plateaus of a checkerboard touch together: half or all of the surface, the nearer one."""
    checker = (np.indices((16, 16)) // 4).sum(axis=0) % 2
    height = GridField(checker * 1e-6, (1e-6, 1e-6), periodic=True)
    state = press(height, SOLID, Load("area_fraction", wanted))
    check_equilibrium(state, height, 1e-6)
    areas = [
        press(height, SOLID, Load("pressure", p * E_STAR)).contact_area_fraction
        for p in np.geomspace(1e-4, 4, 60)
    ]
    nearest = min(abs(area - wanted) for area in areas)
    assert abs(state.contact_area_fraction - wanted) <= nearest + 1e-12


def test_the_state_at_a_jump_is_next_to_it():
    """The last samples of a wave touch together at the pressure of full contact, π E* h/λ.

    All samples touch under any pressure above it. The search ends between two that differ by
    `SMALLEST_STEP` at most, one on each side of the jump; the contacts are solved far more exactly.
    """
    wave = np.cos(np.arange(32) * np.pi / 16)[:, None] * np.full(32, 1e-6)
    height = GridField(wave, (1e-6, 1e-6), periodic=True)
    state = press(height, SOLID, Load("area_fraction", 0.999), ContactStopping(tolerance=1e-12))
    assert state.contact.all()
    full = np.pi * E_STAR * 1e-6 / 32e-6
    assert state.mean_pressure == pytest.approx(full, rel=SMALLEST_STEP)


@pytest.mark.parametrize("unit", [1e-90, 1e90])
def test_nearly_flat_and_steep_surfaces(rough, unit):
    """Elasticity is linear: the same area for heights in any unit, the pressure in that unit."""
    wanted = press(rough, SOLID, Load("area_fraction", 0.2))
    scaled = GridField(rough.values * unit, rough.spacing, periodic=True)
    state = press(scaled, SOLID, Load("area_fraction", 0.2))
    assert state.contact_area_fraction == wanted.contact_area_fraction
    # The search takes the same steps but for rounding.
    assert state.mean_pressure == pytest.approx(unit * wanted.mean_pressure, rel=1e-9)


def test_less_than_one_sample(rough):
    state = press(rough, SOLID, Load("area_fraction", 1e-9))
    assert state.contact.sum() == 1


def test_work_of_the_search_is_counted(rough):
    """The last trial starts near and costs no more than one contact; the others end as soon as
    their side is known, and cost together no more than another one."""
    by_area = press(rough, SOLID, Load("area_fraction", 0.3))
    by_pressure = press(rough, SOLID, Load("pressure", by_area.mean_pressure))
    assert by_area.iterations > by_pressure.iterations
    assert by_area.fft_pairs > by_pressure.fft_pairs
    assert by_area.fft_pairs < 2 * by_pressure.fft_pairs
