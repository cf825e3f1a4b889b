"""[tolerances], what the scene says of its inputs: the entry "inputs" of the error budget.

The leak rate is solved again at the two corners of the box; derivatives: test_sensitivity.py.
"""

from dataclasses import replace
from functools import cached_property, partial
from math import inf, log

import numpy as np
import pytest
from project import FIRST

from fem_seal.error_budget import INPUTS
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Given, Patch
from fem_seal.quantities.inputs import OPENS, TINY, Probe, corner, input_shares
from fem_seal.scene import Scene
from fem_seal.solved import solve
from fem_seal.upscaling import seal_flow

SMALL = [
    "surface.shape=[32, 32]",
    "surface.short_wavelength=12.5 um",
    "output.products=['leak_rate']",
    "accuracy.contact_grid=false",
]
COARSE = ["surface.shape=[16, 16]", "surface.short_wavelength=25 um"]
COARSE += ["surface.long_wavelength=50 um"]
DRY, LIFTED = "flow.lift=none", "flow.lift=resolved"
AIR = ["fluid.kind=gas", "fluid.molar_mass=29 g/mol", "fluid.viscosity=18 uPa s"]
AIR += ["fluid.temperature=20 degC", "flow.pressure_drop="]
KNOWN = [
    "tolerances.contact.pressure=10 %",
    "tolerances.solid.contact_modulus=2 MPa",
    "tolerances.heights=5 %",
    "tolerances.fluid.viscosity=3 %",
]


def scene(*settings: str) -> Scene:
    return Scene.from_file(FIRST, [*SMALL, *settings])


def entry(solved):
    return next(entry for entry in solved.budget if entry.key == INPUTS)


def test_a_closing_corner_that_leaks_next_to_nothing():
    """It may be sealed: the lower end is 0."""
    solved = solve(scene(LIFTED, "contact.pressure=0.2 MPa", "flow.rtol=0.5", *KNOWN))
    far, surface = entry(solved), solved.patch.surface
    assert far.lower == 0
    closed = corner(solved.patch.scene, -1, Probe())
    surface = replace(surface, values=0.95 * surface.values)
    # Under the load without the fluid less leaks than with it, and that is sealed.
    assert Patch(closed, given=Given(surface=surface, lift="none")).sealed
    assert solved.headline.lower is None
    assert far.upper > 1


def test_corners_by_hand():
    """The headline has the bounds of two scenes with the ends written out by hand, and no more.

    No other entry is counted here, and the bounds of the flow count once.
    """
    settings = [DRY, "flow.rtol=0.1"]
    known = [*KNOWN, "tolerances.flow.pressure_drop=0.5 Pa"]
    pressed = ["contact.pressure=0.1 MPa", "flow.pressure_drop=10 Pa"]
    solved = solve(scene(*settings, *pressed, *known))
    closed = ("0.11 MPa", "8 MPa", 0.95, "1.03 mPa s", "9.5 Pa")
    opened = ("0.09 MPa", "12 MPa", 1.05, "0.97 mPa s", "10.5 Pa")
    ends = []
    for pressure, modulus, factor, viscosity, drop in (closed, opened):
        slope = factor * solved.patch.scene.surface.rms_slope
        by_hand = scene(
            *settings,
            f"contact.pressure={pressure}",
            f"solid.contact_modulus={modulus}",
            f"surface.rms_slope={slope!r}",
            f"fluid.viscosity={viscosity}",
            f"flow.pressure_drop={drop}",
        )
        ends.append(Patch(by_hand).leak_rate)
    assert entry(solved).kind == "estimated"
    assert entry(solved).largest[:2] == ("solid.contact_modulus", 0.2)
    assert ends[0].lower > 0
    # The contacts start elsewhere, and agree to their certificate, 1e-6, of which Q makes 1e-5.
    assert solved.headline.lower == pytest.approx(ends[0].lower, rel=1e-5)
    assert solved.headline.upper == pytest.approx(ends[1].upper, rel=1e-5)


@pytest.mark.parametrize("name", sorted(OPENS.keys() - {"seal.line_load"}))
def test_each_input_opens_the_film_in_its_direction(name):
    """One input at a time: a tenth more of it opens the film or closes it, as the table says."""
    pressures = ["flow.pressure_drop=", "flow.inlet_pressure=2 bar", "flow.outlet_pressure=1 bar"]
    given = pressures * name.endswith(("inlet_pressure", "outlet_pressure"))
    if name == "solid.youngs_modulus":
        given = ["solid.contact_modulus=", "solid.youngs_modulus=8 MPa", "solid.poisson_ratio=0.5"]
    nominal = scene(*COARSE, DRY, "flow.method=finite-difference", *given)
    less, more = (Patch(nominal.scaled({name: part})).leak_rate.value for part in (0.9, 1.1))
    assert np.sign(more - less) == OPENS[name]


