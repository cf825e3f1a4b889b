"""Sweeps: rows are those of single runs, done points are kept, another sweep is refused."""

import json
from math import inf
from pathlib import Path

import numpy as np
import pytest
from project import rows, write_toml

from fem_seal import cli
from fem_seal.errors import InvalidInput
from fem_seal.files import locked_folder, to_disk
from fem_seal.results.result import Provenance
from fem_seal.scene import Scene
from fem_seal.scene_steps import FLOWS
from fem_seal.solved import solve
from fem_seal.sweep import combinations, sweep
from fem_seal.sweep.point import UNSETTLED, Point
from fem_seal.sweep.store import SweepFolder

LEFT = {"points", "sweep.csv", "sweep.json"}


pytestmark = pytest.mark.usefixtures("scene_file")


def run(*arguments):
    return cli.main(["sweep", "scene.toml", *arguments])


def test_an_infinite_end_survives_its_file(tmp_path):
    """The upper end of a film that may lift off; null in its place would mean "not known"."""
    folder = SweepFolder(tmp_path / "sweep", ("flow.rtol",))
    folder.save("a" * 32, Point(("0.1",), False, "", together_lower=1e-12, together_upper=inf))
    read = SweepFolder(tmp_path / "sweep", ("flow.rtol",)).point("a" * 32)
    assert read.together_upper == inf


def test_of_two_sweeps_that_begin_at_once_one_is_refused(scene_file, monkeypatch):
    """The other one writes its scene while that of this one is on its way to the disk."""
    ours, others = (SweepFolder(Path(), (key,)) for key in ("flow.rtol", "surface.seed"))
    origin = Provenance.of(Scene.from_file(scene_file))

    def overtaken(path):
        monkeypatch.setattr("fem_seal.files.atomic.to_disk", to_disk)
        others.open(origin)
        to_disk(path)

    monkeypatch.setattr("fem_seal.files.atomic.to_disk", overtaken)
    with pytest.raises(InvalidInput, match="of other fields"):
        ours.open(origin)


@pytest.mark.parametrize(
    ("fields", "shared"),
    [
        (("contact.area_fraction=0.05,0.15", "flow.links=arithmetic,harmonic"), ()),
        (("contact.pressure=0.1 MPa,0.11 MPa,0.12 MPa",), ("contact.area_fraction=",)),
        (("surface.size=['100 um', '100 um'],['100.0000001 um', '100.0000001 um']",), ()),
    ],
)
def test_rows_are_those_of_single_runs(scene_file, tmp_path, fields, shared):
    """To the last digit, whatever was computed before."""
    points, own = combinations(*fields), {"seconds": 0, "peak_memory_bytes": 0}
    shared = *shared, 'output.products=["leak_rate", "trapped_volume", "hydraulic_aperture"]'
    tally = sweep(scene_file, points, tmp_path / "out", overrides=shared)
    assert [point.values for point in tally.table] == points[1]
    for point in tally.table:
        values = map("{}={}".format, points[0], point.values)
        alone = solve(Scene.from_file(scene_file, [*shared, *values])).result()
        assert point.row | own == Point.of(point.values, alone).row | own


def test_interrupted_sweep_goes_on(tmp_path, monkeypatch, capsys):
    solve, solves = FLOWS["finite-difference"], []

    def third_is_interrupted(settings, gap, report, comm):
        if gap.gap.shape == (32, 32):  # and not the coarser grid of the entry "contact grid"
            solves.append(gap.contact_area_fraction)
            if len(solves) == 3:
                raise KeyboardInterrupt
        return solve(settings, gap, report, comm)

    monkeypatch.setitem(FLOWS, "finite-difference", third_is_interrupted)
    vary = ("--vary", "contact.area_fraction=0.05,0.1,0.15,0.2", "--out", "out")
    assert run(*vary) == 130
    assert "points that are done stay: the same command goes on" in capsys.readouterr().err
    assert len(rows(tmp_path / "out")) == 2
    assert run(*vary) == 0
    # Areas are reached to 1 part in 1000 or half a sample of 1024.
    assert solves == pytest.approx([0.05, 0.1, 0.15, 0.15, 0.2], abs=0.6 / 1024)
    assert [row["contact.area_fraction"] for row in rows(tmp_path / "out")] == [
        *("0.05", "0.1", "0.15", "0.2")
    ]
    *points, tally = capsys.readouterr().out.splitlines()
    assert tally.startswith("4 points, 2 of them computed now")
    assert all(" m^3/s, " in line and line.endswith("% in contact") for line in points)
    assert {path.name for path in (tmp_path / "out").iterdir()} == LEFT


