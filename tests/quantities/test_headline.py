"""The headline: the leak rate with all counted errors, and the part that is guaranteed."""

import json
import re
from dataclasses import replace
from math import inf

import pytest
from test_error_budget import FLOW, GRID, LEAK, MODEL, SLIP, rough

from fem_seal import run
from fem_seal.leak_rate import LeakRate
from fem_seal.quantities.error_budget import Uncertainty
from fem_seal.quantities.headline import Shown, headline
from fem_seal.results import Result

RANGE = Uncertainty("lift", "estimated", "anywhere", 0.9, 30.0, is_range=True)


def test_factors_widen_the_bounds():
    """1e-10 × 0.8 to 4e-10 × 1.25, in a unit of 1e-12 m³/s, and the flow's ±(4 - 1)/(4 + 1)."""
    head = headline(LEAK, (FLOW, GRID, MODEL), Shown("pl/s", 1e12))
    assert (head.value, head.unit) == (LEAK.value, "m^3/s")
    assert (head.lower, head.upper) == pytest.approx((0.8e-10, 5e-10), rel=1e-14)
    value, low, high, percent = map(float, re.findall(r"\d[\d.]*", str(head)))
    assert (value, percent) == (200, 60)
    # Rounded outwards, by at most a tenth of the half-width of 210.
    assert 80 - 21 <= low <= 80
    assert 500 <= high <= 500 + 21
    assert str(head).endswith("with all counted errors; flow alone ±60 %, guaranteed")


def test_an_open_side_has_no_number():
    above, below = headline(LEAK, (FLOW, SLIP)), Uncertainty("suction", "not covered", "", None, 1)
    assert (above.lower, above.upper) == (LEAK.lower, None)
    assert "at least 1" in above.sentence
    assert headline(LEAK, (FLOW, below)).lower is None
    assert "at most 4" in headline(LEAK, (FLOW, below)).sentence
    both = headline(LEAK, (FLOW, SLIP, below))
    assert (both.lower, both.upper) == (None, None)


def test_a_range_has_no_middle():
    """Neither a value nor a ± stands for a leak rate that may be anywhere in a range."""
    head = headline(LEAK, (FLOW, RANGE))
    assert (head.lower, head.upper) == pytest.approx((0.9e-10, 1.2e-8), rel=1e-14)
    assert "±" not in head.sentence
    assert not head.sentence.startswith("2")


def test_sealed_and_lifted_off():
    """A factor cannot widen 0: only the upper bound that an entry computed can."""
    sealed = LeakRate.sealed("adaptive")
    assert headline(sealed, (GRID, MODEL)).upper == 0
    assert headline(sealed, (SLIP,)).upper is None
    opens = Uncertainty("lift", "estimated", "", 1.0, None, upper_rate=2e-10)
    assert headline(sealed, (opens, GRID)).upper == pytest.approx(2.5e-10, rel=1e-14)
    unknown = headline(sealed, (replace(opens, upper_rate=inf), GRID))
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
