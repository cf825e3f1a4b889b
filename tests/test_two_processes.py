"""Under mpirun two processes find what one does: equal to what the linear solver leaves."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import bounds_on_ranks
import numpy as np
import pytest
from dolfinx_meshes import MESHES
from lifted_scenes import scene as lifted_scene
from project import MPI_ENVIRONMENT, alone, rows, scene_of_samples, write_toml
from test_seal_of_a_scene import scene as seal_scene

from fem_seal.results import Result
from fem_seal.scene import Scene
from fem_seal.solved import solve
from fem_seal.sweep import combinations, sweep

pytestmark = pytest.mark.mpi

# Relative, of the bounds of one mesh: the first order of the correction in what CG leaves.
SAME = 2 * np.sqrt(0.3 * 4e-8)
PRESSED = scene_of_samples(32) | {"contact": {"pressure": 1e5}}
DRY = scene_of_samples(32) | {"flow": {"pressure_drop": 1e5, "lift": "none", "rtol": 0.5}}
SCENES = {
    "lifted": lifted_scene(rtol=0.1).to_mapping(),
    "seal": seal_scene(seal={"patches": 1, "rtol": 0.3, "max_seconds": 1_000}).to_mapping(),
    # Solved under less load as well, which needs a folder: with one each, both wait for ever.
    "sealed": seal_scene(contact={"pressure": 1e6}, limit={"leak_rate": "1 ml/h"}).to_mapping(),
    # No contact or flow is needed before: both solve what they need, the first one searches.
    "threshold": PRESSED | {"output": {"products": ["threshold"]}},
    "trapped": PRESSED | {"output": {"products": ["trapped_volume"]}},
}
# A worker of an executor solves alone, and waits for nobody: not even to start PETSc. A study
# without a folder has one for all processes.
# While the first process sleeps for a second, neither computes for as much as half of it.
# The clock of the second process is hours ahead: if it ended a seal alone by max_seconds, the first
# would wait for ever. The sealed seal tries one lower load.
SCRIPT = """
import json, os, sys, time
from importlib import import_module
from itertools import count
from pathlib import Path
from mpi4py import MPI
from mpi4py.futures import MPICommExecutor
from fem_seal import parallel
from fem_seal.cli import main
from fem_seal.points import StudyTask, points_of
from fem_seal.progress import silent
from fem_seal.scene import Scene
from fem_seal.solved import solve
from fem_seal.sweep import Work, combinations, sweep
from fem_seal.verification.cross_validation import StudiedGap, compare
from fem_seal.verification.exact_cases import CASES
import bounds_on_ranks

def one():
    return 1

def first():
    time.sleep(1)
    return parallel.cores(), os.sched_getaffinity(0)

parallel.abort_together()
world, folder = MPI.COMM_WORLD, Path(sys.argv[1])
with MPICommExecutor(world, root=0) as executor:
    if executor is not None:
        work = Work(executor=executor)
        sweep(folder / "dry", combinations("surface.seed=1,2"), folder / "sweep", work=work)
        assert compare([StudiedGap.of_case(CASES["series-channel"], [8])], ("adaptive",), work=work)
assert points_of([StudyTask("point", "point", one, ())], int, None, None, silent) == [1]

