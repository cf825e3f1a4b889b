"""The report as people see it: in a browser, on a telephone and on paper."""

import json
import re
import shutil
import subprocess
import unicodedata

import pypdf
import pytest
from project import scene_of_samples

from fem_seal import Scene, run
from fem_seal.render.report import report
from fem_seal.results.words import summary_of

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
pytestmark = [
    pytest.mark.render,
    pytest.mark.skipif(CHROMIUM is None, reason="apt-get install chromium"),
]


def browser(page, *options):
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", *options, page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def result(scene_of_a_seal, tmp_path_factory):
    folder = tmp_path_factory.mktemp("result") / "seal"
    return run(Scene.from_mapping(scene_of_a_seal), folder), report(folder)


@pytest.fixture(scope="module")
def scene_of_a_seal():
    return scene_of_samples(32) | {
        "contact": {"pressure": "100 kPa"},
        "flow": {"pressure_drop": "10 kPa", "rtol": 0.2},
        "limit": {"leak_rate": "1 ml/h"},
        "output": {"products": ["contact", "leak_rate", "pictures", "constriction"]},
    }


def test_nothing_is_fetched_and_no_script_fails(result, tmp_path):
    _, page = result
    log = tmp_path / "net.json"
    printed = browser(page, "--enable-logging=stderr", f"--log-net-log={log}", "--dump-dom")
    assert "CONSOLE" not in printed
    # Requests of a page from a file have the initiator "null", the browser's own calls home others.
    calls = [event.get("params", {}) for event in json.loads(log.read_text())["events"]]
    fetched = [call["url"] for call in calls if call.get("initiator") == "null"]
    assert [url for url in fetched if not url.startswith(("data:", "file:"))] == []


def test_it_is_readable_on_a_telephone(result, tmp_path):
    """At a width of 400 px nothing is wider than the page, but for tables that scroll inside."""
    _, page = result
    narrow = tmp_path / "narrow.html"
    frame = (
        '<iframe id="f" style="width: 400px; height: 3000px; border: 0" srcdoc="{}"></iframe>'
        "<script>onload = () => {{ document.title ="
        " document.getElementById('f').contentDocument.documentElement.scrollWidth }}</script>"
    )
    text = page.read_text(encoding="utf-8").replace("&", "&amp;").replace('"', "&quot;")
    narrow.write_text(frame.format(text), encoding="utf-8")
    shown = browser(narrow, "--dump-dom")
    assert int(re.search(r"<title>(\d+)</title>", shown)[1]) <= 400


def solid(text):
    """Text without spaces and ligatures, which a line break or a font may change."""
    return re.sub(r"\s", "", unicodedata.normalize("NFKC", text))


def test_paper_has_every_word(result, tmp_path):
    """Also the parts that are folded away on the screen, on five pages at most."""
    answer, page = result
    paper = tmp_path / "report.pdf"
    browser(page, f"--print-to-pdf={paper}")
    pages = pypdf.PdfReader(paper).pages
    assert len(pages) <= 5
    words = solid("".join(part.extract_text() for part in pages))
    for name, value in summary_of(answer):
        assert solid(name + value) in words
    for entry in answer.error_budget:
        assert solid(entry.sentence) in words
    for number in (answer.contact_area_fraction, answer.leak_rate.lower):
        assert f"{number:.8g}" in words  # of the folded table of all numbers
    for digest in answer.provenance.versions.values():
        assert digest in words
