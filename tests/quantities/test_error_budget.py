"""The error budget: one list, counted by the verdict."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from project import AIR, RING, scene_of_samples

from fem_seal.accuracy import Choice, Trial
from fem_seal.error_budget import Uncertainty, combined, estimate, factor_words, flow_entry
from fem_seal.errors import Inconsistent
from fem_seal.leak_rate import Bounded, Factors, LeakRate, LevelRecord
from fem_seal.patch import Patch
from fem_seal.quantities.advice import what_would_decide
from fem_seal.quantities.headline import Headline
from fem_seal.quantities.uncertainties import error_budget
from fem_seal.quantities.verdict import verdict
from fem_seal.results.words import budget_words
from fem_seal.scene import Scene
from fem_seal.slip_error import slip_entry_at
from fem_seal.solved import solve

rate = partial(LeakRate, state="leaking", method="adaptive")
LEAK = rate(2e-10, 1e-10, 4e-10, unknowns=1000)
FLOW = flow_entry(LEAK)
GRID = Uncertainty("contact_grid", "estimated", "a finer grid", 0.8, 1.25)
SLIP = Uncertainty("slip", "not covered", "the gas slips", 1.0, None, caution=True)
MODEL = Uncertainty("model", "not covered", "Reynolds")
SUCTION = Uncertainty("fluid_pressure", "not covered", "it closes", None, 1.0)
OPENS = Uncertainty("fluid_pressure", "estimated", "it opens", 1.0, None, upper_rate=2e-10)
SEALED = LeakRate.sealed("adaptive")
COARSE = Trial((8, 8), 2.0, 1.0, 3.0)


def judged(limit, *entries, leak=LEAK, total=None, decide=False):
    scene = rough(total, limit, max_unknowns=10**6).with_({"limit.decide": decide})
    return verdict(scene, leak, (flow_entry(leak), *entries))


def test_errors_of_any_dependence_multiply():
    """All may be at their ends together, of one cause: no narrower factors enclose them."""
    rng = np.random.default_rng(1)
    lowers, uppers = 1 - rng.random(4), 1 + rng.random(4)
    entries = [Uncertainty("", "estimated", "", a, b) for a, b in zip(lowers, uppers, strict=True)]
    found = combined(entries)
    assert (found.lower, found.upper) == pytest.approx((lowers.prod(), uppers.prod()), rel=1e-14)


@pytest.mark.parametrize("straight", [False, True])
def test_the_mesh_of_a_shape_is_not_covered(straight):
    """The bounds of a strip hold its exact leak rate; those of a ring are those of its polygon."""
    strip = {"kind": "strip", "length": "5 mm", "width": "5 mm", "mesh_size": "2 mm", "gap": "3 um"}
    solved = solve(Scene.from_mapping(RING | {"shape": strip} if straight else RING))
    if straight:
        exact = 3e-6**3 / 12e-3 * 1e5
        lower, upper = solved.leak_rate.bounds
        assert (1 - 1e-12) * lower <= exact <= (1 + 1e-12) * upper
    assert ("mesh of the shape" in budget_words(solved.budget)) == (not straight)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rate(2.0, 3.0, 1.0), "bounds cross"),
        (lambda: rate(2.0, -0.5, 3.0), "at least -5"),
        (lambda: rate(2.0, None, 3.0), "one bound without the other"),
        (lambda: rate(np.nan), "nan is not between"),
        (lambda: rate(9.0, 1.0, 2.0), "is not between"),
        (lambda: LevelRecord(9, 8, 3.0, 1.0), "bounds cross"),
        (lambda: Bounded(2.0, 3.0, 1.0), "bounds cross"),
        (lambda: Bounded(-2.0, -1.0, 1.0), "-2.0.* is not between"),
        (lambda: Trial((8, 8), 9.0, 1.0, 2.0), "is not between"),
        (lambda: Choice(0.1, (8, 8), 0.1, None, None, (COARSE, COARSE)), "8. samples chosen of"),
        (lambda: Choice(0.1, (4, 4), 0.1, None, None, (COARSE,)), "4. samples chosen of"),
        (lambda: Choice(0.1, (8, 8), 0.1, -0.1, None, (COARSE,)), "with errors .-0.1"),
        (lambda: Uncertainty("flow", "guaranteed", ""), "flow is guaranteed without factors"),
        (lambda: Headline(1.0, 2.0, 1.0, ""), "bounds cross"),
        (lambda: estimate("grid", "", 2.0, 3.0), "factors of an estimated error: 2.0 and 3.0"),
        (lambda: estimate("grid", "", 0.5, 0.9), "factors of an estimated error: 0.5 and 0.9"),
        *(
            (lambda a=a, b=b: Uncertainty("grid", "estimated", "", a, b), f"grid: factors .* {a} ")
            for a, b in ((-0.1, 1.0), (2.0, 1.0), (0.5, -1.0), (np.nan, 1.0))
        ),
    ],
)
def test_leak_rates_and_errors_that_cannot_be_are_refused(make, message):
    with pytest.raises(Inconsistent, match=message):
        make()


@pytest.mark.parametrize(
    ("leak", "limit", "entries", "decision"),
    [
        (LEAK, 4e-10, (), "within limit"),  # the limit itself is allowed
        (LEAK, 3.999e-10, (), "undecided"),
        (LEAK, 1e-10, (), "undecided"),
        (LEAK, 0.999e-10, (), "above limit"),
        (LEAK, 5.001e-10, (GRID, MODEL), "within limit"),  # 4e-10 × 1.25
        (LEAK, 4.999e-10, (GRID, MODEL), "undecided"),
        # What may only add to the leak rate leaves "above limit" as it was, and nothing else.
        (LEAK, 0.9e-10, (SLIP,), "above limit"),
        *((LEAK, limit, (SLIP,), "undecided") for limit in (4e-10, 1.0)),
        (LEAK, 4e-10, (SUCTION,), "within limit"),
        (LEAK, 0.9e-10, (SUCTION,), "undecided"),
        (SEALED, 1e-10, (MODEL,), "within limit"),
        (SEALED, 1e-10, (SLIP,), "undecided"),
        (SEALED, 2e-10, (OPENS,), "within limit"),
        (SEALED, 1.9e-10, (OPENS,), "undecided"),
    ],
)
def test_verdict_counts_every_entry(leak, limit, entries, decision):
    found = judged(limit, *entries, leak=leak)
    assert found.decision == decision
    assert found.sentence.startswith(decision)
    # A narrower flow may decide what no entry leaves open.
    narrows = decision == "undecided" and {GRID, MODEL}.issuperset(entries)
    assert (found.needed_rtol is None) != narrows
    if decision == "undecided" and SLIP in entries:
        assert SLIP.sentence in found.sentence
    if GRID in entries:
        counting = "counting contact grid 0.8 to 1.25 (estimated)", "not covered: model"
        assert all(words in found.sentence for words in counting)


def test_what_would_decide_with_other_factors():
    """A bracket of the advised width, times the factors, ends at the limit."""
    limit = 3e-10
    rtol, _ = what_would_decide(LEAK, limit, Factors(0.8, 1.25))
    half = np.arcsinh(rtol / 2)
    assert 2e-10 * np.exp(half) * 1.25 == pytest.approx(limit, rel=1e-12)
    # 2e-10 × 1.25 and 2e-10 × 0.8 lie on both sides of 2.4e-10: no width is narrow enough.
    assert what_would_decide(LEAK, 2.4e-10, Factors(0.8, 1.25)) == (None, None)
    lift = Uncertainty("fluid_pressure", "estimated", "it opens", 1.0, 1.5, caution=True)
    words = "no setting narrows fluid pressure, the widest of them"
    assert words in judged(2.4e-10, lift).sentence
    # At the leak rate itself, an entry without width is no reason.
    settled = replace(lift, upper=1.0)
    assert "the best estimate is the limit itself" in judged(2e-10, settled).sentence
    # The entry of a computed lift is twice as wide as the bracket, and narrows with it.
    computed = Uncertainty("lift", "estimated", "passes", 0.5, 2.0, per_rtol=1.0)
    advised = 2 * np.sinh(np.log(1.2) / 3)
    assert judged(2.4e-10, computed).needed_rtol == pytest.approx(advised, rel=1e-12)
    assert f"; flow.rtol = {advised:.2g} might decide" in judged(2.4e-10, computed).sentence
    # The contact grid's part is narrowed by a smaller total error: ln(1 + total) = ln(2.4/2).
    # It chooses flow.rtol itself, and does not go with limit.decide.
    for decides, instead in ((False, "flow.rtol"), (True, "limit.decide")):
        words = f"accuracy.total = 0.2, in place of {instead}, might decide"
        assert words in judged(2.4e-10, GRID, decide=decides).sentence
    # With limit.decide more unknowns help a flow that has not decided, and no other.
    ended = replace(LEAK, reason="time")
    for leak, words in (
        (ended, "unknowns might decide (flow.max"),
        (LEAK, f"flow.rtol = {advised:.2g} in place of limit.decide might decide"),
    ):
        assert words in judged(2.4e-10, computed, leak=leak, decide=True).sentence
    # A scene with a total error takes no flow.rtol, and its total error leaves out other errors.
    kinetic = Uncertainty("slip", "estimated", "the gas slips", 0.9, 1.1)
    total = 2.4 / 2 / 1.1 - 1
    advised = judged(2.4e-10, GRID, kinetic, total=0.5).sentence
    assert f"accuracy.total = {total:.2g} might decide" in advised
    wide = replace(GRID, lower=0.5, upper=2.0)
    assert "a finer grid of the contact (surface.shape)" in judged(2.4e-10, wide, kinetic).sentence


def test_factors_near_one():
    """As a distance, of two digits and rounded up, where four digits would widen them much."""
    assert factor_words(Factors(0.99988, 1.000125)) == "1 ± 0.00013"
    assert factor_words(Factors(0.9954, 1.0046)) == "0.9954 to 1.005"
    assert factor_words(Factors(1 - 7e-16, 1 + 7e-16)) == "1"
    assert factor_words(Factors(1.0, np.inf)) == "at least 1"
    # The same digits in a verdict and in the line of errors.
    found = judged(3e-10, replace(GRID, upper=1.2034))
    assert "contact grid 0.8 to 1.204 (estimated)" in found.sentence


def test_words_of_a_sealed_gap_that_may_open():
    words = "may leak all the same: fluid pressure, up to the upper end of the leak rate"
    assert budget_words((OPENS, GRID), "sealed") == words
    assert (
        "; it opens; 0 to 200 % of the 1e-10 m^3/s all"
        in judged(1e-10, OPENS, leak=SEALED).sentence
    )


def rough(total=None, limit=None, **flow):
    """A rough contact of 32² samples, with a total error or a tolerance of the flow."""
    scene = scene_of_samples(32, short_wavelength="8 um") | {
        "solid": {"contact_modulus": "600 MPa"},
        "flow": {"pressure_drop": 1e5, "sides": "periodic", **flow},
        "output": {"products": ["leak_rate"]},
    }
    if total:
        scene["accuracy"] = {"total": total}
    if limit:
        scene["limit"] = {"leak_rate": f"{limit} m^3/s"}
    return Scene.from_mapping(scene)


def test_budget_of_a_scene():
    """The contact grid is estimated; a flow without bounds is named as not covered."""
    names = {entry.name: entry for entry in error_budget(Patch(rough(rtol=0.5)))}
    assert names["flow"].kind == "guaranteed"
    assert names["contact grid"].kind == "estimated"
    assert {"other patches of the face", "the model itself"} <= names.keys()
    by_differences = error_budget(Patch(rough(method="finite-difference")))
    counted = [entry.key for entry in by_differences if entry.counted]
    assert counted == ["contact_grid", "contact_area"]
    assert "; not covered: flow, fluid pressure, other patches of the face" in budget_words(
        by_differences
    )


CHANNEL = {"kind": "rectangle", "length": 1e-3, "width": 1e-3, "mesh_size": 1e-4, "gap": 1e-6}


@pytest.mark.parametrize("outlet", [0.0, 1e5])
@pytest.mark.parametrize("accommodation", [0.1, 0.4, 1.0])
@pytest.mark.parametrize("knudsen", [1e-3, 1e-2, 0.05])
def test_what_first_order_slip_and_no_slip_lack_holds_the_kinetic_law(
    knudsen, accommodation, outlet
):
    """In a channel, whose leak rate with each law is exact."""
    flow = {"inlet_pressure": 1.2e5, "outlet_pressure": outlet, "rtol": 1000.0}
    for law in ("first-order", False):
        walls = {"slip": law, "accommodation": accommodation} if law else {"slip": False}
        scene = Scene.from_mapping({"shape": CHANNEL, "fluid": AIR | walls, "flow": flow})
        gap = scene.drive.mean_free_path(scene.viscosity) / knudsen
        gain = 1.0 if scene.slip is None else scene.slip.mean_gain(gap)
        kinetic = scene.with_({"fluid.slip": "kinetic"}).slip.mean_gain(gap)
        entry = slip_entry_at(scene, gap, 1e-3, scene.flow.rtol)
        assert kinetic <= gain * entry.upper, law


@pytest.mark.parametrize("knudsen", [0.1, 1.0, 100.0])
def test_what_a_scene_without_slip_lacks_in_a_rarefied_gas(knudsen):
    """What the kinetic law adds in a channel, and 4 % for the model of the gas; at 0.1 first order
    with an excess of 1.2 Kn for one of 0.97 Kn at least, which is 5 % more."""
    flow = {"inlet_pressure": 1.2e5, "outlet_pressure": 1e5, "rtol": 1e5}
    scene = Scene.from_mapping({"shape": CHANNEL, "fluid": AIR | {"slip": False}, "flow": flow})
    gap = scene.drive.mean_free_path(scene.viscosity) / knudsen
    added = scene.with_({"fluid.slip": "kinetic"}).slip.mean_gain(gap) - 1
    found = slip_entry_at(scene, gap, 1e-3, scene.flow.rtol).upper - 1
    assert added <= found <= 1.06 * added