@pytest.mark.parametrize(
    "settings",
    [
        ["contact.pressure=0.06 MPa", "tolerances.contact.pressure=0.04 MPa"],
        [
            *("flow.pressure_drop=", "flow.inlet_pressure=1.5 bar", "flow.outlet_pressure=1 bar"),
            "tolerances.flow.inlet_pressure=20 %",
        ],
    ],
)
def test_a_tolerance_is_not_taken_twice(settings):
    """It is about the value of the scene, not about those at its ends."""
    solved = solve(scene(*COARSE, DRY, *settings))
    assert 0 < entry(solved).lower < 1 < entry(solved).upper


BOX = (0.12e6, 3e4, 1, LIFTED)
MORE = [(0.15e6, 3e4, 3, DRY), (0.13e6, 5e4, 2, LIFTED), (0.1e6, 8e4, 5, LIFTED)]
MORE += [(0.12e6, 3e4, 1, DRY)]


@pytest.mark.parametrize(
    ("box", "draws"),
    [
        (BOX, 2),  # dry: the corners by hand, above
        *(pytest.param(box, 50, marks=pytest.mark.slow) for box in (BOX, *MORE)),
    ],
)
def test_random_inputs_lie_inside(box, draws):
    """Leak rates of inputs drawn from the box lie between the ends, dry and lifted.

    None of the closed corners is sealed: they have leak rates of their own.
    """
    pressure, drop, seed, lift = box
    settings = [f"surface.seed={seed}", lift]
    given = [f"contact.pressure={pressure}", f"flow.pressure_drop={drop}"]
    solved = solve(scene(*settings, *given, *KNOWN, "tolerances.flow.pressure_drop=5 %"))
    tolerated = solved.patch.scene.tolerated
    low = entry(solved).lower * solved.leak_rate.lower
    high = entry(solved).upper * solved.leak_rate.upper
    assert low > 0
    draw = np.random.default_rng(1)
    for _ in range(draws):
        factors = {name: 1 + part * draw.uniform(-1, 1) for name, part in tolerated.items()}
        leak = Patch(scene(*settings, *given).scaled(factors)).leak_rate
        assert low <= leak.lower, factors
        assert leak.upper <= high, factors


def test_corners_whose_lift_errs_more():
    """The headline ends where those of the scenes at its corners do, with the errors of their lift.

    The contacts start elsewhere, and agree to their certificate, 1e-6, of which Q makes 1e-5.
    """
    settings = [LIFTED, "flow.rtol=0.5", "surface.seed=2"]
    known = "tolerances.contact.pressure=10 %"
    solved = solve(scene(*settings, "contact.pressure=0.16 MPa", known))
    ends = [solve(scene(*settings, f"contact.pressure={P} MPa")) for P in (0.176, 0.144)]
    assert all(end.patch.lifted.error > 2 * solved.patch.lifted.error for end in ends)
    assert solved.headline.lower == pytest.approx(ends[0].headline.lower, rel=1e-5)
    assert solved.headline.upper == pytest.approx(ends[1].headline.upper, rel=1e-5)


@pytest.mark.parametrize("gap", [20e-9, 70e-9, 1e-6])
def test_viscosity_of_a_gas_that_slips(gap, scene_of_gap):
    """A uniform gap below, at and above Knudsen's minimum, between 1 bar and a vacuum.

    Slip grows with the viscosity: below the minimum more leaks the more viscous the gas is, and at
    the minimum least leaks within the tolerance.
    """
    air = {"kind": "gas", "slip": "kinetic", "molar_mass": "29 g/mol", "temperature": "20 degC"}
    ends = {"inlet_pressure": 1e5, "outlet_pressure": 0.0, "rtol": 0.01}

    def channel(viscosity, **more):
        fluid = air | {"viscosity": viscosity}
        values = np.full((4, 4), gap)
        return Scene.from_mapping(scene_of_gap(values, fluid=fluid, flow=ends, **more))

    solved = solve(channel(1.8e-5, tolerances={"fluid": {"viscosity": "30 %"}}))
    for factor in (0.7, 0.9, 1.1, 1.3):
        leak = Patch(channel(factor * 1.8e-5)).leak_rate
        assert solved.headline.lower <= leak.value <= solved.headline.upper


