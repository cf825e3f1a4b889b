"""The fluid's pressure on a dry contact: cautions, the other end of the load, and lift-off."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from lifted_scenes import scene as lifted_scene
from project import AIR

from fem_seal.contact.methods import GAP_TOLERANCE
from fem_seal.patch import Patch
from fem_seal.results import Result
from fem_seal.results.words import summary_of
from fem_seal.solved import solve

LOAD = 9e6  # Pa
DROP = 1e6  # Pa


def scene(limit=None, load=None, flow=None):
    """The dry contact of a plastic under water."""
    flow = {"rtol": 0.2, "lift": "none"} | (flow or {})
    made = lifted_scene(LOAD, DROP, contact=load, solid={"contact_modulus": 6e8}, **flow)
    return made.with_({"limit": {"leak_rate": f"{limit} m^3/s"}}) if limit else made


def entry(result, name="fluid pressure"):
    return next((entry for entry in result.error_budget if entry.name == name), None)


def leak_at(load, flow=None):
    """Bounds of the dry contact under a load."""
    return Patch(scene(load={"pressure": load}, flow=flow)).leak_rate


@pytest.mark.parametrize(("drop", "warned"), [(1.01e-3 * LOAD, True), (0.99e-3 * LOAD, False)])
def test_caution_from_a_thousandth_of_the_load(drop, warned):
    result = solve(scene(flow={"pressure_drop": drop})).result()
    said = [text for label, text in summary_of(result) if label == "caution"]
    assert any("0.001 times the load" in text for text in said) is warned
    assert (entry(result) is not None) is warned
    # Without a limit nothing more is computed, and the leak rate is open upwards.
    assert "fluid pressure" not in result.seconds
    if warned:
        assert (entry(result).lower, entry(result).upper) == (1.0, None)


def test_verdict_against_the_other_end_of_the_load():
    """The dry contacts under P and P - (p_in - ambient): a limit between their leak rates is open.

    Where the limit is above both the verdict stands, and so it does where it is below the first.
    """
    dry, other_end = leak_at(LOAD), Patch(scene(load={"pressure": LOAD - DROP}))
    opened = other_end.leak_rate
    assert opened.lower > 1.5 * dry.upper  # or the cases below would not be three
    within = solve(scene(limit=1.05 * opened.upper)).result()
    assert within.verdict.decision == "within limit"
    assert "counting fluid pressure 1 to" in within.verdict.sentence
    between = solve(scene(limit=1.1 * dry.upper)).result()
    assert between.verdict.decision == "undecided"
    above = solve(scene(limit=0.9 * dry.lower)).result()
    assert above.verdict.decision == "above limit"
    # The second contact is solved only where it may decide.
    for result, computed in ((within, True), (between, True), (above, False)):
        assert ("fluid pressure" in result.seconds) is computed
    # Upper factor times upper bound is the upper bound of the opened contact. Its two runs differ
    # by their starts, and the gap of the constriction by twice the tolerance; Q is its cube.
    off = 2 * GAP_TOLERANCE * other_end.surface.values.std() / other_end.film.constriction.gap
    assert entry(within).upper * within.leak_rate.upper == pytest.approx(opened.upper, rel=3 * off)


@pytest.mark.parametrize("load", [0.5 * DROP, DROP])
def test_lift_off(load):
    """P ≤ p_in - ambient: more may leak than any number here says; "above limit" stands."""
    dry = leak_at(load)
    result = solve(scene(limit=100 * dry.upper, load={"pressure": load})).result()
    assert result.verdict.decision == "undecided"
    assert "lift off" in result.verdict.sentence
    assert any("lift off" in caution for caution in result.cautions)
    above = solve(scene(limit=0.5 * dry.lower, load={"pressure": load})).result()
    assert above.verdict.decision == "above limit"


@pytest.mark.parametrize(
    ("load", "outlet", "sentence", "line"),
    [
        (3e8, 0, "no less than the load, so that the seal may lift off", "limit if the seal lifts"),
        (LOAD, LOAD, "outlet's pressure is no less than the load: the seal lifts off", "limit, "),
    ],
)
def test_a_range_without_a_lower_end(load, outlet, sentence, line):
    """Sealed, or lifted off, by the outlet's pressure alone: neither 0 nor infinity is a bound."""
    flow = {"inlet_pressure": outlet + load, "outlet_pressure": outlet, "ambient_pressure": 0}
    result = solve(scene(load={"pressure": load}, flow=flow | {"lift": "range"})).result()
    assert entry(result, "lift").sentence.endswith(sentence)
    assert dict(summary_of(result))["lift"].startswith(f"without {line}")


def test_a_second_contact_that_does_not_converge():
    """Enough iterations for full contact, too few for the opened one: open, and said so."""
    load, flow = {"pressure": 1e8}, {"pressure_drop": 9.9e7}
    assert solve(scene(1.0, load, flow)).result().verdict.decision == "within limit"
    needed = Patch(scene(load=load)).contact.iterations
    result = solve(scene(1.0, {**load, "max_iterations": needed}, flow)).result()
    assert result.verdict.decision == "undecided"
    assert "did not converge" in result.verdict.sentence


