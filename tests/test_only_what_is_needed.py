"""Only what the scene requires: what each kind of scene imports, solves and allocates."""

import json
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest
from project import alone

from fem_seal.film import GridFilm
from fem_seal.flow import leak_rate, linear
from fem_seal.grid import GridField

FINITE_ELEMENTS = {"dolfinx", "ufl", "basix", "ffcx", "petsc4py"}
DRAWING = {"pyvista", "vtkmodules", "matplotlib"}
FFT = {"pyfftw"}
HEAVY = FINITE_ELEMENTS | DRAWING | FFT

RUN = """
import json, sys
from fem_seal.scene import Scene
from fem_seal.solved import answer, solve
from fem_seal.patch import Patch
result = solve(Scene.from_mapping(json.loads(sys.argv[1]))).result()
print(result.state, result.unknowns, *{name.partition('.')[0] for name in sys.modules})
"""


def run(scene):
    """State, unknowns and heavy packages loaded, of a scene in a process of its own."""
    command = [sys.executable, "-c", RUN, json.dumps(scene)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=alone())
    state, unknowns, *modules = done.stdout.split()
    return state, int(unknowns), set(modules) & HEAVY


@pytest.fixture
def gap_scene(tmp_path):
    """A gap from a file with an open channel, or shut by a row of contact."""

    def scene(method, shut=False):
        gap = np.ones((9, 9)) * 1e-6
        gap[4] *= not shut
        path = tmp_path / f"{shut}.npz"
        np.savez(path, gap=gap, spacing=(1e-6, 1e-6))
        return {
            "gap": {"path": str(path)},
            "fluid": {"viscosity": 1e-3},
            "flow": {"pressure_drop": 1e5, "method": method},
            "output": {"products": ["leak_rate"]},
        }

    return scene


def changed(scene, **sections):
    return {name: fields | sections.get(name, {}) for name, fields in scene.items()}


def test_the_contact_alone_loads_transforms_and_nothing_else(small_scene):
    scene = changed(small_scene, output={"products": ["contact"]})
    assert run(scene) == ("leaking", 0, FFT)


def test_the_bearing_model_loads_nothing(small_scene):
    scene = changed(small_scene, output={"products": ["contact"]}, contact={"model": "bearing"})
    assert run(scene) == ("leaking", 0, set())


def test_finite_differences_load_no_finite_elements(small_scene, gap_scene):
    state, unknowns, loaded = run(small_scene)
    assert (state, loaded) == ("leaking", FFT)
    assert 0 < unknowns < 32 * 33
    assert run(gap_scene("finite-difference"))[2] == set()


def test_a_given_gap_loads_no_transforms_and_no_drawing(gap_scene):
    state, unknowns, loaded = run(gap_scene("adaptive"))
    assert state == "leaking"
    assert unknowns > 0
    assert "dolfinx" in loaded
    assert not loaded & (DRAWING | FFT)


@pytest.mark.parametrize("method", ["adaptive", "uniform", "finite-difference"])
def test_a_sealed_gap_is_answered_without_a_solver(gap_scene, method):
    assert run(gap_scene(method, shut=True)) == ("sealed", 0, set())


# --- what is solved ------------------------------------------------------------------------------


def labyrinth(pockets: int) -> GridField:
    """A rough channel beside contact that holds so many pockets of one sample."""
    gap = np.zeros((64, 48))
    gap[:, 40:] = 0.1 + np.random.default_rng(5).random((64, 8))
    places = [(i, j) for i in range(1, 63, 2) for j in range(1, 38, 2)]
    for i, j in places[:pockets]:
        gap[i, j] = 1.0
    return GridField(gap, (1.0, 1.0))


@pytest.fixture
def counted(monkeypatch):
    """Unknowns of every linear system that is solved."""
    sizes = []
    original = linear.minimise_by_cg

    def solve(solver, *arguments):
        sizes.append(solver.getOperators()[0].getSize()[0])
        return original(solver, *arguments)

    monkeypatch.setattr(linear, "minimise_by_cg", solve)
    return sizes


def solved(gap, **options):
    return leak_rate(GridFilm(gap), viscosity=1 / 12, pressure_drop=1.0, rtol=0.2, **options)


def test_the_mesh_has_only_what_carries_flow():
    """No cell lies among the pockets, which end a pixel before the channel begins."""
    flow = solved(labyrinth(500), field=True)
    centres = flow.field.points[flow.field.cells].mean(axis=1)
    assert len(centres)
    assert centres[:, 1].min() > 39.0
    assert flow.field.gap.max() <= 1.1


def test_a_sealed_gap_is_not_solved_and_costs_a_few_masks(counted):
    """Labels, masks and lists of neighbours: a fixed number of arrays of the gap's size."""
    values = np.random.default_rng(0).random((256, 256))
    values[128] = 0.0
    gap = GridField(values, (1.0, 1.0))
    solved(labyrinth(0))  # loads what is loaded once
    counted.clear()
    tracemalloc.start()
    state = solved(gap).state
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert state == "sealed"
    assert not counted
    assert peak < 12 * gap.values.nbytes
