"""The report holds every number and picture of its folder and refers to nothing outside itself."""

import base64
import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from fem_seal import run
from fem_seal.errors import InvalidInput
from fem_seal.render.report import flat, report
from fem_seal.results import Result
from fem_seal.results.words import first_sentence, remarks, summary_of
from fem_seal.scene import Scene
from fem_seal.scene.readable import rows_of_mapping


def tree(text):
    """Elements of a page, whose tags must match; those of meta and img have no end."""
    closed = re.sub(r"<((?:meta|img) [^>]*)>", r"<\1/>", text)
    return ElementTree.fromstring(closed.replace("\x1b", ""))


def pictures(page):
    return [base64.b64decode(image.get("src").split(",", 1)[1]) for image in page.iter("img")]


def captions(page):
    """Captions up to the first colon."""
    return [caption.text.partition(":")[0] for caption in page.iter("figcaption")]


def read(path):
    return tree(path.read_text(encoding="utf-8"))


@pytest.fixture
def folder(small_scene, tmp_path):
    """A result without bounds, and pictures of which one has no caption of ours."""
    folder = tmp_path / "A & B <ü>"
    run(Scene.from_mapping(small_scene), folder)
    for name in ("zebra", "gap", "flow"):
        pixels = np.full((4, 4, 3), len(name), dtype=np.uint8)
        Image.fromarray(pixels).save(folder / f"{name}.png")
    return folder


def changed(folder, **fields):
    return Result.from_folder(folder).model_copy(update=fields)


def test_every_number_and_picture_is_inside(folder):
    path = report(folder)
    assert path == folder / "report.html"
    page = read(path)
    assert page.find(".//h1").text == folder.name  # escaped in the file, whole for the reader
    shown = [[cell.text for cell in row] for row in page.iter("tr")]
    result = Result.from_folder(folder)
    numbers = result.model_dump(mode="json", by_alias=True)
    assert numbers["levels"] == []  # by finite differences
    # In result.json alone; of the elimination, to rounding.
    assert numbers.pop("inflow") == pytest.approx(numbers.pop("outflow"), rel=1e-9)
    provenance = numbers.pop("provenance")
    scene = provenance["scene"]
    for rows in (summary_of(result), flat(numbers), flat({"versions": provenance["versions"]})):
        for row in rows:
            assert list(row) in shown
    for section, fields in scene.items():
        assert {f"{section}.{key}" for key in fields} <= {row[0] for row in shown}
    text = " ".join(page.itertext())
    for entry in result.error_budget:
        assert entry.sentence in text
    expected = [(folder / f"{name}.png").read_bytes() for name in ("flow", "gap", "zebra")]
    assert pictures(page) == expected
    assert captions(page) == ["Where it leaks", "The gap; contact is grey.", "zebra"]


def test_tolerances_are_rows_of_their_inputs():
    tolerances = {"tolerances": {"contact": {"pressure": "10 %"}}}
    assert rows_of_mapping(tolerances, Scene) == [("tolerances.contact.pressure", "10 %")]


def test_pictures_of_a_contact_that_is_lifted_off_are_left_out(folder):
    """Those that an older version drew: the dry contact is not the state."""
    text = changed(folder, state="lifted off", leak_rate=None).to_json()
    (folder / "result.json").write_text(text, encoding="utf-8")
    assert captions(read(report(folder))) == ["Where it leaks", "zebra"]


def test_nothing_outside_is_referred_to(folder):
    text = report(folder).read_text(encoding="utf-8")
    assert re.findall(r'(?:src|href)="(?!data:)', text) == []
    assert not re.search(r"https?://|@import|url\(|<script [^>]|import\(|fetch\(", text)


HOSTILE = "<script>alert(1)</script><img src=x onerror=y>{{ 7919 * 7907 * 7901 }}\x1b[2J\"'&"


def texts_of(value, path=()):
    """Paths of all texts inside nested dicts and lists."""
    if isinstance(value, str):
        yield path
    elif isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from texts_of(inner, (*path, key))


def test_no_text_of_a_result_becomes_markup(folder):
    """All texts that may be any text are replaced by one with tags and template code."""
    plain = report(folder).read_text(encoding="utf-8")
    whole = (folder / "result.json").read_text(encoding="utf-8")
    data, free = json.loads(whole), 0
    for path in texts_of(json.loads(whole)):
        inner = data
        for key in path[:-1]:
            inner = inner[key]
        kept, inner[path[-1]] = inner[path[-1]], HOSTILE
        (folder / "result.json").write_text(json.dumps(data), encoding="utf-8")
        try:
            Result.from_folder(folder).scene()
        except InvalidInput:
            inner[path[-1]] = kept
        else:
            free += 1
    assert free > 30
    (folder / "result.json").write_text(json.dumps(data), encoding="utf-8")
    page = report(folder).read_text(encoding="utf-8")
    tree(page)
    assert page.count("<script") == plain.count("<script") == 1
    assert page.count("<img") == plain.count("<img")
    assert str(7919 * 7907 * 7901) not in page


def test_folders_of_the_sender_are_not_told(scene_of_gap, tmp_path):
    run(Scene.from_mapping(scene_of_gap(np.full((5, 5), 1e-6))), tmp_path / "out")
    text = report(tmp_path / "out").read_text(encoding="utf-8")
    assert "gap.npz" in text
    assert str(tmp_path) not in text


def test_bounds_are_drawn_and_the_first_sentence_is_the_headline(small_scene, tmp_path):
    """Behind the headline it says what the limit makes of it."""
    small_scene["flow"] |= {"method": "uniform", "rtol": 0.02}
    small_scene["limit"] = {"leak_rate": "1 ml/h"}
    small_scene["output"]["leak_rate_unit"] = "nl/h"
    result = run(Scene.from_mapping(small_scene), tmp_path / "out")
    assert len(result.levels) > 1
    page = read(report(tmp_path / "out"))
    assert captions(page) == ["How sure"]
    assert pictures(page)[0].startswith(b"\x89PNG")
    assert not (tmp_path / "out" / "bounds.png").exists()
    assert first_sentence(result).startswith(f"Within limit: {result.headline}; at most ")
    assert first_sentence(result).endswith(" % of the 1e+6 nl/h allowed.")
    unfinished = result.model_copy(update={"converged": False, "reason": "max_seconds"})
    assert remarks(unfinished)[0].endswith("not reached: max_seconds.")


def test_verdict_of_a_contact_alone(folder):
    alone = changed(folder, headline=None, leak_rate=None, contact_area_fraction=0.1)
    assert first_sentence(alone) == "10 % of the nominal area is in contact."
