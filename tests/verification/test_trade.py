"""The price of accuracy: the split of the error, the Pareto front, the advice."""

import csv
import re
from dataclasses import replace
from pathlib import Path

import pytest
from project import AIR, scene_of_samples, write_toml

from fem_seal import cli, parallel
from fem_seal.errors import InvalidInput
from fem_seal.patch import Patch
from fem_seal.progress import silent
from fem_seal.scene import Scene
from fem_seal.verification.trade import (
    ContactGrid,
    FlowMethod,
    Run,
    Trade,
    TradePoint,
    recommend,
    trade,
    trade_of,
)


def point(seconds, contact, flow, method="adaptive", samples=(8, 8)):
    bounds = (None, None) if method == "finite-difference" else (0.9, 1.1)
    flow_method, errors = FlowMethod(method, None), (contact, flow, contact + flow)
    return TradePoint(
        *(samples, flow_method, "leaking", 1.0, *bounds, True, seconds, 0.1, 10**8),
        *(1e-7, 1e-9, None),
        *errors,
    )


@pytest.fixture(scope="module")
def traded():
    """A smooth wavy surface of 16 waves of 4 samples, far from percolation."""
    scene = scene_of_samples(32, short_wavelength="8 um") | {
        "contact": {"pressure": "50 kPa"},
        "flow": {"pressure_drop": "1 bar", "sides": "periodic"},
    }
    return trade(Scene.from_mapping(scene), factors=(0.5, 1, 2), tolerances=(0.2, 0.05))


def test_flow_part_is_the_bracket_and_obeys_the_tolerance(traded):
    """(upper - lower) / √(lower upper) <= rtol is a half-width of rtol/2 at most."""
    for p in traded.points:
        assert p.total_error == pytest.approx(p.contact_error + p.flow_error)
        if p.flow.method == "adaptive":
            assert p.flow_error <= p.flow.rtol / 2
            assert p.flow_error == pytest.approx((p.upper - p.lower) / (p.upper + p.lower))


def test_without_bounds_the_flow_part_counts_those_of_the_best_answer():
    """The leak rate lies anywhere in the narrowest bracket, here 1 % to either side."""
    best, finest = run(16, 1.0, 0.04), run(32, 1.0, 0.01)
    for rate, error in ((1.0, 0.01), (1.03, 0.04), (0.98, 0.03)):
        flow = FlowMethod("finite-difference", None)
        own = replace(best, flow=flow, leak_rate=rate, lower=None, upper=None)
        assert trade_of([own, best, finest]).points[0].flow_error == pytest.approx(error)


def test_contact_part_is_shared_by_all_flows_on_a_grid_and_falls(traded):
    parts = {}
    for p in traded.points:
        parts.setdefault(p.samples, set()).add(p.contact_error)
    assert all(len(shared) == 1 for shared in parts.values())
    coarse, *_, fine = (shared.pop() for shared in parts.values())
    assert fine < coarse
    # What the coarsest grid may err: its distance from the finest, and what that may err itself.
    away = abs(next(p.leak_rate for p in traded.points if p.flow.rtol == 0.05) - traded.reference)
    assert (fine, coarse) == pytest.approx(
        (traded.uncertainty, away / traded.reference + traded.uncertainty)
    )


def test_a_contact_grid_reports_its_stages_wherever_it_is_computed(small_scene, monkeypatch):
    """Also where the system keeps no largest memory that can be reset."""

    def refuse(path, text):
        raise PermissionError(f"{path} is read-only")

    monkeypatch.setattr(Path, "write_text", refuse)
    scene, flows = Scene.from_mapping(small_scene), (FlowMethod("finite-difference", None),)
    stages = []
    grid = ContactGrid("grid", "grid", scene, (32, 32), flows)
    (run,) = grid.compute(lambda stage, _: stages.append(stage), parallel.alone())
    assert run.state == "leaking"
    assert "contact" in stages