def test_another_sweep_is_refused(tmp_path, capsys):
    assert run("--vary", "contact.area_fraction=0.1", "--out", "out") == 0
    before = (tmp_path / "out" / "sweep.csv").read_text()
    assert run("--vary", "flow.rtol=0.1", "--out", "out") == 2
    assert (
        run("--vary", "contact.area_fraction=0.1", "--set", "surface.seed=2", "--out", "out") == 2
    )
    assert (tmp_path / "out" / "sweep.csv").read_text() == before
    assert run("--vary", "flow.rtol=0.1", "--out", "out", "--overwrite") == 0
    assert next(iter(rows(tmp_path / "out")[0])) == "flow.rtol"


def test_another_value_of_a_field_in_a_field_is_the_same_sweep():
    """Nothing is computed: all is left to other parts, and status 3 says so."""
    rest = ("--set", "flow.method=adaptive", "--set", "flow.links=", "--gather", "--out", "out")
    assert run("--vary", "tolerances.fluid.viscosity=5 %,10 %", *rest) == 3
    assert run("--vary", "tolerances.fluid.viscosity=20 %", *rest) == 3
    assert run("--vary", "tolerances.heights=20 %", *rest) == 2


def test_a_field_of_some_points_only(tmp_path, capsys):
    """The message names a point that has no use for it and the remedy, which works."""
    assert run("--vary", "contact.model=gfmd,bearing", "--set", "contact.tolerance=1e-5") == 2
    refusal = capsys.readouterr().err
    assert "1 of 2 points cannot be computed, such as contact.model=bearing: " in refusal
    (tmp_path / "table.csv").write_text("contact.model, contact.tolerance\ngfmd, 1e-5\nbearing,\n")
    assert run("--points", "table.csv", "--out", "out") == 0
    pairs = [(row["contact.model"], row["contact.tolerance"]) for row in rows(tmp_path / "out")]
    assert pairs == [("gfmd", "1e-5"), ("bearing", "")]


def test_damaged_sweep(tmp_path):
    vary = ("--vary", "contact.area_fraction=0.1,0.2", "--out", "out")
    assert run(*vary) == 0
    before = rows(tmp_path / "out")
    (tmp_path / "out" / "sweep.json").write_text("")
    assert run(*vary) == 2
    assert run(*vary, "--overwrite") == 0
    # The table is made from the points; one that is damaged is computed again.
    (tmp_path / "out" / "sweep.csv").write_text("")
    file = next((tmp_path / "out" / "points").iterdir())
    whole = json.loads(file.read_text())
    lacking = {"values": ["0.1"]}, whole | {"contact_area_fraction": None}
    for damaged in (*lacking, whole | {"leak_rate": 1e305}):
        file.write_text(json.dumps(damaged))
        assert run(*vary) == 0
        assert rows(tmp_path / "out") == before


