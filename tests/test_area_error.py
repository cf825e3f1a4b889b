"""What the search for a contact area leaves open in the leak rate, against whole solutions.

A contact under a known pressure stands for the end of a search: any area may have been asked for.
The leak rate at that area is found by bisection on the pressure.
"""

from math import log

import numpy as np
import pytest
from lift_campaign import RTOL, random_scene
from lifted_scenes import from_pressure, problem_of
from project import FIRST

from fem_seal.area_error import AREA_SAFETY, WITHOUT_NETWORK, area_error
from fem_seal.contact.settings import Load
from fem_seal.coupling import lifted_state
from fem_seal.grid_series import critical_gap
from fem_seal.leak_rate import log_ratio
from fem_seal.network.network import Network
from fem_seal.patch import Given, Patch
from fem_seal.quantities.uncertainties import error_budget
from fem_seal.scene import Scene
from fem_seal.sensitivity import LOAD_TOLERANCE, ByLoad

LOAD, STEP = 1.4e5, 1e-4  # Pa, and its relative step


def scene(*settings: str) -> Scene:
    """Rough rubber of 48² samples under a pressure, whose flow has no error of its own."""
    return Scene.from_file(
        FIRST,
        [
            "surface.shape=[48, 48]",
            "surface.short_wavelength=10 um",
            "contact.tolerance=1e-10",
            "flow.method=finite-difference",
            'output.products=["leak_rate"]',
            "accuracy.contact_grid=false",
            *settings,
        ],
    )


@pytest.fixture
def one_network(monkeypatch):
    """That of the samples: the fluid's pressure has no error of its own, either."""
    monkeypatch.setattr(Network, "refined", lambda network, *_: network)


def touching(patch: Patch) -> int:
    return int(np.count_nonzero(patch.film_contact.contact))


def pressures(patch: Patch) -> np.ndarray:
    """Contact pressures of a patch whose flow has been solved [Pa]."""
    assert patch.leak_rate.converged
    return patch.film_contact.pressure.values


def asked_for(patch: Patch, samples: float) -> Patch:
    """The same contact as the end of a search for an area of so many samples."""
    area = Load("area_fraction", samples / patch.surface.values.size)
    asked = patch.with_(Given(contact=patch.contact, load=area))
    asked.lifted = patch.lifted
    return asked


def passed_at(patch: Patch, samples: float, side: int) -> Patch:
    """The patch at a pressure, to 2 %, beyond which the number passes `samples` on one side."""

    def at(part: float) -> Patch:
        return patch.pressed_by(patch.carried_load * (1 + side * part), patch.lift)

    def is_beyond(one: Patch) -> bool:
        return touching(one) > samples if side > 0 else touching(one) < samples

    low, high = 0.0, 1e-3
    while not is_beyond(far := at(high)):
        low, high = high, 2 * high
    for _ in range(6):
        middle = (low + high) / 2
        if is_beyond(tried := at(middle)):
            high, far = middle, tried
        else:
            low = middle
    return far


def changes_to(other: Patch, known: Patch) -> tuple[float, float]:
    """|Δ ln Q| from one patch to the other: the true one, and that of the constriction alone."""
    gaps = critical_gap(other), critical_gap(known)
    rates = other.leak_rate.value, known.leak_rate.value
    return log_ratio(*rates), 3 * log_ratio(*gaps)


LIFTED = [
    *("surface.shape=[32, 32]", "surface.short_wavelength=15 um"),
    *("flow.lift=resolved", "flow.pressure_drop=112 kPa", "flow.rtol=1e-3"),
]
# Open through a corner of two samples, which the network of every second sample does not see.
NARROW = [
    *("surface.shape=[64, 64]", "surface.short_wavelength=7.5 um", "surface.seed=5"),
    *("flow.method=adaptive", "flow.rtol=0.02"),
]


@pytest.mark.parametrize(
    ("pressure", "settings", "more"),
    [
        *((0.18, ["flow.lift=none"], k) for k in (-5.4, 0.0, 5.4)),
        *((0.05, ["flow.lift=none"], k) for k in (-5.4, 5.4)),
        (0.14, LIFTED, 5.4),
        (0.2, ["flow.lift=none", *NARROW], -0.4),
    ],
)
def test_the_leak_rate_at_the_asked_area_is_enclosed(one_network, pressure, settings, more):
    """Far from closing and next to it; a whole number of samples holds in a range of loads.

    The claim is AREA_SAFETY times the larger of both changes of ln Q: the true one, and that of the
    critical constriction alone. They are taken as linear in the load, which leaves out their
    squares, and the load is known to 2 %.
    """
    known = Patch(scene(f"contact.pressure={pressure} MPa", *settings))
    asked = touching(known) + more
    error = area_error(asked_for(known, asked))
    for side, factor in ((1, error.lower), (-1, error.upper)):
        if side * more < 0:
            assert factor == 1
            continue
        true, alone = changes_to(passed_at(known, asked, side), known)
        claim, larger = abs(log(factor)), max(true, alone)
        assert factor < 1 if side > 0 else factor > 1
        assert true <= claim == pytest.approx(AREA_SAFETY * larger, rel=0.02 + larger / 2)


