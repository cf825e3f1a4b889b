"""Only what the scene requires: what each kind of scene imports, solves and allocates."""

import json
import tracemalloc

import numpy as np
import pytest
from project import ROOT, leak_rate, printed_by
from sample_gaps import FLUID

from fem_seal.errors import MissingPackage
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.products import require_packages
from fem_seal.scene import Scene

DRAWING = {"pyvista", "vtkmodules", "matplotlib"}
FFT = {"pyfftw"}
HEAVY = {"dolfinx", "ufl", "basix", "ffcx", "petsc4py"} | DRAWING | FFT
# What only a [shape] needs: gmsh and the modules that read, check and cut meshes.
OF_SHAPES = {"gmsh", "meshio", "fem_seal.expression", "fem_seal.render.shape"}
OF_SHAPES |= {
    f"fem_seal.mesh.{part}"
    for part in ("checks", "cut", "files", "gap_source", "geometry", "shape")
}

RUN = """
import json, sys
from fem_seal.scene import Scene
from fem_seal.solved import solve
for scene in json.loads(sys.argv[1]):
    solved = solve(Scene.from_mapping(scene))
    result = solved.result()
    print(json.dumps([result.state, result.unknowns, list(sys.modules)]))
from fem_seal.render import contact_picture, gap_picture
contact_picture(solved.patch.film, "contact.png"), gap_picture(solved.patch.film, "gap.png")
print(json.dumps(["drawn", 0, list(sys.modules)]))
"""


def run(folder, *scenes):
    """State, unknowns and packages loaded by scenes one after the other in a process.

    At last it draws the contact and the gap of the last one.
    """
    before = set()
    for line in printed_by("-c", RUN, json.dumps(scenes), cwd=folder).splitlines():
        state, unknowns, modules = json.loads(line)
        loaded = {name.partition(".")[0] for name in modules} & HEAVY
        assert not OF_SHAPES & set(modules)
        yield state, unknowns, loaded - before
        before |= loaded


@pytest.fixture
def gap_scene(scene_of_gap, tmp_path):
    """A gap from a file with an open channel, or shut by a row of contact."""

    def scene(method, shut=False):
        gap = np.ones((9, 9)) * 1e-6
        gap[4] *= not shut
        sections = scene_of_gap(gap, flow={"pressure_drop": 1e5, "method": method})
        path = (tmp_path / "gap.npz").rename(tmp_path / f"{shut}.npz")
        return sections | {"gap": {"path": str(path)}}

    return scene


def test_each_scene_loads_what_it_needs(small_scene, gap_scene, tmp_path):
    """Sealed gaps and cuts nothing, a contact its transforms, and no flow on a grid more.

    Pictures of a grid need no OpenGL: they are drawn where no such library is installed.
    """
    contact = small_scene | {"output": {"products": ["contact"]}, "flow": {}}
    cut = contact | {"contact": {"model": "bearing", "area_fraction": 0.1}}
    methods = ("adaptive", "uniform", "finite-difference")
    sealed = [gap_scene(method, shut=True) for method in methods]
    gaps = gap_scene("finite-difference"), gap_scene("adaptive")
    scenes = (cut, *sealed, gaps[0], contact, small_scene, gaps[1])
    of_cut, *of_sealed, of_gap, of_contact, of_flow, adaptive, drawn = run(tmp_path, *scenes)
    assert of_cut == ("leaking", 0, set())
    assert of_sealed == [("sealed", 0, set())] * 3
    assert (of_gap[0], of_gap[2]) == ("leaking", set())
    assert of_contact == ("leaking", 0, FFT)
    assert (of_flow[0], of_flow[2]) == ("leaking", set())
    assert 0 < of_flow[1] < 32 * 33
    assert adaptive[0] == "leaking"
    assert adaptive[1] > 0
    assert "dolfinx" in adaptive[2]
    assert not adaptive[2] & DRAWING
    assert drawn[2] == {"matplotlib"}
    assert all((tmp_path / f"{name}.png").stat().st_size > 1000 for name in ("contact", "gap"))


def test_other_methods_are_sought_only_where_fenicsx_is_missing(gap_scene, monkeypatch):
    scene = Scene.from_mapping(gap_scene("adaptive"))
    with monkeypatch.context() as patched:
        patched.setattr(Scene, "takes", None)
        require_packages(scene)
    for module in ("products", "installed"):
        monkeypatch.setattr(f"fem_seal.{module}.find_spec", lambda name: None)
    with pytest.raises(MissingPackage, match="'finite-difference' works without"):
        require_packages(scene)


def test_pictures_of_a_seal_need_no_opengl(monkeypatch):
    """They show no flow: `draw_patch` has none but that of a leak rate of a patch."""

    def refuse():
        raise MissingPackage("no OpenGL")

    monkeypatch.setattr("fem_seal.render.offscreen.require_gl", refuse)
    scenes = ROOT / "demos" / "scenes"
    require_packages(Scene.from_file(scenes / "o-ring.toml"), pictures=True)
    with pytest.raises(MissingPackage, match="no OpenGL"):
        require_packages(Scene.from_file(scenes / "first.toml"), pictures=True)


def test_a_sealed_gap_costs_a_few_masks():
    """Labels, masks and lists of neighbours: a fixed number of arrays of the gap's size."""
    values = np.random.default_rng(0).random((256, 256))
    values[128] = 0.0
    for gap in (values[:8, :8], values):  # the first loads what is loaded once
        tracemalloc.start()
        leak = leak_rate(GridFilm(GridField(gap, (1.0, 1.0))), **FLUID)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert leak.state == "sealed"
    assert peak < 12 * values.nbytes
