"""A .geo file from elsewhere is a program: it runs only if the user trusts it."""

import shutil
import signal
import time
from pathlib import Path
from typing import get_args

import pytest
from mesh_files import scene_of
from project import ROOT, alone, started, write_toml

from fem_seal import run
from fem_seal.cli import main
from fem_seal.drawing import draw
from fem_seal.errors import InvalidInput
from fem_seal.mesh import geometry
from fem_seal.mesh.files import GroupNames
from fem_seal.mesh.geometry import SOURCES, mesh_geometry
from fem_seal.scene import Scene
from fem_seal.scene.shape import FaceSeal, PlateWithHoles, Rectangle, Sector, Strip

STRIP = (ROOT / "meshes" / "strip.geo").read_text()


def hostile(path, mark):
    """Geometry that leaves a mark in each way by which gmsh writes or starts what it is told to."""
    path.write_text(
        f'{STRIP}\nSystemCall "touch {mark}-call";\nPrintf("x") > "{mark}-print";\n'
        f'Mesh 2;\nSave "{mark}-save.msh";\n'
    )
    return path


@pytest.fixture
def folder(tmp_path, here):
    hostile(tmp_path / "stranger.geo", tmp_path / "mark")
    data = scene_of(tmp_path / "stranger.geo", gap=1e-6)
    write_toml(tmp_path / "scene.toml", data)
    return tmp_path


def marks(folder):
    return sorted(path.name for path in folder.glob("mark*"))


def command(name, folder):
    """Command line that meshes the scene."""
    vary = ["--vary", "shape.gap=1e-6,2e-6"] if name == "sweep" else []
    return [name, str(folder / "scene.toml"), "--out", str(folder / "out"), *vary]


@pytest.mark.parametrize("name", ["run", "mesh", "sweep"])
def test_a_strangers_geometry_is_not_run(name, folder, refused):
    """Nothing is run and nothing written."""
    error = refused(*command(name, folder))
    assert "stranger.geo is a program that gmsh would run with your rights" in error
    assert "--trust" in error


def test_no_word_of_the_scene_is_trust(folder, refused):
    for place in ("shape.trust", "trust.geo", "flow.trust"):
        assert "is not a known key" in refused(*command("run", folder), "--set", f"{place}=true")


@pytest.mark.parametrize("name", ["mesh", "sweep"])
def test_with_trust_it_runs(name, folder, monkeypatch):
    """All three marks are made, which shows that the tests above would see them.

    Pictures of a mesh: scene/test_shapes.py.
    """
    monkeypatch.setattr("fem_seal.drawing.draw_pictures", lambda *_: None)
    assert main([*command(name, folder), "--trust"]) == 0
    assert marks(folder) == ["mark-call", "mark-print", "mark-save.msh"]


def test_trust_in_python(folder):
    scene = Scene.from_file(folder / "scene.toml")
    with pytest.raises(InvalidInput, match="trust=True"):
        run(scene, folder / "out")


def test_drawing_a_received_result_runs_nothing(folder, capsys):
    """Its geometry is a stranger's by now, or is not there any more; mesh.vtu is enough.

    Without that it is not meshed again.
    """
    (folder / "stranger.geo").write_text(STRIP)
    products = ["--set", 'output.products=["leak_rate", "mesh", "pictures"]']
    assert main([*command("run", folder), "--trust", *products]) == 0
    names, out = ("shape.png", "gap.png", "flow.png"), folder / "out"
    as_solved = [(out / name).read_bytes() for name in names]
    hostile(folder / "stranger.geo", folder / "mark")
    assert set(draw(out)) == set(names)
    assert [(out / name).read_bytes() for name in names] == as_solved
    (folder / "stranger.geo").unlink()
    assert main(["report", str(out)]) == 0
    (out / "mesh.vtu").unlink()
    hostile(folder / "stranger.geo", folder / "mark")
    assert main(["render", str(out)]) == 2
    assert "mesh.vtu" in capsys.readouterr().err
    assert marks(folder) == []


