"""flow.lift from the scene to the result: folders, verdicts, budgets."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from lifted_scenes import scene

from fem_seal import run
from fem_seal.accuracy import Chosen
from fem_seal.drawing import draw
from fem_seal.patch import Patch
from fem_seal.quantities.lift import lift_range
from fem_seal.results import Result, read_contact
from fem_seal.results.words import remarks, summary_of
from fem_seal.solved import answer, solve


def entry(result):
    return next(entry for entry in result.error_budget if entry.name == "lift")


def test_the_film_does_not_depend_on_what_is_asked_for():
    """Contact and its quantities are those of the scene with a leak rate; without pressures dry."""
    products = ["contact", "conductivity_tensor", "threshold", "trapped_volume"]
    whole, without = (
        solve(scene(n=16, output={"products": named})).result()
        for named in ([*products, "leak_rate"], products)
    )
    assert without.quantities == whole.quantities
    assert without.contact_area_fraction == whole.contact_area_fraction < 0.3
    assert (without.lift, without.state) == (whole.lift, whole.state)
    assert without.leak_rate is None
    dry = solve(scene(n=16, output={"products": ["contact"]}).with_({"flow": {}})).result()
    assert dry.lift is None
    assert dry.contact_area_fraction == whole.lift.dry.contact_area_fraction


def test_folder_holds_the_lifted_contact(tmp_path):
    """Area, gap and pressure are of the contact that the leak rate belongs to; dry beside them."""
    result = run(scene(output={"products": ["contact", "leak_rate", "constriction"]}), tmp_path)
    contact = read_contact(tmp_path)
    gap, pressure = contact.gap, contact.pressure
    assert result.contact_area_fraction == np.count_nonzero(gap.values == 0) / gap.values.size
    assert result.lift.solid_pressure == pytest.approx(pressure.values.mean(), rel=1e-12)
    assert result.lift.solid_pressure + result.lift.fluid_pressure == pytest.approx(1.5e5, rel=1e-9)
    assert result.mean_pressure == 1.5e5
    dry = Patch(scene(lift="none")).contact
    assert result.lift.dry.contact_area_fraction == dry.contact_area_fraction
    assert result.contact_area_fraction < dry.contact_area_fraction
    assert result.mean_gap > result.lift.dry.mean_gap
    # The error of the lift leads to the ends that the result names.
    lift, value = entry(result), result.leak_rate.value
    assert lift.kind == "estimated"
    assert lift.lower * lift.upper == pytest.approx(1)
    ends = lift.lower * value, lift.upper * value
    assert (result.lift.lowest, result.lift.highest) == pytest.approx(ends, rel=1e-6)
    assert result.lift.change < np.log(lift.upper) * (1 + 1e-9)
    assert not any("fluid's pressure, up to" in caution for caution in result.cautions)


@pytest.mark.parametrize("method", ["adaptive", "finite-difference"])
def test_a_limit_of_time_ends_the_search(method):
    """With the range that is known by then, which holds the leak rate of the whole search."""
    whole = solve(scene(rtol=0.01, method=method)).result()
    ended = solve(scene(rtol=0.01, method=method, max_seconds=1e-9)).result()
    assert not ended.converged
    assert (
        "contact and flow have not settled: the limit max_seconds = 1e-09 s is used up"
        in ended.reason
    )
    assert ended.lift.lowest <= whole.leak_rate.value <= ended.lift.highest


def test_what_is_lifted_off_has_no_pictures(tmp_path):
    """Contact and gap on file are those without load: nobody may take them for the state."""
    result = run(scene(load=2e4, output={"products": ["leak_rate", "pictures"]}), tmp_path)
    assert [name for name in result.files if name.endswith(".png")] == []
    assert draw(tmp_path) == ()
    assert dict(summary_of(result))["contact"].endswith("only just touch")


def test_a_decision_counts_the_lift():
    """The flow alone would decide all limits, but the nearest lies within the error of the lift.

    The result has converged where the verdict is decided, and only there: its flow ends by the same
    error that the verdict counts. A smaller tolerance decides nearer limits.
    """

    def judged(limit, **flow):
        limit = {"leak_rate": f"{limit} m^3/s", "decide": True}
        limited = scene(max_unknowns=20_000, **flow).with_({"limit": limit})
        return solve(limited).result()

    most = Patch(scene(rtol=0.005)).leak_rate.upper
    found = [judged(part * most) for part in (1.01, 0.993, 0.9)]
    found.append(judged(1.005 * most, rtol=0.005))
    decisions = [(one.verdict.decision, one.converged) for one in found]
    within = "within limit", True
    assert decisions == [within, ("undecided", False), ("above limit", True), within]
    assert "uncertainty of the lift" in found[1].reason


def test_a_decision_that_the_fluid_pressure_leaves_open_is_missing():
    """A dry contact whose flow is decided, while its fluid may let more leak than is allowed."""
    asked = scene(max_unknowns=20_000, lift="none")
    dry = Patch(asked).leak_rate
    limit = {"leak_rate": f"{1.5 * dry.upper} m^3/s", "decide": True}
    result = solve(asked.with_({"limit": limit})).result()
    assert result.leak_rate.upper < 1.5 * dry.upper
    assert (result.verdict.decision, result.converged) == ("undecided", False)
    assert "limit.decide" in result.reason


def test_budget_of_a_state_that_has_not_settled():
    """All leak rates that are not excluded: a limit among these is not kept."""
    settled = Patch(scene()).lifted
    seen = {"lowest": 0.7 * settled.lowest, "highest": 1.2 * settled.highest}
    state = replace(settled, reason="not settled", **seen)
    patch = Patch(scene())
    patch.lifted = state
    result = answer(Chosen(patch)).result()
    assert not result.lift.settled
    assert "steps, not settled" in dict(summary_of(result))["lift"]
    # The command gives the reason on standard error, and a report once.
    assert not result.cautions
    assert state.reason == result.reason
    assert " ".join(remarks(result)).count(result.reason) == 1
    lift, value = entry(result), patch.leak_rate.value
    assert value * lift.lower == pytest.approx(state.lowest, rel=1e-6)
    assert value * lift.upper == pytest.approx(state.highest, rel=1e-6)


def test_a_sealed_film_that_more_pressure_would_open():
    """It has settled, may leak as much as the film that opens, and the user is warned.

    That film leaks less than the dry contact under the load less the inlet's pressure.
    """
    result = solve(scene(3e5, n=16, seed=1)).result()
    assert (result.state, result.lift.settled, result.converged) == ("sealed", True, True)
    most = result.lift.highest
    assert 0 < most < Patch(scene(2e5, n=16, seed=1, lift="none")).leak_rate.upper
    assert entry(result).upper_rate == most
    assert entry(result).upper is None
    assert any("would open a path, and up to" in text for text in result.cautions)
    assert (result.headline.lower, result.headline.upper) == (0.0, most)
    tolerated = scene(3e5, n=16, seed=1).with_({"tolerances.contact.pressure": "1 %"})
    inputs = solve(tolerated).result().error_budget
    assert next(one for one in inputs if one.key == "inputs").upper_rate >= most


def test_range_in_the_result():
    """Both ends, and a budget whose factors lead from the dry bounds to them."""
    output = {"products": ["leak_rate"], "leak_rate_unit": "ml/h"}
    result = solve(scene(lift="range", output=output)).result()
    low, high = lift_range(Patch(scene(lift="range")))
    assert (result.lift.lowest, result.lift.highest) == (low.lower, high.upper)
    assert entry(result).upper * result.leak_rate.upper == pytest.approx(high.upper, rel=1e-9)
    assert result.lift.solid_pressure is None
    assert "lifts off" not in entry(result).sentence
    # In four digits, rounded outwards; 1 m³/s = 3.6e9 ml/h.
    for words in (dict(summary_of(result))["lift"], entry(result).sentence.split("between ")[-1]):
        least, _, most, unit = words.replace(",", "").split()[:4]
        ends = 3.6e9 * low.lower, 3.6e9 * high.upper
        assert (float(least), float(most)) == pytest.approx(ends, rel=1e-3)
        assert unit == "ml/h"


@pytest.mark.parametrize("load", [2e4, 0.0])
def test_lifted_off_is_above_any_limit(load):
    """Also where there is no load, and flow.lift is left out."""
    output = {"products": ["leak_rate", "constriction"], "leak_rate_unit": "ml/h"}
    lift = {} if load else {"flow.lift": None}
    asked = scene(load=load, output=output).with_({"limit.leak_rate": "1 m^3/s"} | lift)
    result = solve(asked).result()
    assert (result.state, result.leak_rate, result.converged) == ("lifted off", None, True)
    assert result.verdict.decision == "above limit"
    assert Result.model_validate_json(result.to_json()) == result
    assert any("unlimited" in text for _, text in summary_of(result))


@pytest.mark.parametrize(("load", "near"), [(5.4e4, True), (6e4, False)])
def test_a_contact_next_to_lift_off_warns(load, near):
    """Below a twentieth of the load on the solid; without that part no contact is left."""
    result = solve(scene(load=load)).result()
    share = result.lift.solid_pressure / load
    assert (share < 1 / 20) is near
    warnings = [text for text in result.cautions if text.startswith("next to lift-off")]
    assert len(warnings) == near
    if near:
        assert f"{100 * share:.2g} % of the load" in warnings[0]
        assert Patch(scene(load=(1 - 2 * share) * load)).lifted_off


def test_threshold_of_a_lifted_contact():
    """Sealed at any fluid pressure: the dry threshold and the inlet's pressure on top."""
    output = {"products": ["leak_rate", "threshold"]}
    dry, lifted = (
        solve(scene(lift=lift, output=output)).result().quantities.threshold
        for lift in ("none", "resolved")
    )
    assert lifted.pressure_leaking == dry.pressure_leaking
    assert lifted.pressure_sealed == dry.pressure_sealed + 1e5
    # And it is: sealed above it, though the inlet's pressure acts up to the barrier.
    assert Patch(scene(load=1.001 * lifted.pressure_sealed)).leak_rate.state == "sealed"


