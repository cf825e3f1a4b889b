"""The flow through a seal of known patches against closed forms and quadratures of its equation."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from project import refused_calls
from scipy.integrate import quad

from fem_seal.errors import Inconsistent, NotConverged
from fem_seal.fluid import GasDrive, LiquidDrive
from fem_seal.pressure_profile import is_uniform
from fem_seal.rarefied import FIRST_ORDER, LEAST_ACCOMMODATION, kinetic
from fem_seal.upscaling import (
    ConductivityTable,
    EndPressures,
    Hertz,
    RingPath,
    StraightPath,
    TabulatedProfile,
    seal_flow,
    uniform,
)
from fem_seal.upscaling.conductivity import SLIPPING, ConductivitySteps, Enclosure
from fem_seal.upscaling.march import SHOOTING, bracketed_root, path_leak_rate
from fem_seal.upscaling.path_flow import PathFlow

ETA = 1e-3
STRIP = StraightPath(2e-3, 0.15)
BAR = EndPressures(1e5)
GAS_DRIVE = GasDrive(3e5, 1e5, 300.0, 0.029, 273.15, 101325.0)
GAS = EndPressures.of(GAS_DRIVE, (2e5, 0.0))
SMOOTH = (1e-6) ** 3 / (12 * ETA)


def exact_table(loads, conductivity):
    """Table of a conductivity that is known exactly at its loads."""
    return ConductivityTable(loads, conductivity, conductivity)


def exponential(e_fold, top, count=400, K0=SMOOTH):
    """K = K0 exp(-w/e_fold) at loads from 0 to top."""
    loads = np.linspace(0, top, count)
    return exact_table(loads, K0 * np.exp(-loads / e_fold))


def constant(K=SMOOTH, top=1e9):
    return exact_table([0, top], [K, K])


def encloses(flow, exact, width):
    """The bounds hold the exact value, are so narrow, and the value is between them."""
    assert flow.lower <= exact <= flow.upper
    assert flow.lower <= flow.value <= flow.upper
    assert flow.upper / flow.lower - 1 < width


TABLE = TabulatedProfile(np.array([0.0, 1e-3, 2e-3]), np.array([0.0, 3e5, 1e5]))


@pytest.mark.parametrize("profile", [uniform(1e6, 2e-3), Hertz(1e6, 2e-3), TABLE])
def test_a_part_of_the_load_is_that_part_everywhere(profile):
    x = np.linspace(0, 2e-3, 7)
    assert profile.times(0.4)(x) == pytest.approx(0.4 * profile(x))


def test_smooth_strip():
    """A constant K takes no notice of the profile where P > p: Q = K W (p_in - p_out)/L there.

    P = p_in at the distance a √(1 - (p_in/P_max)²) before the middle.
    """
    inlet = 0.2e6
    flow = seal_flow(constant(), Hertz(1e6, 2e-3), STRIP, EndPressures(inlet))
    exact = SMOOTH * 0.15 * inlet / (1e-3 * (1 + np.sqrt(1 - 0.2**2)))
    # At each end of the profile one cell of 1000, of which the open part is not known.
    encloses(flow, exact, 2.1e-3)


@pytest.mark.parametrize("places", [2, 4])
@pytest.mark.parametrize("radii", [(0.01, 0.03), (0.03, 0.01)])
def test_wide_smooth_ring(radii, places):
    """Q = 2π K Δp/ln 3; p is linear in ln r, as is the influence of ln K on ln Q before a place.

    Each of 1000 cells is 20 um long, on which ln r differs from its chord by up to (20 um)²/(8 r²);
    that moves a place by 5e-9 m.
    """
    path = RingPath(*radii)
    profile = TabulatedProfile(np.linspace(0, path.length, places), np.full(places, 1e6))
    flow = seal_flow(constant(), profile, path, BAR)
    encloses(flow, 2 * np.pi * SMOOTH * 1e5 / np.log(3), 1e-8)
    share = path.resistance(flow.path.x) / path.resistance(path.length)
    np.testing.assert_allclose(flow.path.fluid_pressure, 1e5 * (1 - share), atol=1e-3)
    ends = flow.sealing.start, flow.sealing.middle, flow.sealing.end
    inlet, outlet = radii
    exact = [abs(inlet * (outlet / inlet) ** part - inlet) for part in (0.05, 0.5, 0.95)]
    assert ends == pytest.approx(exact, abs=1e-8)


@pytest.mark.parametrize("width", [1e-5, 1e-3, 0.1])
@pytest.mark.parametrize("part", [0.2, 0.9, 0.99])
def test_a_lip_far_narrower_than_the_path(width, part):
    """P rises to P0 and falls again within a part of the path; p_in is a part f of P0.

    K is constant. The lip seals from where P = p_in, on the inlet's side, to its foot: 2 - f of its
    half-width h. There p is linear, and below P. A thousand cells, in each of which P is known to a
    thousandth of p_in, move both ends by a thousandth of h each, or two.
    """
    length, P0 = STRIP.length, 1e6
    h = 0.5 * width * length
    x = 0.37 * length + np.array([-h, 0.0, h])
    lip = TabulatedProfile(np.array([0.0, *x, length]), np.array([0.0, 0.0, P0, 0.0, 0.0]))
    flow = seal_flow(constant(), lip, STRIP, EndPressures(part * P0))
    encloses(flow, SMOOTH * STRIP.circumference * part * P0 / ((2 - part) * h), 0.02)


LINEAR = np.array([4e5, 8e5])


@pytest.mark.parametrize(
    ("profile", "e_fold", "width", "off", "gas"),
    [
        # Steps of 250 Pa: each bound is off by at most exp(250/5e4) = 1.005.
        *((uniform(6e5, 2e-3), 5e4, 0.011, 1e-8, gas) for gas in (False, True)),
        # And of 400 Pa in the profile, of an e-fold of 1e5.
        *((TabulatedProfile([0, 2e-3], P), 1e5, 0.02, 7e-7, False) for P in (LINEAR, LINEAR[::-1])),
        # Some of these six places differ from even ones by rounding alone.
        (TabulatedProfile(0.4e-3 * np.arange(6), np.linspace(*LINEAR, 6)), 1e5, 0.02, 7e-7, False),
    ],
)
def test_exponential_conductivity(profile, e_fold, width, off, gas):
    """K = K0 exp(-(P(x) - p)/c): Q ∫ exp(P/c) dx = W K0 ∫ exp(p/c) dΦ.

    dΦ is dp, of a gas T0 p_abs/(T p0) dp.
    """
    inlet, outlet = (2e5, 0.0) if gas else (1.5e5, 0.2e5)
    drive = GAS_DRIVE if gas else LiquidDrive(inlet - outlet)
    resistance, _ = quad(lambda x: np.exp(profile(x) / e_fold), 0, 2e-3, limit=200)

    def driven(p):
        return np.exp(p / e_fold) * ((p + 1e5) * 273.15 / (300 * 101325) if gas else 1)

    exact = SMOOTH * 0.15 * quad(driven, outlet, inlet)[0] / resistance
    ends = EndPressures.of(drive, (inlet, outlet))
    flow = seal_flow(exponential(e_fold, 1e6, 4001), profile, STRIP, ends)
    encloses(flow, exact, width)
    assert (np.diff(flow.path.x) > 0).all()
    # ln K is linear, as it is interpolated: what is left are 16 steps an interval, of 4e-9 =
    # (250/16/5e4)²/24, of a gas up to twice that since p_abs >= 2 e_fold varies in them, and 1e-9
    # of the search. A cell has the contact pressure of its middle: (400/1e5)²/24 of even cells,
    # and less of those that are finer where it matters.
    assert flow.value == pytest.approx(exact, rel=off)


def test_two_humps_and_an_open_valley():
    """Where P falls below p in a valley the film is open there, and conducts without resistance."""
    x = np.array([0, 0.5, 1.0, 1.5, 2.0]) * 1e-3
    P = np.array([2e5, 5e5, 0.0, 6e5, 1e5])
    inlet, e_fold = 1e5, 1e5
    ends = EndPressures(inlet)
    flow = seal_flow(exponential(e_fold, 1e6, 4001), TabulatedProfile(x, P), STRIP, ends)
    p, places = flow.path.fluid_pressure, flow.path.x
    pressed = np.interp(places, x, P) > p + 1
    valley = ~pressed & (places > 0.5e-3) & (places < 1.5e-3)
    # The second hump, of higher contact pressure, takes most of the drop.
    assert np.interp(1.0e-3, places, p) > 0.5 * inlet
    assert valley.sum() > 10
    assert np.ptp(p[valley]) < 1e-6 * inlet
    # Where P > p, in all of a cell: Q = -W K dp/dx, K from the cell's middle. K is constant in a
    # sixteenth of the table's 250 Pa, of which a half is 8e-5 of the e-fold.
    middle = 0.5 * (places[1:] + places[:-1])
    K = SMOOTH * np.exp(-(np.interp(middle, x, P) - 0.5 * (p[1:] + p[:-1])) / e_fold)
    flux = -np.diff(p) / np.diff(places) * K * 0.15
    inside = pressed[1:] & pressed[:-1]
    assert flux[inside] == pytest.approx(flow.value, rel=8e-5)
    assert flow.lower < flow.value < flow.upper < 1.1 * flow.lower


@pytest.mark.parametrize("profile", [uniform, Hertz])
def test_sealed_if_the_highest_net_load_passes_the_sealing_load(profile):
    table = exact_table([0, 1e5, 2e5, 3e5], [SMOOTH, 0.1 * SMOOTH, 1e-3 * SMOOTH, 0])
    assert table.sealing_load == 3e5
    just_sealed = seal_flow(table, profile(4.001e5, 2e-3), STRIP, BAR)
    assert (just_sealed.state, just_sealed.upper) == ("sealed", 0)
    leaking = seal_flow(table, profile(3.99e5, 2e-3), STRIP, BAR)
    assert leaking.state == "leaking"
    # Between the last leaking load and the sealing one nothing is known but the upper bound.
    assert leaking.lower == 0 < leaking.value < leaking.upper


@pytest.mark.parametrize(
    ("kind", "P", "e_fold", "ends", "loads"),
    [
        (Hertz, 6e5, 5e4, BAR, (5.2e5,)),
        (uniform, 6e5, 5e4, GAS, (4.2e5,)),
        # K falls by e^35.
        (Hertz, 7e5, 2e4, BAR, (4e5, 5.5e5)),
    ],
)
def test_influence(kind, P, e_fold, ends, loads):
    """Of the loads above one [Pa]: by how much ln Q changes when ln K does there."""
    table, profile = exponential(e_fold, 1e6, 2001), kind(P, 2e-3)
    flow = seal_flow(table, profile, STRIP, ends)
    along = flow.path
    for above in loads:
        change = 0.01 * (table.loads > above)
        changed = exact_table(table.loads, table.value * np.exp(-change))
        effect = -np.log(seal_flow(changed, profile, STRIP, ends).value / flow.value)
        influence = along.influences[along.net_loads > above].sum()
        # A step or two of the table at the load itself, and second order in the change of 1 %.
        assert 0.01 * influence == pytest.approx(effect, abs=4e-4)
    assert along.influence.sum() == pytest.approx(1)
    assert along.sealing_length <= 2e-3 * (1 + 1e-9)
    if is_uniform(profile):
        assert along.sealing_length == pytest.approx(2e-3, rel=1e-9)


@pytest.mark.parametrize("width", [1e-6, 1e-5])
def test_a_steep_flank_conducts_too_well_to_matter(width):
    """K of the flank is 1e15 times that of the plateau, along which P is constant."""
    table = exact_table([0, 1.5e5, 2e5], [1e-10, 1e-14, 1e-30])
    profile = TabulatedProfile(np.array([0.0, width, 2e-3]), np.array([0.0, 3e5, 3e5]))
    flow = seal_flow(table, profile, STRIP, BAR)
    plateau = seal_flow(table, uniform(3e5, 2e-3 - width), StraightPath(2e-3 - width, 0.15), BAR)
    for name in ("value", "upper"):
        assert getattr(flow, name) == pytest.approx(getattr(plateau, name), rel=3 * SHOOTING)


def test_lifted_off():
    flow = seal_flow(constant(), uniform(1e5, 2e-3), STRIP, BAR)
    assert (flow.state, flow.value) == ("lifted off", np.inf)


def test_beyond_the_table_only_the_upper_bound_is_known():
    """Which is widened by 2 SHOOTING = 2e-9, of a root known to 1e-9."""
    flow = seal_flow(constant(top=5e5), uniform(7e5, 2e-3), STRIP, BAR)
    assert flow.lower == 0
    assert flow.upper == pytest.approx(SMOOTH * 75 * 1e5, rel=4e-9)


@pytest.mark.parametrize("P", [6e5, 0.1 + 3e5, 1e6 / 3])
def test_table_that_begins_at_the_lowest_net_load(P):
    """No net load is below P - p_in under a uniform pressure: nothing is open, for any rounding."""
    loads = P - 1e5 + np.linspace(0, 1, 11) * 1e5
    flow = seal_flow(
        exact_table(loads, SMOOTH * np.exp(-np.arange(11))),
        uniform(P, 2e-3),
        STRIP,
        BAR,
    )
    upper = SMOOTH * 75 * 1e4 * np.sum(np.exp(-np.arange(10)))
    assert flow.upper == pytest.approx(upper, rel=4e-9)
    assert flow.lower == pytest.approx(upper / np.e, rel=4e-9)


def test_below_the_first_load_the_film_may_be_open():
    """At net loads that the table does not know from below, K may be infinite."""
    table = exact_table([2e5, 3e5], [SMOOTH, 0.5 * SMOOTH])
    assert seal_flow(table, uniform(2.5e5, 2e-3), STRIP, BAR).upper == np.inf


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.floats(0, 8e5), min_size=2, max_size=6),
    st.lists(st.floats(0.05, 1.0), min_size=3, max_size=8),
    st.floats(0.1e5, 3e5),
)
def test_more_cells_stay_inside(pressures, falls, inlet):
    """For any profile and any falling K cells that are cut lie within the whole ones.

    All numbers of cells bound one leak rate, so that no lower bound lies above an upper one.
    """
    loads = np.linspace(0, 9e5, len(falls))
    table = exact_table(loads, SMOOTH * np.cumprod(falls))
    profile = TabulatedProfile(np.linspace(0, 2e-3, len(pressures)), [*pressures[:-1], 9e5])
    ends, room = EndPressures(inlet), 1 + 1e-7

    def bounds(x):
        P, lengths = profile(x), np.diff(STRIP.resistance(x))
        low, high = np.minimum(P[:-1], P[1:]), np.maximum(P[:-1], P[1:])
        lower = path_leak_rate(table.lowest, high, lengths, ends)
        return lower, path_leak_rate(table.highest, low, lengths, ends)

    whole = np.union1d(np.linspace(0, 2e-3, 17), profile.nodes)
    cut = np.union1d(np.linspace(0, 2e-3, 65), whole)
    (lowest, highest), (lower, upper) = bounds(whole), bounds(cut)
    assert lowest <= lower * room
    assert upper <= highest * room
    few, many = (seal_flow(table, profile, STRIP, ends, cells=n) for n in (16, 64))
    assert max(few.lower, many.lower, lower) <= min(few.upper, many.upper, upper) * room
    assert many.lower <= many.value <= many.upper


def test_bounds_that_scatter_are_widened_until_they_fall():
    table = ConductivityTable([0, 1, 2], [3, 1, 2], [4, 2, 3])
    assert table.lower.tolist() == [3, 1, 1]
    assert table.upper.tolist() == [4, 3, 3]


test_bad_input = refused_calls(
    (lambda: ConductivityTable([0, 1], [1], [1]), "as many lower and upper bounds as loads"),
    (lambda: ConductivityTable([1, 0], [1, 1], [1, 1]), "must ascend"),
    (lambda: ConductivityTable([0], [2], [1]), "cross at a load of 0 Pa"),
    (lambda: ConductivityTable([-1], [1], [1]), "loads from -1 to -1 Pa"),
    (lambda: ConductivityTable([0, 1, 2], [3] * 3, [3] * 3, (None,)), "needs 2 enclosures"),
    (lambda: TabulatedProfile([0, 1], [1]), "2 places and 1 pressures"),
    (lambda: TabulatedProfile([0, 0], [1, 1]), "ascend"),
    (lambda: TabulatedProfile([0, 1], [0, 0]), "not all 0"),
    (lambda: Hertz(0, 1), "maximum = 0 must be a positive number"),
    (lambda: EndPressures(1, 2), "must be above the outlet's"),
    (lambda: EndPressures(1, slip=-1), "slip = -1 must be"),
    (lambda: RingPath(1, 1), "radii of a ring must differ"),
    (
        lambda: seal_flow(constant(), uniform(1e6, 1e-3), STRIP, BAR),
        "0.001 m long and the leak path 0.002 m",
    ),
    *(
        (lambda P=P: seal_flow(exact_table([2e6], [0]), P, STRIP, BAR), "2e.06 Pa, seals, and")
        for P in (uniform(1e6, 2e-3), Hertz(1e6, 2e-3))
    ),
)


@pytest.mark.parametrize(
    "profile",
    [
        lambda P: uniform(P, 2e-3),
        lambda P: Hertz(P, 2e-3),
        lambda P: TabulatedProfile([0, 0.999e-3, 1e-3, 2e-3], [0, 0, P, 0]),
    ],
)
def test_a_load_that_seals_at_the_highest_pressure_alone(profile):
    """In one of fifty numbers rounding puts p_in + (P_max - p_in) above P_max."""
    for highest, part in np.random.default_rng(0).uniform(0.1, 0.9, (100, 2)).tolist():
        P, inlet = profile(1e6 * highest), 1e6 * highest * part
        table = exact_table([0.0, P.highest - inlet], [SMOOTH, 0.0])
        flow = seal_flow(table, P, STRIP, EndPressures(inlet, 0.0))
        assert flow.state == "sealed"
        assert P(flow.sealing.middle) == pytest.approx(P.highest, rel=1e-9)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Enclosure((3.0, 1.0), (2.0, 2.0)),
        lambda: Enclosure((1.0, 1.0), (2.0, 2.0, 2.0)),
        lambda: Enclosure((1.0,), (2.0,)),
        lambda: ConductivitySteps(np.array([1.0, 2.0]), np.array([np.inf, 1.0, 1.1])),
        lambda: ConductivitySteps(np.array([2.0, 1.0]), np.array([np.inf, 1.0, 0.0])),
        lambda: ConductivitySteps(np.array([1.0]), np.array([1.0])),
        lambda: PathFlow(*np.ones((4, 2)), np.ones((1, 1)), np.ones((1, 1))),
        lambda: PathFlow(np.arange(3.0), *np.ones((5, 2))),
    ],
)
def test_conductivities_that_cannot_be_are_refused(make):
    with pytest.raises(Inconsistent, match=r"enclosure with|rises with|out of order"):
        make()


def enclosed(loads, e_fold):
    """Table of an exponential K with enclosures from above: its cube root is convex."""
    K = SMOOTH * np.exp(-np.asarray(loads) / e_fold)
    between = tuple(Enclosure((b, b), (a, b)) for a, b in pairwise(K))
    return ConductivityTable(loads, K, K, between)


@pytest.mark.parametrize("law", [FIRST_ORDER, kinetic(LEAST_ACCOMMODATION), kinetic(1.0)])
def test_powers_of_a_slipping_conductivity(law):
    """Half-way between two gaps K^m is at least the mean of both, K^n at most.

    The chords of the kinetic law's table lie up to 1e-4 above the law.
    """
    t = np.geomspace(1e-7, 1e4, 2000)
    concave, convex = SLIPPING
    for wider in 1.1, 2.0, 100.0:
        low, middle, high = (gap**2 * law(gap) for gap in (t, 0.5 * (1 + wider) * t, wider * t))
        assert (middle**concave >= 0.5 * (low**concave + high**concave) * (1 - 1e-4)).all()
        assert (middle**convex <= 0.5 * (low**convex + high**convex) * (1 + 1e-4)).all()


@pytest.mark.parametrize("outlet", [1e5, 0.0])
def test_slip_along_the_path_is_an_integral(outlet):
    """One gap everywhere, in which K dΦ goes as exp(p/e) (p + B/g) dp; also against a vacuum."""
    e_fold, P, gap = 5e4, 3e5, 1e-7
    gas = GasDrive(2e5, outlet, 300.0, 0.004, 273.15, 1e5)
    slip = gas.slip(2e-5, 1.0)
    loads = np.linspace(P - (2e5 - outlet), P, 401)
    table = exact_table(loads, SMOOTH * np.exp(-loads / e_fold))
    ends = EndPressures.of(gas, (2e5 - outlet, 0.0)).slipping(slip, gap)
    added, per_square = slip.product / gap, gas.pressure_drop / (4e10 - outlet**2)
    at_mean = 1 + added / slip.mean_pressure
    assert at_mean > 2

    def passed(p):
        K = SMOOTH * np.exp(-(P + outlet - p) / e_fold) / at_mean
        return 2 * per_square * K * (p + added)

    exact = 75 * quad(passed, outlet, 2e5)[0]
    flow = seal_flow(table, uniform(P, 2e-3), STRIP, ends)
    # Each bound takes K at one of two loads up to 500 Pa apart: exp(500/5e4) = 1.01.
    encloses(flow, exact, 0.011)
    # ln K is linear between loads 250 or 500 Pa apart, in 16 steps: (500/16/e_fold)²/24 at most,
    # times 1 + 2 e_fold/(p + B/g) since p + B/g varies as well, and 1e-9 of the search.
    assert added > 20 * e_fold
    assert flow.value == pytest.approx(exact, rel=2e-8)


def test_a_table_with_enclosures_encloses():
    """∫ K dp of an exponential, with an upper bound by chords and a lower one by steps."""
    e_fold, P = 5e4, 3e5
    exact = SMOOTH * e_fold * np.exp(-P / e_fold) * np.expm1(2) * 75
    loads = np.linspace(2e5, 3e5, 6)
    plain = exact_table(loads, SMOOTH * np.exp(-loads / e_fold))
    flow, steps = (
        seal_flow(t, uniform(P, 2e-3), STRIP, BAR) for t in (enclosed(loads, e_fold), plain)
    )
    assert flow.lower == pytest.approx(steps.lower, rel=1e-6)
    assert flow.lower <= exact <= flow.upper < steps.upper
    # The chord of exp over 0.4 lies at most 0.4²/12 above it in the mean, and steps add 1 %.
    assert flow.upper / exact - 1 < 0.4**2 / 12 + 0.01
    # ln K falls by 0.4/16 in each step of the estimate, whose middle value is h²/24 below the mean.
    assert flow.value == pytest.approx(exact * (1 - (0.4 / 16) ** 2 / 24), rel=1e-7)


def test_the_search_for_a_leak_rate_ends():
    """Where the pressure at the inlet does not depend on Q, no leak rate gives the inlet's."""
    for excess in (3.0, -3.0, np.nan):
        with pytest.raises(NotConverged, match="differs by"):
            bracketed_root(lambda log_rate, excess=excess: excess, -30.0, -30.0)


def test_the_search_for_a_jump():
    """An excess with a jump at its root lets only halving help: 2^-44 of the bracket are needed."""

    def jump(log_rate):
        return -1.0 if log_rate < -30.123 else 1.0

    assert bracketed_root(jump, -50.0, -10.0) == pytest.approx(-30.123, abs=1e-9)
