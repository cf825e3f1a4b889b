"""The verdict: four decisions, advice if undecided, and refinement that stops when decided."""

from dataclasses import replace

import numpy as np
import pytest
from test_error_budget import LEAK, SHOWN, judged

from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Patch
from fem_seal.quantities.verdict import verdict, what_would_decide
from fem_seal.results.words import summary_of
from fem_seal.scene import Scene
from fem_seal.solved import answer, solve


def test_shares_of_the_limit_are_rounded_like_the_bounds():
    """An upper bound just below its limit is not 100 % of it, a lower one just above not once."""
    assert "99.99 % of the" in judged(4e-10 / 0.99985).sentence
    assert "1.000 times the" in judged(1e-10 / 1.00009).sentence


def test_sealed_and_without_limit():
    sealed = LeakRate.sealed("adaptive")
    assert verdict(sealed, SHOWN, None, None).decision == "sealed"
    kept = judged(1e-9, leak=sealed)
    assert kept.decision == "within limit"
    assert kept.comparison.startswith("1e-9 m^3/s allowed")
    assert "zero holds only for what is covered" in kept.sentence
    found = verdict(LEAK, SHOWN, None, None)
    assert (found.decision, found.limit) == ("leaking", None)
    assert "1e-10 to 4e-10" in found.sentence
    estimate = replace(LEAK, lower=None, upper=None)
    assert "without bounds" in verdict(estimate, SHOWN, None, None).sentence


def test_what_would_decide():
    """A bracket around √(lower upper) = 2 that ends at the limit 3: (3 - 4/3)/2 wide."""
    rtol, unknowns = what_would_decide(LEAK, 3e-10)
    assert rtol == pytest.approx((3 - 4 / 3) / 2, rel=1e-12)
    # Twice the unknowns, half the bracket: now it is (4 - 1)/2 wide.
    assert unknowns == round(1000 * 1.5 / rtol)
    # As far below as above.
    assert what_would_decide(LEAK, 4 / 3 * 1e-10)[0] == pytest.approx(rtol, rel=1e-12)


def test_nothing_to_advise():
    assert what_would_decide(LEAK, 2e-10) == (None, None)
    assert "the limit itself" in judged(2e-10).sentence
    unbounded = replace(LEAK, lower=0.0)
    assert what_would_decide(unbounded, 3e-10) == (None, None)
    assert "no lower bound yet" in judged(3e-10, leak=unbounded).sentence


def with_unit(rate):
    """Text of a leak rate, in m³/s if it is a number."""
    return rate if isinstance(rate, str) else f"{rate} m^3/s"


@pytest.fixture
def rough(scene_of_gap):
    """A scene of a rough gap with a limit."""
    values = 1e-6 * np.maximum(np.random.default_rng(2).random((17, 17)) - 0.1, 0)

    def scene(leak_rate, decide=False, **flow):
        limit = {"leak_rate": with_unit(leak_rate), "decide": decide}
        flow = {"pressure_drop": 1e5, **flow}
        return Scene.from_mapping(scene_of_gap(values, flow=flow, limit=limit))

    return scene


@pytest.fixture
def truth(rough):
    """Bounds of ±2 %."""
    return Patch(rough(1.0, rtol=0.04)).leak_rate


@pytest.mark.parametrize(("part", "decision"), [(1.1, "within limit"), (0.9, "above limit")])
def test_refinement_stops_when_the_bounds_decide(rough, truth, part, decision):
    """Far earlier than for the truth, with bounds that hold it and exclude the limit."""
    patch = Patch(rough(part * truth.value, decide=True, max_unknowns=20_000))
    leak, result = patch.leak_rate, answer(patch).result()
    assert result.verdict.decision == decision
    assert leak.converged
    assert leak.lower <= truth.upper
    assert leak.upper >= truth.lower
    assert leak.unknowns < truth.unknowns
    # One level less and it would have been open.
    before = leak.levels[-2]
    assert before.lower <= part * truth.value < before.upper


@pytest.mark.parametrize("written", ["{} m^3/s", "{} ml/h", "{} l/min", "{} mm^3/day"])
def test_verdict_does_not_depend_on_the_unit(rough, written):
    """Unit neutrality: one limit, many spellings, one decision; the sentence shows the unit."""
    size = {"m^3/s": 1, "ml/h": 1e-6 / 3600, "l/min": 1e-3 / 60, "mm^3/day": 1e-9 / 86400}
    unit = written.removeprefix("{} ")
    for factor, decision in ((1e-14, "above limit"), (1e-9, "within limit")):
        result = solve(rough(written.format(factor / size[unit]), rtol=0.5)).result()
        assert result.verdict.decision == decision
        assert f"{unit} allowed" in result.verdict.sentence


def test_words_of_a_scene_with_a_limit(rough, truth):
    result = solve(rough(f"{truth.value} m^3/s", rtol=0.3)).result()
    labels = dict(summary_of(result))
    assert labels["verdict"].startswith("undecided")
    assert "sealed if the gap were lowered" in labels["tightest"]
    assert result.quantities.constriction.pressure_share > 0
