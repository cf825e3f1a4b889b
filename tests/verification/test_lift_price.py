"""The settings of flow.lift side by side: their leak rates and their cost."""

import pytest
from project import write_toml

from fem_seal import cli
from fem_seal.errors import InvalidInput
from fem_seal.scene import Scene
from fem_seal.verification.trade import LIFTS, FlowMethod, Run, held_against_lift, lift_price

SCENE = {
    "surface": {
        **{"kind": "self-affine", "shape": [32, 32], "size": ["32 um", "32 um"], "hurst": 0.8},
        **{"long_wavelength": "16 um", "short_wavelength": "8 um", "rms_slope": 0.1, "seed": 1},
    },
    "solid": {"contact_modulus": "10 MPa"},
    "contact": {"pressure": "80 kPa"},
    "fluid": {"viscosity": "1 mPa s"},
    "flow": {"pressure_drop": "0.5 bar", "sides": "periodic", "rtol": 0.1},
}


def run(lift, rate, lower, upper, seconds):
    method, bounds = FlowMethod("adaptive", 0.1), (lower, upper)
    cost, gaps = (seconds, 0.1, 10**8), (1e-7, 1e-9)
    return Run((8, 8), method, lift, "leaking", rate, *bounds, True, *cost, *gaps)


def test_answers_are_held_against_the_resolved_one():
    """The larger of upper/Q and Q/lower; nothing of an open end, or of sealed beside leaking."""
    answers = [
        run("none", 1.0, 0.9, 1.1, 2.0),
        run("range", 1.0, 0.9, 50.0, 3.0),
        run("resolved", 10.0, 9.0, 11.0, 8.0),
    ]
    rows = held_against_lift(answers)
    assert [row.off for row in rows] == pytest.approx([10 / 0.9, 10 / 0.9, 10 / 9])
    assert [row.dry_runs for row in rows] == [1.0, 1.5, 4.0]
    answers[0] = run("none", 0.0, 0.0, 0.0, 2.0)
    answers[1] = run("range", 0.0, 0.0, None, 2.0)
    assert [row.off for row in held_against_lift(answers)] == pytest.approx([None, None, 10 / 9])
    assert held_against_lift([run(lift, 0.0, 0.0, 0.0, 1.0) for lift in LIFTS])[0].off == 1.0


def test_range_encloses_on_every_grid(tmp_path):
    """And what is there is not computed again."""
    scene = Scene.from_mapping(SCENE)
    rows = lift_price(scene, factors=(0.5, 0.75, 1), out=tmp_path)
    assert [(row.samples[0], row.lift) for row in rows] == [
        (n, lift) for n in (16, 24, 32) for lift in LIFTS
    ]
    for dry, ends, resolved in zip(*[iter(rows)] * 3, strict=True):
        assert dry.off > 1.5  # or nothing is shown
        assert ends.lower <= resolved.leak_rate <= ends.upper
        assert resolved.off < 1.2
        assert dry.seconds > 0
    assert lift_price(scene, factors=(0.5, 0.75, 1), out=tmp_path) == rows


def test_what_has_no_price():
    layer = SCENE | {"solid": SCENE["solid"] | {"layer_thickness": "5 um"}}
    with pytest.raises(InvalidInput, match="half-space"):
        lift_price(Scene.from_mapping(layer))
    plain = SCENE | {"flow": SCENE["flow"] | {"method": "finite-difference"}}
    with pytest.raises(InvalidInput, match="by their bounds"):
        lift_price(Scene.from_mapping(plain))


def test_parts_and_jobs_compute_the_table_together(tmp_path, capsys):
    """Each part computes its grids in two processes; --gather then writes both tables."""
    path = write_toml(tmp_path / "scene.toml", SCENE)
    out = tmp_path / "trade"
    command = ["study", "trade", str(path), "--lift", "--out", str(out)]
    assert cli.main([*command, "--part", "1/2", "--jobs", "2"]) == 0
    assert "not computed yet" in capsys.readouterr().out
    assert not (out / "trade-lift.csv").exists()
    assert cli.main([*command, "--part", "2/2", "--jobs", "2"]) == 0
    assert cli.main([*command, "--gather"]) == 0
    text = capsys.readouterr().out
    assert "the fluid's pressure:" in text
    table = (out / "trade-lift.csv").read_text().splitlines()
    assert len(table) == 1 + 3 * 3
    assert {"samples", "lift", "lower", "upper", "converged", "off"} < set(table[0].split(","))
