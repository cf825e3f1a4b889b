"""The report holds every number and picture of its folder and refers to nothing outside itself."""

import base64
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from fem_seal.errors import InvalidInput
from fem_seal.render.report import flat, report, verdict

RESULT = {
    "schema": 1,
    "state": "leaking",
    "leak_rate": {"value": 2.0e-15, "lower": 1.9e-15, "upper": 2.1e-15, "unit": "m^3/s"},
    "contact_area_fraction": 0.4123,
    "converged": True,
    "seconds": {"contact": 1.5, "total": 12.25},
    "provenance": {"scene": "a <b> & 'c'", "seed": 7},
    "levels": [{"unknowns": 100}, {"unknowns": 200}],
    "shape": [512, 256],
}


class Page(HTMLParser):
    """Cells, texts and image sources of a page; complains about tags that do not match."""

    def __init__(self, text):
        super().__init__()
        self.open, self.cells, self.sources, self.references = [], [], [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        if tag not in {"meta", "img"}:
            self.open.append(tag)
        self.sources += [value for name, value in attributes if name == "src"]
        self.references += [value for name, value in attributes if name in {"src", "href"}]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in {"th", "td"}:
            self.cells.append(data)


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "A & B"
    folder.mkdir()
    (folder / "result.json").write_text(json.dumps(RESULT), encoding="utf-8")
    for name in ("zebra", "flow", "contact"):
        pixels = np.full((4, 4, 3), len(name), dtype=np.uint8)
        Image.fromarray(pixels).save(folder / f"{name}.png")
    return folder


def test_every_number_and_picture_is_inside(folder):
    path = report(folder)
    assert path == folder / "report.html"
    page = Page(path.read_text(encoding="utf-8"))
    rows = dict(zip(page.cells[::2], page.cells[1::2], strict=True))
    assert float(rows["leak_rate.lower"]) == 1.9e-15
    assert float(rows["seconds.total"]) == 12.25
    assert rows["levels[1].unknowns"] == "200"
    assert rows["shape"] == "[512, 256]"
    assert rows["provenance.scene"] == "a <b> & 'c'"  # escaped in the file, whole for the reader
    assert len(rows) == len(list(flat(RESULT)))
    pictures = [base64.b64decode(source.split(",", 1)[1]) for source in page.sources]
    expected = [(folder / f"{name}.png").read_bytes() for name in ("contact", "flow", "zebra")]
    assert pictures == expected


def test_nothing_outside_is_referred_to(folder):
    text = report(folder).read_text(encoding="utf-8")
    assert all(reference.startswith("data:") for reference in Page(text).references)
    assert not re.search(r"https?://|@import|url\(", text)


def test_reports_can_be_repeated(folder):
    first = report(folder).read_bytes()
    assert report(folder).read_bytes() == first


def test_verdict_names_bounds_and_their_width():
    text = verdict(RESULT)
    assert "between 1.9e-15 and 2.1e-15 m^3/s (±5 %)" in text  # 0.2 / 4.0
    assert "41.2 % of the nominal area" in text
    assert "not reached" not in text


def test_verdict_of_other_results():
    assert verdict({"state": "sealed", "leak_rate": None}).startswith("Sealed")
    assert "not reached" in verdict(RESULT | {"converged": False})
    plain = verdict({"state": "leaking", "leak_rate": {"value": 1.0, "unit": "m^3/s"}})
    assert plain == "Leaking: the leak rate is 1 m^3/s, no bounds."
    assert verdict({"contact_area_fraction": 0.1}) == "10 % of the nominal area is in contact."


def test_verdict_against_a_limit_in_the_unit_of_the_scene():
    tightest = {"x": 1e-6, "y": 2e-6, "gap": 3e-7, "width": 4e-6, "pressure_share": 0.25}
    more = {
        "leak_rate_shown": {"value": 2.0, "lower": 1.9, "upper": 2.1, "unit": "nl/h"},
        "verdict": {"decision": "within limit", "sentence": "within limit: at most", "limit": "3"},
        "quantities": {
            "constriction": tightest,
            "threshold": {"model": "bearing", "area_leaking": 0.49, "area_sealed": 0.5},
        },
    }
    text = verdict(RESULT | more)
    for words in (
        "In nl/h: 2, between 1.9 and 2.1.",
        "Verdict: within limit: at most.",
        "0.3 um high, 4 um wide, at x = 1 um, y = 2 um; takes 25 % of the pressure drop",
        "Threshold: seals between A/A0 = 0.49 and 0.5.",
    ):
        assert words in text
    # Without a limit there is nothing to decide.
    assert "Verdict" not in verdict(RESULT | {"verdict": {"decision": "leaking", "limit": None}})


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no result.json"),
        (b"{", "not readable JSON"),
        (b"\xff\xfe", "not readable JSON"),
        (b"[1]", "neither leak_rate"),
        (b"{}", "neither leak_rate"),
        (b'{"leak_rate": 3}', "needs value and unit"),
    ],
)
def test_folders_without_a_result_are_refused(tmp_path, content, message):
    if content is not None:
        (tmp_path / "result.json").write_bytes(content)
    with pytest.raises(InvalidInput, match=message):
        report(tmp_path)
    assert not (tmp_path / "report.html").exists()