def test_damaged_and_changed_input_files(small_scene, tmp_path, capsys):
    """A damaged one has a row; the others are computed, and it is tried again once it is whole."""
    heights = np.random.default_rng(1).normal(0, 1e-7, (16, 16))
    for name in "abc":
        np.savez(f"{name}.npz", heights=heights, spacing=[1e-6, 1e-6])
    whole = Path("b.npz").read_bytes()
    Path("b.npz").write_bytes(whole[:100])
    small_scene["surface"] = {"kind": "file", "path": "a.npz"}
    small_scene["flow"]["sides"] = "wall"
    write_toml(tmp_path / "scene.toml", small_scene)
    vary = ("--vary", "surface.path=a.npz,b.npz,c.npz", "--out", "out")
    assert run(*vary) == 3
    assert "1 of 3 points failed" in capsys.readouterr().err
    first, damaged, last = rows(tmp_path / "out")
    assert (damaged["converged"], damaged["leak_rate"]) == ("False", "")
    assert "b.npz" in damaged["reason"]
    assert first["leak_rate"] == last["leak_rate"] != ""
    Path("b.npz").write_bytes(whole)
    assert run(*vary) == 0
    assert "1 of them computed now" in capsys.readouterr().out
    assert [row["leak_rate"] for row in rows(tmp_path / "out")] == 3 * [first["leak_rate"]]
    # A file that has changed is another point; wider gaps leak more.
    np.savez("a.npz", heights=2 * heights, spacing=[1e-6, 1e-6])
    assert run(*vary) == 0
    assert "1 of them computed now" in capsys.readouterr().out
    assert float(rows(tmp_path / "out")[0]["leak_rate"]) > float(first["leak_rate"])
    # It is the same sweep, whichever of the files comes first.
    assert run("--vary", "surface.path=c.npz,a.npz", "--out", "out") == 0
    assert "0 of them computed now" in capsys.readouterr().out


def test_a_run_does_not_go_into_the_folder_of_a_sweep(tmp_path, capsys):
    with locked_folder(tmp_path / "out", shared=True):
        assert cli.main(["run", "scene.toml", "--out", "out"]) == 2
        assert run("--vary", "flow.rtol=0.1", "--out", "out", "--overwrite") == 2
        assert capsys.readouterr().err.count("is in use by another process") == 2
        assert run("--vary", "flow.rtol=0.1", "--out", "out") == 0


def test_decisions_of_a_sweep(tmp_path):
    """Which limits the seal keeps can be read off the table; without one it just leaks."""
    options = ("--set", "flow.method=adaptive", "--set", "flow.rtol=1")
    assert run(*options, "--vary", "limit.leak_rate=1e-20 ml/h,1 l/min", "--out", "out") == 0
    assert [row["decision"] for row in rows(tmp_path / "out")] == ["above limit", "within limit"]
    assert run("--vary", "flow.links=arithmetic", "--out", "plain") == 0
    assert [row["decision"] for row in rows(tmp_path / "plain")] == ["leaking"]


def test_an_unsettled_point_has_a_range_and_no_leak_rate(small_scene):
    """The last pass of contact and flow that have not settled is not the point's leak rate."""
    small_scene["contact"] = {"pressure": "0.15 MPa"}
    small_scene["flow"] |= {"method": "adaptive", "rtol": 0.5}
    result = solve(Scene.from_mapping(small_scene)).result()
    settled = Point.of((), result)
    assert settled.state == "leaking"
    assert settled.lower < settled.leak_rate < settled.upper
    moving = result.model_copy(update={"lift": result.lift.model_copy(update={"settled": False})})
    point = Point.of((), moving)
    assert point.state == UNSETTLED
    assert (point.leak_rate, point.lower, point.upper) == (None, None, None)
    assert point.together_upper == result.headline.upper


def test_equal_points_are_one(tmp_path, capsys):
    """The same pressure in two units is one point, also for a later sweep in other words."""
    options = ("--set", "contact.area_fraction=", "--out", "o", "--vary")
    assert run(*options, "contact.pressure=0.1MPa,1e5") == 0
    said = capsys.readouterr().out
    assert "contact.pressure=1e5 is the same scene as contact.pressure=0.1MPa" in said
    assert "1 points, 1 of them computed now" in said
    assert [row["contact.pressure"] for row in rows(tmp_path / "o")] == ["0.1MPa"]
    assert run(*options, "contact.pressure=100kPa") == 0
    assert "1 points, 0 of them computed now" in capsys.readouterr().out
    # The words are those of the last sweep, or its summary would not count all of its seeds.
    assert [row["contact.pressure"] for row in rows(tmp_path / "o")] == ["100kPa"]
    options = ("--set", "contact.area_fraction=", "--out", "s", "--vary")
    assert run(*options, "contact.pressure=0.1MPa", "--vary", "surface.seed=1") == 0
    assert run(*options, "contact.pressure=100kPa", "--vary", "surface.seed=1..2") == 0
    summary = (tmp_path / "s" / "summary.csv").read_text().splitlines()
    assert [line.split(",")[:2] for line in summary[1:]] == [["100kPa", "2"]]
