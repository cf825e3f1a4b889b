"""The sections that name a file: listings of docs/reference/scene.md, and contradictions."""

import re
import tomllib

import pytest
from project import ROOT

from fem_seal.field_file import Stated
from fem_seal.scene import Scene

PAGE = (ROOT / "docs/reference/scene.md").read_text()
LISTINGS = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
PRESSED = {"contact": {"model": "bearing", "mean_gap": 1e-6}, "output": {"products": ["contact"]}}


def listing(section, word):
    [text] = [text for text in LISTINGS if text.startswith(section) and word in text]
    return text


def switched_on(text):
    return re.sub(r"^# (?=\w+ = )", "", text, flags=re.MULTILINE)


@pytest.fixture
def files(tmp_path):
    """Empty files: a scene only asks whether they are there."""
    (tmp_path / "surface.npz").touch()
    (tmp_path / "gap.npz").touch()
    return tmp_path


SURFACE = listing("[surface]", 'kind = "file"')
GAP = listing("[gap]", "gap.npz")


@pytest.mark.parametrize("line", re.findall(r"^# (\w+ = .*?)$", SURFACE, re.MULTILINE))
def test_lines_of_the_surface(line, files):
    data = tomllib.loads(SURFACE.replace(f"# {line}", line)) | PRESSED
    assert line.split()[0] in Scene.from_mapping(data, folder=files).to_mapping()["surface"]


def test_listed_surface_in_si_units(files):
    data = tomllib.loads(switched_on(SURFACE)) | PRESSED
    surface = Scene.from_mapping(data, folder=files).surface
    assert surface.stated == Stated(
        "heights",
        "um",
        (1e-3, 1e-3),
        False,
        missing=-9999,
        turn=90,
        transpose=True,
        height_factor=1.02,
    )
    assert surface.crop == ((1e-4, 9e-4), (1e-4, 9e-4))
    again = Scene.from_mapping(Scene.from_mapping(data, folder=files).to_mapping())
    assert again.surface == surface


def test_listed_gap_in_si_units(files):
    data = tomllib.loads(switched_on(GAP)) | {"output": {"products": ["contact"]}}
    gap = Scene.from_mapping(data, folder=files).gap
    assert gap.stated == Stated("gap", "um", (1e-3, 1e-3), True, turn=90, transpose=True)
    assert gap.contact_below == 1e-12