def test_links_are_read_by_finite_differences_alone(small_scene):
    """By another rule of links these change; finite elements, which have none, give the same."""
    flow = {**small_scene["flow"], "method": "finite-difference"}
    methods = FlowMethod("finite-difference", None), FlowMethod("adaptive", 0.1)
    (usual, adaptive), (harmonic, same) = (
        ContactGrid(
            "grid",
            "grid",
            Scene.from_mapping(small_scene | {"flow": flow | links}),
            (32, 32),
            methods,
        ).compute(silent, None)
        for links in ({}, {"links": "harmonic"})
    )
    assert harmonic.leak_rate < usual.leak_rate
    assert same.leak_rate == adaptive.leak_rate


def test_front():
    """Beaten is who is dearer and worse; the two kinds are not compared with each other."""
    points = (
        point(1, 0.1, 0.2),
        point(2, 0.1, 0.3),
        point(3, 0.1, 0.05),
        point(0.5, 0.1, 0.01, "finite-difference"),
    )
    result = Trade(points, 1.0, 0.01)
    assert result.front(certified=True) == (points[0], points[2])
    assert result.front(certified=False) == (points[3],)


def test_recommendation():
    """The cheapest point that keeps the error, the one with bounds first; or what is missing."""
    cheap = point(0.5, 0.1, 0.01, "finite-difference")
    points = (point(1, 0.1, 0.2), point(3, 0.1, 0.05), cheap)
    half, fifth, tenth, *_ = recommend(Trade(points, 1.0, 0.01))
    assert half.startswith("for 50 %: contact on 8 x 8, adaptive: about 1 s and 100 MB")
    assert "without bounds of its own" in half
    assert fifth.startswith("for 20 %: contact on 8 x 8, adaptive: about 3 s")
    assert "no setting tried is that accurate" in tenth
    assert "contact grid 10 %, flow 1 %" in tenth
    _, only, *_ = recommend(Trade((cheap,), 1.0, 0.01))
    assert only.startswith("for 20 %: only without bounds")
    best = replace(cheap, lower=0.9, upper=1.1)
    assert "without bounds" not in recommend(Trade((best,), 1.0, 0.01))[1]


def test_no_recommendation_before_the_grids_converge():
    """The least of errors above 100 % may be that of a coarse grid that happens to be sealed."""
    (text,) = recommend(Trade((point(1, 7.3, 0.1),), 1.0, 7.3))
    assert text.startswith("nothing to recommend")
    assert "730 %" in text


def run(n, leak_rate, unresolved):
    """A run on n² samples of a channel whose gap is 1."""
    state, gap = ("leaking", 1.0) if leak_rate else ("sealed", 0.0)
    flow, bounds = FlowMethod("adaptive", 0.1), (0.99 * leak_rate, 1.01 * leak_rate)
    cost = (True, 1.0, 0.1, 10**8)
    return Run((n, n), flow, state, leak_rate, *bounds, *cost, gap, unresolved, None)


def test_a_sealed_grid_is_left_out():
    """It neither stands in the table nor changes what is said of the finest grid."""
    finer = [run(16, 1.1, 0.04), run(32, 1.0, 0.01)]
    series = trade_of([run(8, 0.0, 0.16), *finer])
    assert {p.samples[0] for p in series.points} == {16, 32}
    assert series.sealed == ((8, 8),)
    assert series.uncertainty == trade_of([run(8, 1.5, 0.16), *finer]).uncertainty < 0.1
    assert recommend(series)[0].startswith("contact on 8 x 8 is left out: it is sealed")


def test_what_cannot_be_traded(small_scene, tmp_path):
    scene = Scene.from_mapping(small_scene)
    with pytest.raises(InvalidInput, match="three contact grids"):
        trade(scene, factors=(0.3, 1))
    pressed = small_scene | {"contact": {"area_fraction": 0.9}}
    with pytest.raises(InvalidInput, match="sealed"):
        trade(Scene.from_mapping(pressed), factors=(0.25, 0.5, 1), tolerances=(0.5,))