@pytest.mark.parametrize("lift", [DRY, LIFTED])
def test_viscosity_alone_needs_no_second_solve(lift, monkeypatch):
    """Contact, lift and pressures do not depend on it, and Q goes as 1/η."""
    monkeypatch.delattr("fem_seal.quantities.inputs._at_corner")
    solved = solve(scene(lift, "tolerances.fluid.viscosity=4 %"))
    assert entry(solved).lower == pytest.approx(1 / 1.04, rel=1e-12)
    assert entry(solved).upper == pytest.approx(1 / 0.96, rel=1e-12)
    assert entry(solved).largest == ("fluid.viscosity", 0.04, 1.0)


def test_sealed_by_a_load_that_may_be_less():
    """A sealed state gets the leak rate of its open corner, to the certificates of two contacts."""
    settings = [DRY, "contact.pressure=0.4 MPa", "tolerances.contact.pressure=60 %"]
    solved = solve(scene(*settings))
    opened = Patch(scene(DRY, "contact.pressure=0.16 MPa")).leak_rate
    assert solved.state == "sealed"
    assert entry(solved).upper is None
    assert entry(solved).upper_rate == pytest.approx(opened.upper, rel=1e-5)
    surely = solve(scene(DRY, "contact.pressure=0.8 MPa", "tolerances.contact.pressure=5 %"))
    assert (entry(surely).lower, entry(surely).upper) == (1.0, 1.0)


@pytest.mark.parametrize("slip", ["false", "first-order", "kinetic"])
def test_a_sealed_state_of_a_gas_that_slips(slip):
    """The open corner errs by its own slip: the upper end is that of its scene, None if open."""
    drop = ["flow.inlet_pressure=1.001 bar", "flow.outlet_pressure=1 bar", DRY]
    gas = [*AIR, *drop, *COARSE, f"fluid.slip={slip}"]
    solved = solve(scene(*gas, "contact.pressure=0.3 MPa", "tolerances.contact.pressure=25 %"))
    opened = solve(scene(*gas, "contact.pressure=0.225 MPa")).headline.upper
    assert solved.state == "sealed"
    assert (opened is None) == (solved.headline.upper is None) == (slip != "kinetic")
    assert opened is None or solved.headline.upper == pytest.approx(opened, rel=1e-5)


def test_the_tolerance_that_decides():
    """An undecided verdict names the tolerance that decides, and that one does decide."""
    # So small a pressure drop that the fluid's pressure on the solid makes no difference.
    drop = "flow.pressure_drop=10 Pa"
    limit = f"{1.5 * Patch(scene(DRY, drop)).leak_rate.value!r} m^3/s"
    settings = [DRY, drop, f"limit.leak_rate={limit}"]
    wide = solve(scene(*settings, "tolerances.contact.pressure=20 %")).verdict
    assert wide.decision == "undecided"
    assert "contact.pressure to ±" in wide.sentence
    needed = wide.sentence.split("contact.pressure to ±")[1].split(" %")[0]
    # ln Q is not linear in the load: half of that tolerance leaves room for it.
    narrow = f"tolerances.contact.pressure={0.5 * float(needed)} %"
    assert solve(scene(*settings, narrow)).verdict.decision == "within limit"


def test_shares_next_to_lift_off():
    """The fluid carries all but nothing: two of the three loads that the solid bears are the same.

    What the drop changes is then the whole change between its ends.
    """
    about = scene(LIFTED, "tolerances.flow.pressure_drop=5 %")
    closed, leak, opened = (
        LeakRate(rate, state="leaking", method="") for rate in (1e-9, 2e-9, 8e-9)
    )
    shares = input_shares(about, leak, closed, opened, 1 - TINY, Probe())
    assert shares["flow.pressure_drop"] == pytest.approx(log(8), rel=1e-12)


def test_shares_where_one_corner_alone_leaks():
    """The solid bears half of the load; the leak rate is taken as one over its part."""
    about, sealed = scene(LIFTED, "tolerances.flow.pressure_drop=5 %"), LeakRate.sealed("")
    opened = LeakRate(1e-9, state="leaking", method="")
    shares = input_shares(about, sealed, sealed, opened, 0.5, Probe())
    change = 1.05 / 0.95 * (1 - 0.5 * 0.95) / (1 - 0.5 * 1.05)
    assert shares["flow.pressure_drop"] == pytest.approx(log(change), rel=1e-12)


def test_without_tolerances_the_inputs_are_named():
    named = entry(solve(scene(DRY)))
    assert (named.kind, named.lower, named.upper) == ("not covered", None, None)


