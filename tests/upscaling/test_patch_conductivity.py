"""K(w) of patches by contact and flow, against Westergaard's closed form."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from known_answers import Wave
from project import AIR, scene_of_samples
from scipy.integrate import quad
from test_seal_flow import exact_table

from fem_seal import flow
from fem_seal.contact import ContactState
from fem_seal.contact.settings import Load
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Given, Patch
from fem_seal.scene import Scene
from fem_seal.surface.cell import periodic_cell
from fem_seal.upscaling import (
    ConductivityTable,
    EndPressures,
    Hertz,
    StraightPath,
    patch_conductivity,
    seal_flow,
    uniform,
)
from fem_seal.upscaling.patch_conductivity import LoadedPatch
from fem_seal.upscaling.refined_table import REST, WIDTH, marked_loads, refined_flow
from fem_seal.upscaling.solved_patches import load_that_matters

WAVE = Wave(1e-6, 64e-6, 1e7)
STRIP = StraightPath(2e-3, 0.15)


def scene(**more):
    made = scene_of_samples(32, long_wavelength="8 um", seed=0)
    made |= {"contact": {"pressure": 1.0}, "output": {"products": ["leak_rate"]}}
    return Scene.from_mapping(made | {"flow": {"pressure_drop": 1e5, "sides": "periodic"}} | more)


RTOL = 0.01  # of the flow at each load


def waves(samples):
    """Patch of one wave along the flow, with so many samples across it."""
    spacing = WAVE.length / samples
    phase = 2 * np.pi * np.arange(samples) / samples
    heights = np.tile(WAVE.height * np.cos(phase), (4, 1))
    surface = GridField(heights, (spacing, spacing), periodic=True)
    return LoadedPatch(Patch(scene(), given=Given(surface=surface)), RTOL)


@pytest.fixture(scope="module")
def fine_waves():
    return waves(256)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.4])
def test_conductivity_of_waves(fine_waves, share):
    """If the order in the sample is one or more, half as many change K by its error at least."""
    lower, upper = fine_waves.bounds(share * WAVE.full)
    coarse, _ = waves(128).bounds(share * WAVE.full)
    exact = WAVE.conductivity(share * WAVE.full, 1e-3)
    assert lower == pytest.approx(exact, abs=abs(lower - coarse))
    assert lower <= upper <= 1.011 * lower


@pytest.mark.parametrize("kind", [uniform, pytest.param(Hertz, marks=pytest.mark.slow)])
def test_seal_of_waves(fine_waves, kind):
    """A seal of waves along the flow: quadrature of Westergaard's K, in a table as fine as 400."""
    P, ends = 0.5 * WAVE.full, EndPressures(0.3 * WAVE.full)
    profile = kind(P, 2e-3)

    outcome = refined_flow(fine_waves, profile, STRIP, ends, tolerance=0.2)
    assert not outcome.reason
    assert outcome.upper < 1.23 * outcome.lower
    if kind is uniform:
        exact, _ = quad(lambda p: WAVE.conductivity(P - p, 1e-3), 0, ends.inlet)
        exact *= 75
    else:
        loads = np.linspace(0, P, 401)
        table = exact_table(loads, [WAVE.conductivity(load, 1e-3) for load in loads])
        exact = seal_flow(table, profile, STRIP, ends).value
    # K of the samples is off by most under the highest load; half as many show by how much.
    off = fine_waves.bounds(P)[0] / waves(128).bounds(P)[0]
    assert outcome.lower / off < exact < outcome.upper * off
    # Between the loads ln K is interpolated, with hardly an error beside that of their flows.
    assert outcome.value == pytest.approx(exact, rel=RTOL)


def rough(rtol=RTOL):
    return LoadedPatch(Patch(scene()), rtol)


def press_all(monkeypatch, load):
    """Let the contact under any load be that under one."""
    solve, one = patch_conductivity.elastic_contact, Load("pressure", load)
    monkeypatch.setattr(
        patch_conductivity,
        "elastic_contact",
        lambda scene, surface, start, target, report: solve(scene, surface, None, one, report),
    )


def test_a_seal_that_is_sealed_needs_no_flow(monkeypatch):
    monkeypatch.setattr(flow, "leak_rate", None)
    patch, P, ends = rough(), 9e6, EndPressures(1e5)
    outcome = refined_flow(patch, Hertz(P, 2e-3), STRIP, ends)
    assert outcome.state == "sealed"
    assert outcome.table.loads[-1] == P - 1e5
    assert set(outcome.table.upper) == {0.0}


