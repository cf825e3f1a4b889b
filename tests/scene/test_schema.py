"""fem-seal schema: scenes that are accepted are valid by it, and what it refuses is refused."""

import json
import tomllib

import pytest
from jsonschema import Draft202012Validator
from project import ROOT

from fem_seal import cli
from fem_seal.scene.schema import scene_schema

SCHEMA = scene_schema()
SCENES = sorted((ROOT / "demos" / "scenes").glob("*.toml"))
is_valid = Draft202012Validator(SCHEMA).is_valid


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scenes_are_valid(path):
    assert is_valid(tomllib.loads(path.read_text(encoding="utf-8")))


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