def test_every_input_has_a_direction():
    fields = Scene.model_fields["tolerances"].annotation.__args__[0].model_fields
    names = {
        f"{section}.{key}"
        for section, field in fields.items()
        if section != "heights"
        for key in field.annotation.model_fields
    }
    assert names | {"heights"} == set(OPENS)


def test_a_stiffer_solid_may_leak_less():
    """Where the fluid may carry the whole load; the ends of the box are then not the extremes."""
    soft = ["contact.pressure=0.09 MPa", LIFTED]
    soft += ["solid.contact_modulus=1 MPa", "tolerances.solid.contact_modulus=20 %"]
    solved = solve(scene(*COARSE, *soft))
    assert not solved.patch.lifted.floats
    assert solved.patch.sensitivity.by_input["solid.contact_modulus"] < 0
    assert entry(solved).kind == "not covered"


@pytest.mark.parametrize(
    ("tolerance", "decision"),
    [
        ("contact.pressure=5 %", "above limit"),
        ("contact.pressure=20 %", "undecided"),
        ("fluid.viscosity=5 %", "above limit"),
    ],
)
def test_a_film_that_is_lifted_off_may_not_be_under_more_load(tolerance, decision):
    """The fluid in a uniform film carries half of its drop: 0.05 MPa, 6 % more than 0.047 MPa."""
    settings = [*COARSE, LIFTED, "contact.pressure=0.047 MPa", "limit.leak_rate=1 l/h"]
    solved = solve(scene(*settings, f"tolerances.{tolerance}"))
    assert solved.state == "lifted off"
    assert solved.verdict.decision == decision
    assert entry(solved).lower == (1.0 if decision == "above limit" else 0.0)


def test_an_opening_corner_that_is_lifted_off():
    """At 0.7 of the load, with the entry of the contact's grid: no grid limits that leak rate."""
    settings = [*COARSE, LIFTED, "contact.pressure=0.06 MPa", "accuracy.contact_grid=true"]
    solved = solve(scene(*settings, "tolerances.contact.pressure=30 %"))
    assert solved.state == "leaking"
    assert entry(solved).upper is None
    assert solved.headline.upper is None


def test_a_load_that_may_not_exceed_the_pressure_of_the_fluid():
    """The dry contact keeps the limit under the load less 0.14 MPa, not under nine tenths of it."""
    settings = [DRY, "flow.pressure_drop=0.14 MPa"]
    settings += ["contact.pressure=0.15 MPa", "limit.leak_rate=1e-9 m^3/s"]
    known = solve(scene(*settings))
    assert known.verdict.decision == "within limit"
    about = solve(scene(*settings, "tolerances.contact.pressure=10 %"))
    assert about.verdict.decision == "undecided"
    assert "the fluid's pressure, up to" in about.verdict.comparison


def test_the_back_of_the_solid_keeps_its_pressure():
    """An outlet below 1 bar at a corner does not change the ambient pressure."""
    pressures = ["flow.inlet_pressure=1.2 bar", "flow.outlet_pressure=1 bar"]
    nominal = scene(*AIR, *pressures)
    lower = nominal.scaled({"flow.outlet_pressure": 0.98})
    assert lower.flow.gauge_pressures == pytest.approx((2e4, -2e3))


@pytest.mark.parametrize("most", [1e-9, inf])
def test_a_corner_that_has_not_settled_counts_with_its_range(monkeypatch, most):
    """A corner that is sealed, but may leak a rate, is no proof that nothing leaks."""
    whole = Patch.lifted.func

    def unsettled(patch):
        state = whole(patch)
        if patch.scene.tolerances is None:
            return replace(state, reason="no", lowest=0.0, highest=most)
        return state

    stand_in = cached_property(unsettled)
    stand_in.__set_name__(Patch, "lifted")
    monkeypatch.setattr(Patch, "lifted", stand_in)
    pressed = ["contact.pressure=0.1 MPa", "tolerances.contact.pressure=1 %"]
    solved = solve(scene(*COARSE, *pressed))
    assert entry(solved).lower == 0
    upper = None if most == inf else pytest.approx(most / solved.leak_rate.upper)
    assert entry(solved).upper == upper


def under_cylinder(line_load, radius, **more):
    """The seal of a cylinder on a plane."""
    seal = {"circumference": "1 m", "pressure_profile": "hertz", "line_load": line_load}
    left_out = dict.fromkeys(("contact.pressure", "flow.lift", "flow.rtol", "accuracy"))
    sealing = {"seal": seal | {"cylinder_radius": radius}, "output.products": ["seal"]}
    return scene(DRY).with_(left_out | sealing | more)