def test_loads_share_the_error_evenly():
    """K = exp(-w/c): demand between a and b ∝ exp(-a/3c) - exp(-b/3c), WIDTH × its cube the error.

    The demand is linear in each sixteenth of an interval of the table, in which it falls by 5 %:
    its integral is off by 0.05/8 of a sixteenth at most, and a step has two or three of them.
    """
    c, tolerance = 2e4, 0.05
    table = exact_table([2e5, 2.5e5], np.exp([-10.0, -12.5]))
    flow = seal_flow(table, uniform(3e5, 2e-3), STRIP, EndPressures(1e5))
    loads = marked_loads(table, flow, np.zeros(1, dtype=bool), tolerance, (2e5, 3e5))
    steps = -3 * np.diff(np.exp(-(np.array(list(loads)) - 2e5) / (3 * c)))
    error = WIDTH * steps**3 / -np.expm1(-5)
    first = list(loads).index(2.5e5)
    assert steps[:first] == pytest.approx(steps[0], rel=5e-3)
    # Above the table a sixteenth is half an e-fold, in which the demand falls by 17 %.
    assert steps[first:] == pytest.approx(steps[first], rel=2.5e-2)
    # One load less would not do.
    room = (1 - REST) * tolerance
    assert error.sum() <= room < error.sum() * (first / (first - 1)) ** 2


@pytest.mark.parametrize("profile", [uniform(3.99e5, 2e-3), Hertz(3.99e5, 2e-3)])
def test_without_a_lower_bound_the_sealing_load_is_sought(profile):
    """Net loads up to 2.99e5 Pa leak, 3e5 Pa seal: nothing but a load in between gives a bound."""
    table = exact_table([0, 1e5, 2e5, 3e5, 5e5], [1e-15, 1e-16, 1e-18, 0, 0])
    flow = seal_flow(table, profile, STRIP, EndPressures(1e5))
    assert flow.lower == 0 < flow.upper
    loads = marked_loads(table, flow, np.zeros(4, dtype=bool), 0.1, (0.0, profile.highest))
    assert list(loads) == [2.5e5]


def test_a_quarter_of_a_mirrored_patch_conducts_as_the_whole():
    """17 x 13 points and their images; if one point is moved, the whole patch is the film."""
    whole = Patch(scene()).surface
    surface = periodic_cell(GridField(whole.values[:17, :13], whole.spacing), "mirror")
    heights = surface.values.copy()
    heights[5, 3] -= heights.std()
    uneven = LoadedPatch(
        Patch(scene(), given=Given(surface=replace(surface, values=heights))), RTOL
    )
    patch, full = (
        LoadedPatch(Patch(scene(), given=Given(surface=surface)), RTOL) for _ in range(2)
    )
    full.quartered = False
    for one, shape in (patch, (17, 13)), (full, (33, 25)), (uneven, (33, 25)):
        film = one.film(1e5)
        assert film.samples.shape == shape
        assert not film.sealed
    # The gaps of a contact are known to 1e-5 of the rms height.
    room = 1e-5 * heights.std()
    assert patch.critical_gap(1e5) == pytest.approx(full.critical_gap(1e5), abs=room)
    (lower, upper), (low, high) = patch.bounds(1e5), full.bounds(1e5)
    assert max(lower, low) <= min(upper, high) <= (1 + 2 * RTOL) * min(lower, low)


def test_bounds_that_leave_no_room_for_loads_ask_for_another_tolerance(monkeypatch):
    """No number of loads helps where those at the loads are wider than all may be."""
    tolerance = 0.05
    wide = LeakRate(1e-12, 1e-12, np.exp(1.1 * tolerance) * 1e-12, state="leaking", method="")
    monkeypatch.setattr(flow, "leak_rate", lambda film, settings, **more: wide)
    patch = rough()
    outcome = refined_flow(patch, uniform(3e5, 2e-3), STRIP, EndPressures(1e5), tolerance=tolerance)
    assert outcome.reason.startswith("its bounds at the net loads are no narrower")


def test_the_load_that_matters_leaks():
    """A sealed load below one that leaks has that one's upper bound, but no constriction."""
    loads = np.array([2e5, 2.4e5, 2.8e5])
    table = ConductivityTable(loads, [1e-16, 0, 0], [1e-16, 0, 6e-17])
    flow = seal_flow(table, uniform(3e5, 2e-3), STRIP, EndPressures(1e5))
    gaps = {2e5: 1e-7, 2.8e5: 1e-8}
    assert table.upper[1] > 0
    patch = SimpleNamespace(critical_gap=gaps.get)
    assert load_that_matters(flow, patch) == 2.8e5


@pytest.mark.parametrize("seed", range(4))
def test_the_gap_is_convex_in_the_load(seed):
    """Below its chord between two loads, above its line beyond two: the theorem of the module.

    On the grid too, to the tolerance of the contact, 1e-6 of the pressure: its gaps are known to
    about 1e-5 of the rms height.
    """
    whole = scene()
    surface = whole.surface.model_copy(update={"seed": seed})
    patch = LoadedPatch(Patch(whole.model_copy(update={"surface": surface})), RTOL)
    a, w, b, c = (patch.film(load).gap.values for load in (1e5, 1.6e5, 3e5, 3.2e5))
    room = 1e-5 * patch.patch.surface.values.std()
    assert (w <= 0.7 * a + 0.3 * b + room).all()
    assert (w >= b + 1.4 / 0.2 * (b - c) - 10 * room).all()
    # Neither is nearly an equality: 20 000 times and more was seen.
    assert (w < 0.7 * a + 0.3 * b - 1000 * room).any()