def test_threshold_of_a_contact_that_vacuum_presses():
    """Ambient air presses a soft solid harder than it takes to seal: no load is needed for that."""
    solid, output = {"contact_modulus": 1e6}, {"products": ["threshold"]}
    vacuum = {"inlet_pressure": 0.9e5, "outlet_pressure": 0.0, "ambient_pressure": 1e5}
    pressed = {"n": 16, "solid": solid, "output": output, **vacuum}
    dry, lifted = (
        solve(scene(1e4, lift=lift, **pressed)).quantities.threshold
        for lift in ("none", "resolved")
    )
    assert 1e4 < dry.pressure_sealed < 1e5
    assert (lifted.pressure_leaking, lifted.pressure_sealed) == (0, dry.pressure_sealed - 1e4)


def test_an_error_of_the_lift_that_is_not_known(monkeypatch):
    """Where no finer network can be made, nothing says how far the leak rate is off: no numbers."""
    monkeypatch.setattr(import_module("fem_seal.lifting"), "MOST_BY_MULTIGRID", 1)
    result = solve(scene()).result()
    assert (result.converged, result.lift.lowest, result.lift.highest) == (False, 0.0, None)
    assert (result.headline.lower, result.headline.upper) == (None, None)
    sentence = (
        "contact and flow have not settled: a finer network would have more than 1 node: the leak "
        "rate may have any value; compare a finer grid of the contact"
    )
    assert entry(result).sentence == sentence
    assert not any("e+" in text or " inf " in text for _, text in summary_of(result))


def test_a_load_that_is_the_pressure_of_the_fluid_to_rounding():
    """An outlet below ambient leaves a load to the solid; the inlet's alone would leave -3e-11."""
    pressures = {"inlet_pressure": 327227.0905968879, "ambient_pressure": 2e5}
    on = scene(127227.09059688794, n=16, outlet_pressure=1.6e5, **pressures)
    assert Patch(on).leak_rate.state == "leaking"
