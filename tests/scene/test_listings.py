"""Listings of docs/reference/scene.md: valid by the schema, and read line by line in SI units."""

import re
import tomllib

import pytest
from jsonschema import Draft202012Validator
from project import ROOT

from fem_seal.field_file import Stated
from fem_seal.scene import Scene
from fem_seal.scene.schema import scene_schema

PAGE = (ROOT / "docs/reference/scene.md").read_text(encoding="utf-8")
LISTINGS = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
REFERENCE, SURFACE, _, GAP = LISTINGS[:4]
COMMENTED = re.compile(r"^# (\w+ = .*?)$", re.MULTILINE)

CONTACT = ["output.products=['contact']"]
PRESSED = ["contact.model=bearing", "contact.mean_gap=1 um", *CONTACT]
ENDS = ["flow.pressure_drop=", "flow.inlet_pressure=2 bar", "flow.outlet_pressure=1 bar"]
MASS, WARM = "fluid.molar_mass=29 g/mol", "fluid.temperature=20 degC"
AS_GAS = ["fluid.kind=gas", *ENDS]
# What must go, or come, for an alternative of the reference scene.
INSTEAD = {
    "rms_height": ["surface.rms_slope="],
    "youngs_modulus": ["solid.contact_modulus=", "solid.poisson_ratio=[0.5, 0.3]"],
    "poisson_ratio": ["solid.contact_modulus=", "solid.youngs_modulus=[1e7, 1e11]"],
    "layer_poisson_ratio": ["solid.layer_thickness=1 mm"],
    "area_fraction": ["contact.pressure="],
    "mean_gap": ["contact.pressure="],
    "inlet_pressure": ["flow.pressure_drop=", "flow.outlet_pressure=1 bar"],
    "outlet_pressure": ["flow.pressure_drop=", "flow.inlet_pressure=2 bar"],
    "ambient_pressure": ENDS,
    "molar_mass": [*AS_GAS, WARM],
    "temperature": [*AS_GAS, MASS],
}
for name in ("reference_temperature", "reference_pressure", "slip", "accommodation"):
    INSTEAD[name] = [*AS_GAS, MASS, WARM]


@pytest.fixture
def read(tmp_path):
    """Function that reads a listing; a scene only asks whether its files are there."""
    (tmp_path / "surface.npz").touch()
    (tmp_path / "gap.npz").touch()

    def scene(text, changes=()):
        (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
        return Scene.from_file(tmp_path / "scene.toml", changes)

    return scene


@pytest.mark.parametrize("text", LISTINGS)
def test_listings_are_valid(text):
    """Each alternative of the page in its turn."""
    is_valid = Draft202012Validator(scene_schema()).is_valid
    assert is_valid(tomllib.loads(text))
    for line in COMMENTED.findall(text):
        assert is_valid(tomllib.loads(text.replace(f"# {line}", line))), line


def test_reference_scene_is_valid(read):
    assert read(REFERENCE).surface.shape == (512, 512)


@pytest.mark.parametrize(
    ("text", "line"),
    [(text, line) for text in (REFERENCE, SURFACE) for line in COMMENTED.findall(text)],
)
def test_each_commented_line(text, line, read):
    """It can be switched on where what it stands in place of is taken away."""
    key = line.split()[0]
    section = re.findall(r"^\[(\w+)\]", text.partition(f"# {line}")[0], re.MULTILINE)[-1]
    changes = PRESSED if text is SURFACE else INSTEAD.get(key, [])
    assert key in read(text.replace(f"# {line}", line), changes).to_mapping()[section]


def test_listed_surface_in_si_units(read):
    scene = read(COMMENTED.sub(r"\1", SURFACE), PRESSED)
    assert scene.surface.crop == ((1e-4, 9e-4), (1e-4, 9e-4))
    about = {"missing": -9999, "turn": 90, "transpose": True, "height_factor": 1.02}
    assert scene.surface.stated == Stated("heights", "um", (1e-3, 1e-3), False, **about)
    assert Scene.from_mapping(scene.to_mapping()).surface == scene.surface


def test_listed_gap_in_si_units(read):
    gap = read(COMMENTED.sub(r"\1", GAP), CONTACT).gap
    assert gap.stated == Stated("gap", "um", (1e-3, 1e-3), True, turn=90, transpose=True)
    assert gap.contact_below == 1e-12