def test_contact_pressure_follows_the_load(one_network):
    """∂p_c/∂P of a lifted contact against a difference quotient, in which no sample changes."""

    def at(part: float) -> Patch:
        return Patch(scene(*LIFTED, "flow.rtol=1e-6", f"contact.pressure={part * LOAD} Pa"))

    here, more, less = (at(1 + step) for step in (0, STEP, -STEP))
    quotient = (pressures(more) - pressures(less)) / (2 * STEP * LOAD)
    problem = problem_of(here.scene, here.surface)
    by = ByLoad(problem, here.film_contact, here.lifted, here.film.constriction.gap)
    touches = here.film_contact.contact
    assert np.array_equal(touches, more.film_contact.contact | less.film_contact.contact)
    off = np.linalg.norm((by.pressure - quotient)[touches])
    # The tolerance of its linear solves; the fluid's own share in it is 0.07.
    assert off < LOAD_TOLERANCE * np.linalg.norm(quotient)


def test_a_sealed_film_that_opens():
    """Just sealed, a few samples less open a path; more, or far from opening, none does."""
    sealed = Patch(scene("contact.pressure=0.195 MPa", "flow.lift=none"))
    assert sealed.sealed
    for more in (5.4, 0.4, -0.4):
        error = area_error(asked_for(sealed, touching(sealed) + more))
        assert (error.lower, error.upper, error.upper_rate) == (1, 1, None)
    leaking = sealed
    while leaking.sealed:
        leaking = sealed.pressed_by(0.995 * leaking.carried_load)
    just = sealed.pressed_by(leaking.carried_load / 0.995)
    for samples in (touching(just) - 0.5, touching(leaking)):
        error = area_error(asked_for(just, samples))
        true = passed_at(just, samples, -1).leak_rate.value
        assert error.lower == 1
        if true > 0:
            assert error.upper is None
            assert true <= error.upper_rate
    assert true > 0  # of the second area, at which a path is open


def test_a_sealed_lifted_film_that_opens(one_network):
    """By finite differences, whose leak rate has no bounds."""
    sealed = Patch(scene(*LIFTED, "flow.rtol=0.3", "contact.pressure=0.27 MPa"))
    lighter = sealed.pressed_by(0.98 * sealed.carried_load, sealed.lift)
    error = area_error(asked_for(sealed, touching(lighter)))
    assert sealed.sealed
    assert (error.lower, error.upper) == (1, None)
    assert 0 < lighter.leak_rate.value <= error.upper_rate


@pytest.mark.parametrize("samples", [300, 600])
def test_a_cut_surface(samples):
    """The plane of the bearing model lies at a sample: the number passes there, or at the next."""

    def cut(samples: float) -> Patch:
        area = f"contact.area_fraction={samples / 48**2}"
        bearing = ["contact.model=bearing", "contact.pressure=", "contact.tolerance="]
        return Patch(scene(*bearing, area, "flow.lift=none"))

    # The plane lies at the sample to rounding, 1e-16 of the heights: 1e-14 of a tight constriction.
    assert area_error(cut(samples - 0.4)).log_error < 1e-12
    error = area_error(cut(samples + 0.4))
    true, alone = changes_to(cut(samples + 1), cut(samples))
    assert error.upper == 1
    assert true <= -log(error.lower) == pytest.approx(WITHOUT_NETWORK * alone, rel=alone)


def test_two_ends_of_one_search():
    """A lifted scene next to closing whose two starts end 2 of 4096 samples apart."""
    patch = Patch(random_scene(122))
    problem = problem_of(patch.scene, patch.surface)
    states = (
        lifted_state(problem, dry=patch.contact),
        from_pressure(problem, problem.inlet),
    )
    assert all(state.converged for state in states)
    apart = abs(log(states[0].leak_rate.value / states[1].leak_rate.value))
    claims = sum(state.error + RTOL / 2 for state in states)
    solved = [patch.with_(Given()) for _ in states]
    for one, state in zip(solved, states, strict=True):
        one.lifted = state
    errors = [area_error(one) for one in solved]
    assert claims < apart < claims + sum(error.log_error for error in errors)


@pytest.mark.parametrize("load", [["contact.tolerance="], ["contact.model=bearing"]])
def test_less_than_a_sample(load):
    """The highest sample touches at any area, and the others are as at the first touch."""
    some = ["contact.pressure=", "flow.lift=none", "contact.tolerance=", *load]
    asked, touch = (Patch(scene(*some, f"contact.area_fraction={area}")) for area in (1e-10, 0))
    error = area_error(asked)
    assert asked.leak_rate.value == pytest.approx(touch.leak_rate.value, rel=1e-9)
    assert error.lower == 1
    assert error.upper == pytest.approx(1, rel=1e-9)


BY_AREA = ["contact.pressure=", "contact.area_fraction=0.3", "flow.lift=none"]


def test_derivatives_by_the_load_are_solved_once(monkeypatch):
    """The errors of area and contact grid both need them."""
    made = []

    def counted(*arguments: object) -> ByLoad:
        made.append(ByLoad(*arguments))
        return made[-1]

    monkeypatch.setattr("fem_seal.grid_series.ByLoad", counted)
    budget = error_budget(Patch(scene(*BY_AREA, "accuracy.contact_grid=true")))
    assert {"contact_area", "contact_grid"} <= {entry.key for entry in budget if entry.counted}
    assert len(made) == 1