def test_shares_under_a_cylinder():
    """The contact pressure is as √(w E*), and the leak path as √(w/E*): K = s³/(η x⁵) by hand."""
    # Tolerances, and the sign with which more of an input opens the film.
    opens = {
        "seal.line_load": ("w", -0.1),
        "solid.contact_modulus": ("E", 0.2),
        "heights": ("s", 0.05),
        "fluid.viscosity": ("η", -0.03),
    }
    known = {f"tolerances.{name}": f"{100 * abs(part)} %" for name, (_, part) in opens.items()}

    def at(end, *names):
        """ln Q with these inputs at the ends that open (1) or close (-1) the film."""
        return log_rate(**{letter: 1 + end * part for letter, part in map(opens.get, names)})

    def log_rate(w=1.0, E=1.0, s=1.0, η=1.0):
        return 3 * log(s) - 5 * log((w * E) ** 0.5 / (E * s)) - log((w / E) ** 0.5) - log(η)

    logs = 0.0, at(-1, *opens), at(1, *opens)
    rates = (LeakRate(np.exp(rate), state="leaking", method="adaptive") for rate in logs)
    shares = input_shares(under_cylinder("100 N/m", "5 mm", **known), *rates, 0.0, Probe())
    for name in opens:
        assert shares[name] == pytest.approx(at(1, name) - at(-1, name), rel=1e-12)


def test_a_stiffer_cylinder_under_fluid_of_nearly_its_pressure(monkeypatch):
    """With p_in near Hertz's maximum √(w E*/(π R)) a stiffer cylinder leaks less.

    (P - p)/E* grows with E* where p > P/2. A tenth of E* more or less shows beyond the bounds, also
    with a tenth of the cells of the path.
    """
    monkeypatch.setattr("fem_seal.quantities.inputs.COMPARED_CELLS", 50)
    for module in ("refined_table", "seal"):
        monkeypatch.setattr(f"fem_seal.upscaling.{module}.seal_flow", partial(seal_flow, cells=100))
    w, R, E = 200.0, 2e-3, 1e7
    drop = {"flow.pressure_drop": 0.85 * np.sqrt(w * E / (np.pi * R))}
    coarse = {"surface.shape": [16, 16], "solid.contact_modulus": E, "seal.rtol": 0.5}
    pressed = under_cylinder(w, R, **drop | coarse)
    solved = solve(pressed.with_({"tolerances": {"solid": {"contact_modulus": "10 %"}}}))
    leak, ends = solved.leak_rate, entry(solved)
    softer, stiffer = (
        solve(pressed.with_({"solid": {"contact_modulus": part * E}})).leak_rate
        for part in (0.9, 1.1)
    )
    assert stiffer.upper < leak.lower < leak.upper < softer.lower
    assert ends.lower * leak.lower <= stiffer.upper
    assert softer.lower <= ends.upper * leak.upper


@pytest.mark.parametrize(
    ("tolerance", "decision"),
    [
        ("seal.line_load=20 %", "undecided"),
        ("solid.contact_modulus=20 %", "undecided"),
        ("solid.contact_modulus=5 %", "above limit"),
        ("fluid.viscosity=20 %", "above limit"),
        ("heights=20 %", "above limit"),
    ],
)
def test_a_seal_that_is_lifted_off_may_not_be_at_the_other_end(tolerance, decision):
    """Hertz's maximum √(w E*/(π R)) is 5 % below p_in: 1.2 times w or E* is above, 1.05 below."""
    w, R, E = 200.0, 2e-3, 1e7
    name, _, text = tolerance.partition("=")
    known = {f"tolerances.{name}": text, "solid.contact_modulus": E}
    drop = {"flow.pressure_drop": 1.05 * np.sqrt(w * E / (np.pi * R))}
    solved = solve(under_cylinder(w, R, **drop, **known, **{"limit.leak_rate": "1 ml/h"}))
    assert solved.state == "lifted off"
    assert solved.verdict.decision == decision
    assert (entry(solved).lower, entry(solved).upper) == (float(decision == "above limit"), 1.0)


def test_shares_of_solids_that_only_touch():
    """Without a load the gap is as the heights, and the leak rate as their cube."""
    touching = scene(DRY, "contact.pressure=0", "tolerances.heights=5 %", KNOWN[3])
    values = 1.0, 0.95**3 / 1.03, 1.05**3 / 0.97
    rates = (LeakRate(value, state="leaking", method="adaptive") for value in values)
    shares = input_shares(touching, *rates, 0.0, Probe())
    assert shares["heights"] == pytest.approx(3 * log(1.05 / 0.95), rel=1e-12)