def rough_with_gas(rtol, **fluid):
    """A gas that slips: its law is that of the flow on every mesh."""
    flow = {"inlet_pressure": 2e5, "outlet_pressure": 1e5, "sides": "periodic"}
    return LoadedPatch(Patch(scene(fluid=AIR | fluid, flow=flow)), rtol)


# Powers of a slipping conductivity: test_seal_flow.py.
@pytest.mark.parametrize("rough", [rough, pytest.param(rough_with_gas, marks=pytest.mark.slow)])
def test_enclosures_hold_loads_inside(rough):
    """K at loads inside an interval overlaps its enclosure, which is narrower than its ends.

    The enclosure is 4 to 5 wide, and 1.1 at least from K on either side: flows to 0.03 show it.
    """
    patch, fresh = rough(0.03), rough(0.03)
    a, b = 1.5e5, 2.5e5
    patch.table({a: 1.0, b: 1.0})
    (enclosure,) = patch.enclose().between
    upper_a, lower_b = patch.bounds(a)[1], patch.bounds(b)[0]
    for share in (0.1, 0.5):
        lower, upper = fresh.bounds(a + share * (b - a))
        assert enclosure.lower_at(share) <= upper
        assert enclosure.upper_at(share) >= lower
    middle = enclosure.upper_at(0.5) / enclosure.lower_at(0.5)
    assert middle < (upper_a / lower_b) ** 0.5
    assert enclosure.upper[0] == pytest.approx(upper_a, rel=1e-6)
    assert enclosure.lower[-1] == pytest.approx(lower_b, rel=1e-6)


def test_a_flow_that_is_solved_again_is_not_the_oldest(monkeypatch):
    """Two flows are kept; the first load, solved again after the second, is dropped later."""
    patch = rough(0.1)
    monkeypatch.setattr(patch_conductivity, "KEPT", 2 * patch.film(1.5e5).samples.size)
    for load, multiple in (1.5e5, 3.0), (2.5e5, 3.0), (1.5e5, 1.0), (2e5, 3.0):
        patch.bounds(load, multiple)
    below, _ = patch.enclose().between
    assert below is not None


def test_enclosures_of_a_kinetic_law(monkeypatch):
    """K of a uniform gap that falls in proportion to the load lies inside, also where all gaps lie
    between two kinks of the law's table: there K^n is not convex, and a chord off by 1.4e-5."""
    patch = rough_with_gas(RTOL, slip="kinetic")
    slip = patch.patch.scene.slip
    least = 1.001 * slip.coefficient.kinks[208] * slip.product / slip.mean_pressure
    a, b = 1e5, 2e5

    def gap_at(load):
        return least * (1 + 0.05 * (b - load) / (b - a))

    def uniform_gap(scene, surface, start, target, report):
        gap = np.full(surface.shape, gap_at(target.value))
        gap, none = (replace(surface, values=values) for values in (gap, 0 * gap))
        return ContactState(gap, none, contact_modulus=1e7)

    monkeypatch.setattr(patch_conductivity, "elastic_contact", uniform_gap)
    patch.table({a: 1.0, b: 1.0})
    (enclosure,) = patch.enclose().between
    for share in np.linspace(0.05, 0.95, 19):
        gap = gap_at(a + share * (b - a))
        K = gap**2 * slip.per_square_gap(gap) / (12 * patch.patch.scene.viscosity)
        assert enclosure.lower_at(share) <= K <= enclosure.upper_at(share)


@pytest.mark.parametrize("other", [0.8e5, 2.4e5])
def test_a_load_against_its_enclosure_is_noticed(other, monkeypatch):
    """Steps take over if a load contradicts the enclosure of its interval: K is another load's."""
    patch = rough(0.1)
    patch.table({1e5: 1.0, 2e5: 1.0})
    assert patch.enclose().between != (None,)
    press_all(monkeypatch, other)
    assert set(patch.table({1.5e5: 1.0}).between) == {None}
    assert not patch.convex


def test_bounds_that_cross_enclose_nothing(monkeypatch):
    """A gap that falls faster above the higher load than below it is not convex in the load."""
    patch = rough(0.1)
    patch.table({1e5: 1.0, 2e5: 1.0})
    press_all(monkeypatch, 1e6)
    assert patch.enclose().between == (None,)


def test_few_loads_are_enough():
    """Of steps of the load, whose error falls as 1/n, half the tolerance takes twice as many.

    Enclosures err by the square of an interval at most: by 1/n², and one load more.
    """
    ends, profile, patch = EndPressures(1e5), uniform(3e5, 2e-3), rough(0.02)
    outcomes = [refined_flow(patch, profile, STRIP, ends, tolerance=t) for t in (0.12, 0.06)]
    assert not any(outcome.reason for outcome in outcomes)
    few, more = (outcome.table.loads.size for outcome in outcomes)
    assert few < more <= np.sqrt(2) * few + 1