def test_own_geometry_is_known_by_its_content(tmp_path):
    """Wherever a copy lies and whatever it is called; one more character makes it a stranger's."""
    copy = tmp_path / "copy.geo"
    shutil.copy(ROOT / "meshes" / "flange.geo", copy)
    assert len(mesh_geometry(copy, {}, 1e-3, GroupNames()).cells) > 100
    copy.write_text(copy.read_text() + "\n")
    with pytest.raises(InvalidInput, match="is a program"):
        mesh_geometry(copy, {}, 1e-3, GroupNames())


def test_geometries_of_the_package_are_those_of_meshes():
    """The package reads them through a link, which a wheel and an sdist hold as files."""
    names = {path.name for path in SOURCES.glob("*.geo")}
    assert names == {path.name for path in (ROOT / "meshes").glob("*.geo")}
    shapes = Rectangle, Strip, FaceSeal, Sector, PlateWithHoles
    kinds = [get_args(shape.model_fields["kind"].annotation)[0] for shape in shapes]
    assert {f"{kind}.geo" for kind in kinds} <= names


def test_path_that_is_itself_a_program(tmp_path):
    """A quote in the name of a file ends no string of another geometry."""
    mark = tmp_path / "mark"
    inner = f'x"; SystemCall "touch mark"; Include "{ROOT.name}'
    geo = tmp_path / f"{inner}.geo".replace("/", "-")
    geo.write_text(STRIP + "// a stranger's\n")
    assert len(mesh_geometry(geo, {}, 1.0, GroupNames(), trust=True).cells) > 10
    geo.write_text(STRIP)
    assert len(mesh_geometry(geo, {}, 1.0, GroupNames()).cells) > 10
    assert not mark.exists()


def test_geometry_without_end(tmp_path, monkeypatch):
    monkeypatch.setattr(geometry, "LONGEST", 1.0)
    geo = tmp_path / "endless.geo"
    geo.write_text("x = 0;\nFor i In {0:1000000000000}\n  x = x + 1;\nEndFor\n")
    with pytest.raises(InvalidInput, match=r"endless.geo within 1 s; mesh it in gmsh"):
        mesh_geometry(geo, {}, 1.0, GroupNames(), trust=True)


def test_geometry_that_kills_gmsh(tmp_path):
    geo = tmp_path / "fatal.geo"
    geo.write_text('SystemCall "kill -SEGV $PPID";\n')
    with pytest.raises(InvalidInput, match=r"crashed on .*fatal.geo \(signal 11\)"):
        mesh_geometry(geo, {}, 1.0, GroupNames(), trust=True)


def test_interrupted_within_gmsh(folder):
    """Status 130, one sentence, and nothing left: no process, no temporary folder, no result.

    Ctrl-C takes the same way: test_files.py.
    """
    scratch, begun = folder / "scratch", folder / "begun"
    scratch.mkdir()
    (folder / "stranger.geo").write_text(
        f'SystemCall "echo $$ > {begun}.part; mv {begun}.part {begun}; exec sleep 600";\n'
    )
    environment = alone() | {"TMPDIR": str(scratch), "PYTHONPATH": str(ROOT)}
    arguments = "-m", "fem_seal", *command("mesh", folder), "--trust"
    with started(*arguments, env=environment) as process:
        deadline = time.monotonic() + 60
        while not begun.exists():
            assert time.monotonic() < deadline
            assert process.poll() is None
            time.sleep(0.05)
        process.send_signal(signal.SIGTERM)
        message = process.communicate(timeout=60)[1]
    assert process.returncode == 130
    assert message.splitlines() == ["fem-seal: interrupted; nothing half-written is left"]
    assert list(scratch.iterdir()) == []
    assert not (folder / "out").exists()
    sleeper = int(begun.read_text())
    while alive(sleeper):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def alive(number):
    """Whether a process runs, and is not just waiting for somebody to take note of its end."""
    try:
        status = Path(f"/proc/{number}/stat").read_text()
    except OSError:
        return False
    return status.rsplit(")", 1)[1].split()[0] != "Z"