threads = os.environ.pop("OMP_NUM_THREADS")
own, spent = os.sched_getaffinity(0), time.process_time()
cores, lent = parallel.on_root(first)
spent = time.process_time() - spent
assert parallel.total(own <= lent) == 2 and cores == len(lent), (own, cores, lent)
assert spent < 0.5, spent
assert os.sched_getaffinity(0) == own and parallel.cores() == max(1, len(own) // 2)
os.environ["OMP_NUM_THREADS"] = threads

found = world.allgather(bounds_on_ranks.found())
if world.rank == 0:
    (folder / "found.json").write_text(json.dumps(found))

import_module("fem_seal.upscaling.seal").LOWER_LOADS = 1
if world.rank == 1:
    import_module("fem_seal.upscaling.refined_table").perf_counter = count(0, 10_000).__next__
for scene in sorted(folder.glob("*.toml")):
    if scene.stem == "sealed":
        seal = solve(Scene.from_file(scene), comm=world).seal
        assert seal.state == "sealed" and (seal.lowered or seal.next_load_share)
        assert len(set(world.allgather(repr((seal.lowered, seal.next_load_share))))) == 1
    else:
        assert main(["run", str(scene), "--out", str(folder / scene.stem)]) == 0
sys.stdout.flush()
sys.exit(main(["leak", str(folder / "gap.npz"), "--out", str(folder / "bad")]))
"""


@pytest.fixture(scope="module")
def by_two(tmp_path_factory) -> Path:
    """Folder of what two processes find, which are started once for all of it.

    The last of their commands has a gap that is negative.
    """
    folder = tmp_path_factory.mktemp("two")
    write_toml(folder / "dry", DRY)  # of the sweep alone
    for name, scene in SCENES.items():
        write_toml(folder / f"{name}.toml", scene)
    np.savez(folder / "gap.npz", gap=-np.ones((5, 5)), spacing=(1e-6, 1e-6))
    modules = {"PYTHONPATH": ":".join(sys.path)}
    done = subprocess.run(
        ["mpirun", "-n", "2", sys.executable, "-c", SCRIPT, str(folder)],
        capture_output=True,
        text=True,
        timeout=300,
        env=alone() | MPI_ENVIRONMENT | modules,
        check=False,
    )
    assert done.returncode == 2, done.stderr
    # The first process alone prints results and errors.
    states = [line for line in done.stdout.splitlines() if line.startswith("state ")]
    assert len(states) == len(SCENES) - 1, done.stdout
    assert done.stderr.count("is negative at") == 1
    assert not (folder / "bad").exists()
    return folder


@pytest.fixture(scope="module")
def found(by_two) -> tuple[dict[str, Any], dict[str, Any]]:
    """Numbers of `bounds_on_ranks` from one process and from two, which are alike."""
    two, other = json.loads((by_two / "found.json").read_text())
    assert two == other
    return bounds_on_ranks.found(), two


def test_two_ranks_give_the_bounds_and_the_tensor_of_one(found):
    """Uniform: the same problems. Their minima agree to 2e-8, and the bounds to SAME. Adaptive:
    marking may differ by a cell, but both brackets enclose one number."""
    assert found[0].keys() == found[1].keys()
    for name in found[0].keys() - {"meshes"}:
        one, two = (numbers[name] for numbers in found)
        if name.endswith("tensor"):
            for below, above in ((one, two), (two, one)):
                difference = np.array(above["upper"]) - np.array(below["lower"])
                # Minima of both ranks agree to the solver's tolerance only.
                assert np.linalg.eigvalsh(difference).min() >= -1e-7 * np.trace(above["upper"])
            continue
        assert two["bounds"][0] <= one["bounds"][1], name
        assert one["bounds"][0] <= two["bounds"][1], name
        if "uniform" in name:
            assert two["bounds"] == pytest.approx(one["bounds"], rel=SAME), name
            assert two["unknowns"] == one["unknowns"], name
            assert two["field"] == one["field"], name
            # Flows err as the root of the energy, times the ratio of norms of test_leak_rate.
            assert two["flows"] == pytest.approx(one["flows"], rel=100 * np.sqrt(4e-8)), name


def test_two_ranks_find_the_meshes_of_one(found):
    """Meshes are the same to the last digit, gaps and the lengths of inlet, outlet, wall, contact
    and seam to rounding, and bounds of the first mesh to what CG has left."""
    one, two = (numbers["meshes"] for numbers in found)
    assert two.keys() == one.keys()
    for name in MESHES:
        assert two[name]["mesh"] == one[name]["mesh"]
        assert two[name]["gap"] == pytest.approx(one[name]["gap"], rel=1e-14)
        assert two[name]["bounds"] == pytest.approx(one[name]["bounds"], rel=SAME), name
    for sides in ("wall", "periodic"):
        assert two[sides] == pytest.approx(one[sides], rel=1e-12)


def test_two_processes_write_the_results_of_one(by_two):
    """To some times the root of CG's 1e-8 of the energy, by which its functions err."""
    for name, scene in SCENES.items():
        if name == "sealed":
            continue
        one, two = solve(Scene.from_mapping(scene)).result(), Result.from_folder(by_two / name)
        assert two.provenance.processes == 2, name
        if name in ("lifted", "seal"):
            rates = [(result.seal or result).leak_rate for result in (one, two)]
            (low, high), ends = ((rate.lower, rate.upper) for rate in rates)
            assert (low, high) == pytest.approx(ends, rel=1e-3), name
        else:
            assert two.quantities == one.quantities, name
        # Three loads are solved before the clock is read.
        assert name != "seal" or (two.converged and len(two.seal.loads) > 3)
        assert (two.lift and two.lift.steps) == (one.lift and one.lift.steps), name


def test_rows_of_workers_are_those_of_this_process(by_two):
    points = combinations("surface.seed=1,2")
    sweep(by_two / "dry", points, by_two / "rows")
    assert rows(by_two / "sweep") == rows(by_two / "rows")
