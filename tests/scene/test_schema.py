"""fem-seal schema: scenes that are accepted are valid by it, and what it refuses is refused."""

import json
import re
import tomllib

import pytest
from project import ROOT

from fem_seal import cli
from fem_seal.scene.schema import scene_schema

SCHEMA = scene_schema()
SCENES = sorted((ROOT / "demos" / "scenes").glob("*.toml"))
PAGE = (ROOT / "docs/reference/scene.md").read_text()
LISTINGS = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
TYPES = {
    "string": str,
    "boolean": bool,
    "array": list,
    "object": dict,
    "integer": int,
    "number": (int, float),
}


def is_type(value, name):
    return isinstance(value, TYPES[name]) and (name == "boolean" or not isinstance(value, bool))


def valid(value, schema):
    """Whether a value keeps the keywords of JSON schema that a scene's schema has."""
    if "$ref" in schema:
        schema = SCHEMA["$defs"][schema["$ref"].rpartition("/")[2]]
    names = schema.get("type", [])
    if names and not any(is_type(value, n) for n in ([names] if isinstance(names, str) else names)):
        return False
    for key in ("anyOf", "oneOf"):
        if key in schema and not any(valid(value, choice) for choice in schema[key]):
            return False
    if "const" in schema and value != schema["const"]:
        return False
    if "enum" in schema and value not in schema["enum"]:
        return False
    if isinstance(value, str):
        return re.search(schema.get("pattern", ""), value) is not None
    if isinstance(value, list):
        first = schema.get("prefixItems", [])
        rest = schema.get("items", {}) or {}
        parts = [*first, *[rest] * (len(value) - len(first))]
        length = schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value))
        return length and all(map(valid, value, parts))
    if isinstance(value, dict):
        known = schema.get("properties", {})
        closed = schema.get("additionalProperties") is False
        return (
            set(schema.get("required", [])) <= value.keys()
            and (not closed or value.keys() <= known.keys())
            and all(valid(item, known.get(key, {})) for key, item in value.items())
        )
    if is_type(value, "number"):
        return (
            value > schema.get("exclusiveMinimum", -1e999)
            and value >= schema.get("minimum", -1e999)
            and value < schema.get("exclusiveMaximum", 1e999)
            and value <= schema.get("maximum", 1e999)
        )
    return True


def is_valid(scene):
    return valid(scene, SCHEMA)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scenes_are_valid(path):
    assert is_valid(tomllib.loads(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize("text", LISTINGS)
def test_listings_are_valid(text):
    """Each alternative of the page in its turn."""
    assert is_valid(tomllib.loads(text))
    for line in re.findall(r"^# (\w+ = .*?)$", text, re.MULTILINE):
        assert is_valid(tomllib.loads(text.replace(f"# {line}", line))), line


@pytest.mark.parametrize(
    "line",
    [
        "[flow]\npresure_drop = 1",
        "[flow]\npressure_drop = '1'",
        "[flow]\npressure_drop = 0",
        "[flow]\npressure_drop = true",
        "[flow]\nsides = 'wal'",
        "[solid]\nyoungs_modulus = [1, 2, 3]",
        "[contact]\narea_fraction = '0.1'",
        "[surface]\nkind = 'fil'",
        "[surfaces]\nkind = 'file'",
    ],
)
def test_faults_are_seen(line):
    assert not is_valid(tomllib.loads(line))


def test_one_or_two_solids():
    for value in ("10 MPa", 1e7, ["10 MPa"], [1e7, "2 GPa"]):
        assert is_valid({"solid": {"youngs_modulus": value}})


def test_position_on_a_polar_grid():
    """Its second axis is an angle, whose unit depends on another field."""
    shape = {"kind": "rectangle", "length": "1 mm", "width": "1 mm", "mesh_size": "0.1 mm"}
    assert is_valid({"shape": shape | {"grid_origin": ["1 mm", "90 deg"]}})
    assert not is_valid({"shape": shape | {"grid_origin": ["1 mm"]}})


def test_command(capsys):
    assert cli.main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == SCHEMA