@pytest.fixture
def gas_scene():
    """A scene of 16² samples under a gas, which slips and lifts."""
    flow = {"inlet_pressure": "1.1 bar", "outlet_pressure": "1 bar", "sides": "periodic"}
    return scene_of_samples(16) | {"fluid": AIR, "flow": flow, "contact": {"pressure": "0.1 MPa"}}


def test_commands_write_what_they_say(gas_scene, tmp_path, capsys):
    """A part of a study leaves the table to the same command without it."""
    path = write_toml(tmp_path / "gas.toml", gas_scene)
    study = ["study", "trade", str(path), "--set", "fluid.slip=false"]
    study += ["--out", str(tmp_path / "trade")]
    assert cli.main([*study, "--part", "1/2"]) == 0
    assert "not computed yet" in capsys.readouterr().out
    assert not (tmp_path / "trade" / "trade.csv").exists()
    assert cli.main(study) == 0
    text = capsys.readouterr().out
    assert (tmp_path / "trade" / "advice.txt").read_text().strip() in text
    # What `fem-seal run` counts and the study leaves out.
    assert "flow.lift = 'none'" in text
    assert "fluid.slip" not in text
    rows = list(csv.DictReader((tmp_path / "trade" / "trade.csv").read_text().splitlines()))
    assert {"finite-difference", "adaptive, rtol 0.1"} <= {row["flow"] for row in rows}
    assert len(rows) == 3 * 5
    assert sorted(p.name for p in (tmp_path / "trade").iterdir()) == [
        "advice.txt",
        "points",
        "trade.csv",
        "trade.png",
    ]
    out = str(tmp_path / "exact")
    assert cli.main(["study", "exact", "cosine-along", "--grids", "1", "--out", out]) == 0
    assert "exactly 1.54" in capsys.readouterr().out
    assert cli.main(["study", "exact", "sine", "--out", out]) == 2
    occupied = tmp_path / "file"
    occupied.touch()
    assert cli.main(["study", "exact", "cosine-along", "--out", str(occupied)]) == 2
    assert "cannot be written" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        cli.main(["study", "exact", "--grids", "0", "--out", out])


def test_cross_validation_leaves_slip_out(gas_scene, tmp_path, capsys):
    """Which `fem-seal run` counts; the guaranteed bracket is that without slip. Sealed gaps go."""
    path, out = write_toml(tmp_path / "scene.toml", gas_scene), tmp_path / "cross"
    study = ["study", "cross-validation", str(path), "--grids", "1", "--set", "flow.lift=none"]
    study += ["--vary", "contact.pressure=0.1 MPa,5 MPa"]
    # Said also where the last gap has none.
    study += ["--vary", "fluid.slip=first-order,false"]
    study += ["--out", str(out)]
    assert cli.main([*study, "--part", "3/3"]) == 0
    assert "not computed yet" in capsys.readouterr().out
    assert cli.main(study) == 0
    text = capsys.readouterr().out
    (slip,) = (line for line in text.splitlines() if line.startswith("no slip"))
    assert "fluid.slip = false" in slip
    assert max(len(line) for line in text.splitlines() if line != slip) <= 100
    assert text.count("sealed, where every method says 0") == 2
    plain = Patch(Scene.from_file(path, ["fluid.slip=false", "flow.lift=none"])).leak_rate
    brackets = re.findall(r"guaranteed: \[(.*), (.*)\]", text)
    assert len(brackets) == 2
    for low, high in brackets:  # printed to 5 digits
        assert max(float(low), plain.lower) <= min(float(high), plain.upper) * (1 + 1e-4)
    names = {p.name for p in out.iterdir()}
    assert names == {"points", "cross_validation.csv", "cross_validation.png"}
    with (out / "cross_validation.csv").open(newline="") as file:
        gaps = {row["gap"] for row in csv.DictReader(file)}
    leaking = "contact.pressure=0.1 MPa, fluid.slip="
    assert gaps == {leaking + "first-order", leaking + "false"}
