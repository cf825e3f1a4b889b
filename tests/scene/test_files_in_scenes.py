"""The sections that name a file: listings of docs/reference/scene.md, and contradictions."""

import re
import tomllib

import pytest
from project import ROOT

from fem_seal.errors import InvalidInput
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


BAD = {
    "unit": ("kg", "surface.unit = 'kg' is no unit of length such as 'nm', 'um' or 'mm'"),
    "size": (["1 mm"], r"surface.size\[1\] is missing"),
    "crop": ([[0, 1e-6], ["2 um", "1 um"]], "crop in y must end after 2e-06 m, not 1e-06"),
    "fill": ("nearest", "choose from 'harmonic'"),
    "detrend": ("cubic", "choose from 'mean', 'plane' or 'quadratic'"),
    "make_periodic": ("wrap", "choose from 'cut', 'mirror', 'hann' or 'tukey'"),
    "max_missing": (1, "surface.max_missing = 1 should be less than 1"),
    "twin_seed": (-1, "surface.twin_seed = -1 should be greater than or equal to 0"),
    "periodic": ("no", "surface.periodic = 'no' should be a valid boolean"),
    "shape": ([8, 8], "surface.shape is not a known key; known are path, array, unit, size"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_field(name, files):
    value, message = BAD[name]
    data = {"surface": {"kind": "file", "path": "surface.npz", name: value}, **PRESSED}
    with pytest.raises(InvalidInput, match=message) as caught:
        Scene.from_mapping(data, folder=files)
    assert "\n" not in str(caught.value)


def test_periodic_map_is_not_made_periodic(files):
    surface = {"kind": "file", "path": "surface.npz", "periodic": True, "make_periodic": "cut"}
    with pytest.raises(InvalidInput, match="periodic = true needs no make_periodic"):
        Scene.from_mapping({"surface": surface, **PRESSED}, folder=files)
