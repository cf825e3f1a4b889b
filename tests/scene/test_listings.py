"""Listings of docs/reference/scene.md, read line by line in SI units, and the schema of scenes."""

import json
import re
import tomllib

import pytest
from jsonschema import Draft202012Validator
from project import ROOT

from fem_seal import cli
from fem_seal.field_file import Stated
from fem_seal.scene import Scene
from fem_seal.scene.schema import scene_schema

PAGE = (ROOT / "docs/reference/scene.md").read_text(encoding="utf-8")
LISTINGS = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
REFERENCE, SURFACE, _, GAP = LISTINGS[:4]
SCENES = [path.read_text("utf-8") for path in sorted((ROOT / "demos/scenes").glob("*.toml"))]
SCHEMA = scene_schema()
is_valid = Draft202012Validator(SCHEMA).is_valid
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


# The schema of `fem-seal schema`.


SOLIDS = [f"[solid]\nyoungs_modulus = {E}" for E in ("'1 Pa'", "1e7", "['1 Pa']", "[1, '2 GPa']")]
# The second axis of a polar grid is an angle, whose unit depends on another field.
ORIGIN = (
    "[shape]\nkind = 'rectangle'\nlength = 1\nwidth = 1\nmesh_size = 0.1\ngrid_origin = ['1 mm'{}]"
)


@pytest.mark.parametrize("text", [*LISTINGS, *SCENES, *SOLIDS, ORIGIN.format(", '90 deg'")])
def test_right_scenes_are_valid(text):
    """Each alternative of the page in its turn."""
    assert is_valid(tomllib.loads(text))
    for line in COMMENTED.findall(text) if text in LISTINGS else ():
        assert is_valid(tomllib.loads(text.replace(f"# {line}", line))), line


@pytest.mark.parametrize(
    "line",
    [
        "[flow]\npresure_drop = 1",
        "[flow]\npressure_drop = '1'",
        "[solid]\nyoungs_modulus = [1, 2, 3]",
        "[surface]\nkind = 'fil'",
        "[surfaces]\nkind = 'file'",
        ORIGIN.format(""),
    ],
)
def test_faults_are_seen(line):
    assert not is_valid(tomllib.loads(line))


def accepting(value):
    """Names of the fields that may have a value. Those of [tolerances] are read by a function."""
    parts = (part for name, part in SCHEMA["$defs"].items() if not name.startswith("Of"))
    fields = [field for part in parts for field in part["properties"].items()]
    valid = (Draft202012Validator(one | {"$defs": SCHEMA["$defs"]}).is_valid for _, one in fields)
    return {key for (key, _), accepts in zip(fields, valid, strict=True) if accepts(value)}


def test_values_that_fields_accept():
    """Of all fields: who takes any word, no more than its range, a part of one, a list of two."""
    words = accepting("word")
    assert words == {
        *("path", "array", "unit", "inlet", "outlet", "wall", "gap_expression", "missing"),
        *("pressure_profile", "leak_rate", "leak_rate_unit", "heights"),
    }
    assert accepting(-1) <= words
    assert accepting(0) - words == {
        *("pressure", "outlet_pressure", "ambient_pressure", "area_fraction", "max_missing"),
        *("poisson_ratio", "layer_poisson_ratio", "seed", "twin_seed", "turn"),
    }
    assert accepting(0.5) - accepting(1) == {
        *("area_fraction", "max_missing", "tolerance", "total"),
        *("poisson_ratio", "layer_poisson_ratio"),
    }
    assert accepting(1) - accepting(2) == {"hurst", "accommodation"}
    assert accepting(2) - accepting(2.5) - words == {
        *("threads", "max_iterations", "max_unknowns", "max_refinement", "patches"),
        *("seed", "twin_seed"),
    }
    assert accepting(True) == {"contact_grid", "periodic", "transpose", "slip", "decide"}
    assert accepting([1, 2]) == {
        *("shape", "size", "holes", "window", "grid_origin", "youngs_modulus"),
    }


def test_command(capsys):
    assert cli.main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == SCHEMA
