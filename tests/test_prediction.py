"""Time and memory before a scene is solved; how exact they are: tests/benchmarks/prediction.py."""

from math import inf

import numpy as np
import pytest
from project import ROOT, scene_of_samples, write_toml

from fem_seal import cli
from fem_seal.errors import InvalidInput
from fem_seal.patch import Patch
from fem_seal.points import Work
from fem_seal.prediction import OF_WAVES, predicted
from fem_seal.scene import Heights, Scene

SEAL = {"leak_path": "0.5 mm", "circumference": "0.1 m", "patches": 4}


def pressed(sections):
    """A dry contact under a pressure, its flow with bounds."""
    flow = {**sections["flow"], "method": "adaptive", "rtol": 0.2, "lift": "none"}
    return Scene.from_mapping(sections | {"contact": {"pressure": "0.2 MPa"}, "flow": flow})


def without_clock(monkeypatch):
    """The machine of the laws, so that predictions of two scenes compare."""
    monkeypatch.setattr("fem_seal.prediction._pace", lambda: 1.0)


def test_a_dry_run_solves_and_writes_nothing(small_scene, tmp_path, capsys, monkeypatch, here):
    path = write_toml(tmp_path / "scene.toml", small_scene)
    monkeypatch.setattr("fem_seal.patch.Patch.solve_film", None)
    for of_results in (["--json"], ["--out", "out"], ["--jobs", "3"]):
        assert cli.main(["run", str(path), "--dry-run", *of_results]) == 2
    capsys.readouterr()
    assert cli.main(["run", str(path), "--dry-run"]) == 0
    assert " s (" in (text := capsys.readouterr().out)
    assert "GB" in text
    assert [one.name for one in tmp_path.iterdir()] == ["scene.toml"]


@pytest.mark.parametrize("rows", [1, 2])
def test_a_map_of_one_or_two_rows(rows, small_scene, tmp_path, monkeypatch):
    """It has no second differences across its rows: no warning of NumPy, and a finite time."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    waves = np.tile(1e-7 * np.sin(np.arange(16)), (rows, 1))
    surface = Heights(waves, size=("1 um", "16 um"), periodic=True)
    assert 0 < predicted(pressed(small_scene | {"surface": surface})).seconds < inf


def test_more_work_takes_longer(small_scene, monkeypatch):
    """A finer grid, narrower bounds, the lift, tolerances, and patches over few processes."""
    without_clock(monkeypatch)
    base = pressed(small_scene)
    changes = [
        {"surface.shape": [2 * n for n in base.surface.shape]},
        {"flow.rtol": 0.1},
        {"flow.lift": "resolved"},
        {"tolerances.heights": "2 %"},
        {"output.products": [*base.output.products, "conductivity_tensor"]},
        {"contact.pressure": None, "contact.area_fraction": 0.2},
    ]
    for change in changes:
        assert predicted(base.with_(change)).seconds > predicted(base).seconds
    of_patch = {"flow.lift": None, "flow.rtol": None}
    seal = base.with_({"seal": SEAL, "output.products": ["seal"]} | of_patch)
    one, two = predicted(seal), predicted(seal, work=Work(2))
    assert two.parts["patches"] == pytest.approx(one.parts["patches"] / 2)
    # Of each worker as of one process; the one that waits for them has a contact, but no flow.
    waiting = two.memory - 2 * one.memory
    assert 0 < waiting < one.memory
    assert predicted(seal, work=Work(4)).memory == pytest.approx(4 * one.memory + waiting)
    assert predicted(seal.with_({"seal.patches": 8})).seconds > one.seconds
    same = {"youngs_modulus": seal.solid.contact_modulus, "poisson_ratio": 0.0}
    assert predicted(seal.with_({"solid": same})).seconds == pytest.approx(one.seconds)


def test_a_map_is_predicted_like_the_surface_that_it_shows(tmp_path, monkeypatch):
    """The heights alone tell the shortest wave; the law of the surface knows it.

    Differences of samples in place of derivatives miss (q d)²/24 of it, a tenth at 4 samples, and
    the time grows at most as the channels do, as its power OF_WAVES.
    """
    rel = OF_WAVES * (2 * np.pi / 4) ** 2 / 24
    without_clock(monkeypatch)
    scene = pressed(scene_of_samples(64))
    heights = Patch(scene).surface
    other = scene.with_({"surface": Heights(heights)})
    for change in ({}, {"accuracy.total": 0.2, "flow.rtol": None}):
        seconds = predicted(scene.with_(change)).seconds
        assert predicted(other.with_(change)).seconds == pytest.approx(seconds, rel=rel)


def test_long_runs_come_with_advice(small_scene, monkeypatch):
    without_clock(monkeypatch)
    monkeypatch.setattr("fem_seal.prediction.available_memory", lambda: 1e9)
    scene = Scene.from_mapping(small_scene)
    assert predicted(scene).advice == ""
    large = scene.with_({"surface.shape": (4096, 4096), "flow.method": "adaptive"})
    advice = predicted(large).advice
    assert all(way in advice for way in ("fewer samples", "flow.rtol"))
    # No way that the scene refuses.
    certain = large.with_({"accuracy.total": 0.1, "flow.rtol": None})
    assert "flow." not in predicted(certain).advice
    assert "accuracy.total" in predicted(certain).advice


def test_shapes_and_uniform_refinement_are_not_predicted(small_scene):
    with pytest.raises(InvalidInput, match="mesh"):
        predicted(Scene.from_file(ROOT / "demos/scenes/flange.toml"))
    scene = pressed(small_scene).with_({"flow.method": "uniform"})
    with pytest.raises(InvalidInput, match=r"flow\.max_unknowns, .* ends them"):
        predicted(scene)
    # Its contact alone is solved without a flow.
    predicted(scene.with_({"output.products": ["contact"]}))
