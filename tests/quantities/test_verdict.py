"""Headlines with all counted errors, and verdicts: decisions and advice."""

import json
import re
from dataclasses import replace
from math import inf

import pytest
from test_error_budget import FLOW, GRID, LEAK, MODEL, SEALED, SLIP, SUCTION, judged, rough

from fem_seal import run
from fem_seal.error_budget import Uncertainty
from fem_seal.leak_rate import Factors, LeakRate
from fem_seal.quantities.advice import what_would_decide
from fem_seal.quantities.headline import ShownUnit, headline
from fem_seal.quantities.verdict import verdict
from fem_seal.render.report import report
from fem_seal.results import Result

RANGE = Uncertainty("lift", "estimated", "anywhere", 0.9, 30.0, is_range=True)


def test_factors_widen_the_bounds():
    """1e-10 × 0.8 to 4e-10 × 1.25, in a unit of 1e-12 m³/s, and the flow's ±(4 - 1)/(4 + 1)."""
    head = headline(LEAK, (FLOW, GRID, MODEL), ShownUnit("pl/s", 1e12))
    assert (head.value, head.unit) == (LEAK.value, "m^3/s")
    assert (head.lower, head.upper) == pytest.approx((0.8e-10, 5e-10), rel=1e-14)
    value, low, high, percent = map(float, re.findall(r"\d[\d.]*", str(head)))
    assert (value, percent) == (200, 60)
    # Rounded outwards, by at most a tenth of the half-width of 210.
    assert 80 - 21 <= low <= 80
    assert 500 <= high <= 500 + 21
    assert str(head).endswith("with all counted errors; flow alone ±60 %, guaranteed")


def test_an_open_side_has_no_number():
    above = headline(LEAK, (FLOW, SLIP))
    assert (above.lower, above.upper) == (LEAK.lower, None)
    assert "at least 1" in above.sentence
    assert headline(LEAK, (FLOW, SUCTION)).lower is None
    assert "at most 4" in headline(LEAK, (FLOW, SUCTION)).sentence
    both = headline(LEAK, (FLOW, SLIP, SUCTION))
    assert (both.lower, both.upper) == (None, None)


def test_a_range_has_no_middle():
    """Neither a value nor a ± stands for a leak rate that may be anywhere in a range."""
    head = headline(LEAK, (FLOW, RANGE))
    assert (head.lower, head.upper) == pytest.approx((0.9e-10, 1.2e-8), rel=1e-14)
    assert "±" not in head.sentence
    assert not head.sentence.startswith("2")


def test_sealed_and_lifted_off():
    """A factor cannot widen 0: only the upper bound that an entry computed can."""
    assert headline(SEALED, (GRID, MODEL)).upper == 0
    assert headline(SEALED, (SLIP,)).upper is None
    opens = Uncertainty("lift", "estimated", "", 1.0, None, upper_rate=2e-10)
    assert headline(SEALED, (opens, GRID)).upper == pytest.approx(2.5e-10, rel=1e-14)
    unknown = headline(SEALED, (replace(opens, upper_rate=inf), GRID))
    assert (unknown.value, unknown.upper) == (0, None)
    assert "no upper bound is known (lift)" in unknown.sentence
    off = headline(LeakRate.lifted_off("adaptive"), ())
    assert (off.value, off.lower, off.upper) == (None, None, None)


def test_a_result_of_the_first_schema_gets_the_headline(tmp_path):
    """Its keys, of which only the headline and the keys of the entries are missing."""
    result = run(rough(rtol=0.3), tmp_path)
    old = json.loads((tmp_path / "result.json").read_text()) | {"schema": 1}
    del old["together"]
    old["kkt_residual"] = old.pop("certificate")
    for entry in old["error_budget"]:
        entry["name"] = entry.pop("key").replace("_", " ")
        del entry["is_range"]
    old["verdict"]["headline"] = f"leaking: {old['verdict'].pop('comparison')}"
    (tmp_path / "result.json").write_text(json.dumps(old))
    read = Result.from_folder(tmp_path)
    assert read.headline == result.headline
    assert [replace(e, name="") for e in read.error_budget] == [
        replace(e, name="") for e in result.error_budget
    ]
    assert (read.schema_version, read.certificate) == (2, result.certificate)
    # Still older ones hold no budget, and the report does not say that nothing is uncertain.
    del old["error_budget"], old["cautions"]
    (tmp_path / "result.json").write_text(json.dumps(old))
    assert Result.from_folder(tmp_path).error_budget is None
    page = report(tmp_path).read_text(encoding="utf-8")
    assert "holds no error budget" in page
    assert "Nothing that the program knows of" not in page


def test_shares_of_the_limit_are_rounded_like_the_bounds():
    """An upper bound just below its limit is not 100 % of it, a lower one just above not once."""
    assert "99.99 % of the" in judged(4e-10 / 0.99985).sentence
    assert "1.000 times the" in judged(1e-10 / 1.00009).sentence


def test_sealed_and_without_limit():
    assert verdict(rough(), SEALED).decision == "sealed"
    kept = judged(1e-9, leak=SEALED)
    assert kept.decision == "within limit"
    assert kept.comparison.startswith("1e-9 m^3/s allowed")
    assert "zero holds only for what is covered" in kept.sentence
    found = verdict(rough(), LEAK)
    assert (found.decision, found.limit) == ("leaking", None)
    assert "1e-10 to 4e-10" in found.sentence
    estimate = replace(LEAK, lower=None, upper=None)
    assert "without bounds" in verdict(rough(), estimate).sentence


def test_what_would_decide():
    """A bracket around √(lower upper) = 2 that ends at the limit 3: (3 - 4/3)/2 wide."""
    rtol, unknowns = what_would_decide(LEAK, 3e-10, Factors())
    assert rtol == pytest.approx((3 - 4 / 3) / 2, rel=1e-12)
    # Twice the unknowns, half the bracket: now it is (4 - 1)/2 wide.
    assert unknowns == round(1000 * 1.5 / rtol)
    # As far below as above.
    assert what_would_decide(LEAK, 4 / 3 * 1e-10, Factors())[0] == pytest.approx(rtol, rel=1e-12)


def test_nothing_to_advise():
    assert what_would_decide(LEAK, 2e-10, Factors()) == (None, None)
    assert "the limit itself" in judged(2e-10).sentence
    unbounded = replace(LEAK, lower=0.0)
    assert what_would_decide(unbounded, 3e-10, Factors()) == (None, None)
    assert "no lower bound yet" in judged(3e-10, leak=unbounded).sentence