def test_a_sealed_contact_that_the_fluid_opens():
    """Sealed when dry, leaking at the other end of the load: what leaks there is judged."""
    load, drop = {"pressure": 6e7}, {"pressure_drop": 5.1e7}
    opened = leak_at(LOAD, flow=drop)  # 6e7 - 5.1e7
    free = solve(scene(load=load, flow=drop)).result()
    assert free.verdict.decision == "sealed"
    assert free.cautions
    within = solve(scene(1.05 * opened.upper, load, drop)).result()
    assert within.verdict.decision == "within limit"
    open_ = solve(scene(0.9 * opened.lower, load, drop)).result()
    assert open_.verdict.decision == "undecided"
    # And one that stays sealed at that end.
    slight = solve(scene(opened.lower, load, {"pressure_drop": 1e6})).result()
    assert slight.verdict.decision == "within limit"
    assert (entry(slight).lower, entry(slight).upper) == (1.0, 1.0)
    # Its caution does not speak of more leaks where nothing leaks.
    assert entry(slight).sentence.endswith("the contact is sealed all the same")
    assert "more leaks" not in entry(slight).sentence
    assert "more leaks" in entry(within).sentence
    # No patch speaks for the seal.
    for result in (free, slight):
        words = "of this patch (others of the seal may leak: [seal] judges"
        assert words in result.verdict.sentence
        assert "[seal] judges the seal" in dict(summary_of(result))["leak rate"]


def test_an_outlet_below_ambient_closes_the_film():
    """From 1 bar to vacuum against 10 bar on the back: the load is P + 9 to 10 bar in truth."""
    flow = {"inlet_pressure": 1e5, "outlet_pressure": 0, "ambient_pressure": 1e6}
    dry, closed = leak_at(LOAD, flow), leak_at(LOAD + 1e6, flow)
    assert closed.upper < dry.lower / 1.5
    assert solve(scene(1.01 * dry.upper, flow=flow)).result().verdict.decision == "within limit"
    assert solve(scene(0.99 * dry.lower, flow=flow)).result().verdict.decision == "undecided"
    assert solve(scene(0.9 * closed.lower, flow=flow)).result().verdict.decision == "above limit"


@pytest.mark.parametrize("load", [{"area_fraction": 0.1}, {"mean_gap": 2e-7}])
def test_loads_other_than_a_pressure_are_named_only(load):
    """They are kept whatever the fluid carries: no number, a caution with the ratio."""
    result = solve(scene(limit=1.0, load=load)).result()
    assert (entry(result).lower, entry(result).upper) == (None, None)
    assert entry(result).sentence in result.cautions
    assert result.verdict.decision == "within limit"
    assert "fluid pressure" in result.verdict.sentence


VACUUM = {"inlet_pressure": "1 bar", "outlet_pressure": 0}
BEARING = {"model": "bearing", "area_fraction": 0.1}


def test_gauge_pressures_of_a_vacuum():
    assert scene(flow={**VACUUM, "ambient_pressure": "1 bar"}).flow.gauge_pressures == (0.0, -1e5)
    assert scene(flow={**VACUUM, "ambient_pressure": 0}).flow.gauge_pressures == (1e5, 0.0)
    # Left out, it is the outlet's.
    flow = scene(flow={"inlet_pressure": 3e5, "outlet_pressure": 1e5}).flow
    assert flow.gauge_pressures == (2e5, 0.0)
    # Without an elastic contact it changes nothing, and need not be named.
    assert scene(load=BEARING, flow=VACUUM).flow.ambient_pressure is None


def of_a_table():
    """A seal, in the present folder."""
    Path("profile.csv").write_text("0 1e5\n1e-3 2e5\n")
    left_out = dict.fromkeys(("contact.pressure", "flow.rtol", "flow.lift", "accuracy"))
    seal = {"circumference": "1 m", "pressure_profile": "profile.csv"}
    return scene().with_(left_out | {"seal": seal, "output.products": ["seal"]})


@pytest.mark.parametrize(
    ("made", "older_flow", "older_contact"),
    [
        # An outlet in a vacuum was taken for the ambient.
        (lambda: scene(flow={**VACUUM, "ambient_pressure": 0}), {"ambient_pressure": None}, {}),
        # A bearing contact took settings of an iteration, and an ambient pressure, without a word.
        (
            lambda: scene(load=BEARING, flow=VACUUM),
            {"ambient_pressure": 1e5},
            {"tolerance": 1e-20, "threads": 2},
        ),
        # A seal took flow.rtol, and contact.pressure beside a table.
        (of_a_table, {"rtol": 0.1}, {"pressure": 1e5}),
    ],
    ids=["without a field", "with fields that were ignored", "seal"],
)
def test_an_older_scene_is_rebuilt(made, older_flow, older_contact, here):
    given = made()
    older = given.to_mapping()
    flow = older.get("flow", {}) | older_flow
    older["flow"] = {name: value for name, value in flow.items() if value is not None}
    older["contact"] = older.get("contact", {}) | older_contact
    result = SimpleNamespace(provenance=SimpleNamespace(scene=older))
    assert Result.scene(result) == given


def test_slip_in_a_sealed_film_that_more_pressure_would_open():
    """The entry "slip" is that of the opened film, through which more leaks by the kinetic law."""
    ends = {"inlet_pressure": 2e5, "outlet_pressure": 1e5}
    first, kinetic = (
        solve(lifted_scene(2.8e5, n=16, seed=3, fluid=AIR | {"slip": law}, **ends))
        for law in ("first-order", "kinetic")
    )
    assert first.state == kinetic.state == "sealed"
    assert 0 < first.patch.lifted.highest < kinetic.patch.lifted.highest
    assert first.headline.upper is None
    slip = next(entry for entry in kinetic.budget if entry.key == "slip")
    assert kinetic.headline.upper == slip.upper * kinetic.patch.lifted.highest
    assert slip.upper > 1
