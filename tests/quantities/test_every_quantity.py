"""A quantity that a scene may name has a line of words, and a page that says how sure it is."""

import re
from dataclasses import fields, replace

import pytest
from project import ROOT, scene_of_samples

import fem_seal as fs
from fem_seal.quantities.of_patch import QUANTITIES
from fem_seal.results import Result
from fem_seal.results.words import summary_of

PAGE = (ROOT / "docs/reference/quantities.md").read_text(encoding="utf-8")
ERRORS = dict(re.findall(r"^\| `(\w+)` \| (.+) \|$", PAGE, re.MULTILINE))


@pytest.fixture(scope="module")
def result():
    scene = scene_of_samples(32)
    scene["output"] = {"products": ["leak_rate", *QUANTITIES]}
    scene["contact"] = {"pressure": "0.2 MPa"}
    scene["flow"] |= {"method": "adaptive", "rtol": 0.5, "lift": "none"}
    return fs.solve(fs.Scene.from_mapping(scene)).result()


def test_all_survive_their_file(result):
    assert Result.model_validate_json(result.to_json()) == result


@pytest.mark.parametrize("name", QUANTITIES)
def test_a_quantity_has_one_line(name, result):
    without = replace(result.quantities, **{name: None})
    lines, fewer = summary_of(result), summary_of(result.model_copy(update={"quantities": without}))
    own = [line for line in lines if line not in fewer]
    assert len(own) == len(lines) - len(fewer) == 1, own
    assert re.search(r"\d", own[0][1]), "the line has its number"


@pytest.mark.parametrize("name", QUANTITIES)
def test_a_quantity_has_its_error(name, result):
    """The page names it. Where that is an interval, the line prints both ends."""
    assert name in ERRORS, "docs/reference/quantities.md has no row of its error"
    if "bounds" not in ERRORS[name] and "between" not in ERRORS[name]:
        assert "as represented" in ERRORS[name]
        return
    part = getattr(result.quantities, name)
    ends = [field.name for field in fields(part) if field.name.endswith(("lower", "leaking"))]
    assert ends or hasattr(part.xx, "lower")
