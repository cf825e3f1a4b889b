"""Under mpirun two processes write the results of one: equal to what the linear solver leaves."""

import json
import subprocess
import sys

import numpy as np
import pytest
from lifted_scenes import scene as lifted_scene
from project import MPI_ENVIRONMENT, alone, scene_of_samples, write_toml
from test_seal_of_a_scene import scene as seal_scene

from fem_seal.results import Result
from fem_seal.scene import Scene
from fem_seal.solved import solve

pytestmark = pytest.mark.mpi

PRESSED = scene_of_samples(32) | {"contact": {"pressure": 1e5}}
SCENES = {
    "dry": scene_of_samples(32) | {"flow": {"pressure_drop": 1e5, "lift": "none", "rtol": 0.5}},
    "lifted": lifted_scene(rtol=0.1).to_mapping(),
    "seal": seal_scene(seal={"patches": 1, "rtol": 0.3, "max_seconds": 1_000}).to_mapping(),
    # No contact or flow is needed before: both solve what they need, the first one searches.
    "threshold": PRESSED | {"output": {"products": ["threshold"]}},
    "trapped": PRESSED | {"output": {"products": ["trapped_volume"]}},
}
# The clock of the second process is hours ahead: if it ended a seal alone by max_seconds, the first
# would wait for ever.
SCRIPT = """
import json, sys
from importlib import import_module
from itertools import count
from mpi4py import MPI
from fem_seal.cli import main
if MPI.COMM_WORLD.rank == 1:
    import_module("fem_seal.upscaling.refined_table").perf_counter = count(0, 10_000).__next__
*jobs, bad = json.loads(sys.argv[1])
assert not any([main(job) for job in jobs])
sys.stdout.flush()
sys.exit(main(bad))
"""


def mpirun(*arguments, **variables):
    """Run Python on two processes; status, output and error."""
    done = subprocess.run(
        ["mpirun", "-n", "2", sys.executable, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        env=alone() | MPI_ENVIRONMENT | variables,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


def test_two_processes_write_the_results_of_one(tmp_path):
    """To some times the root of CG's 1e-8 of the energy, by which its functions err.

    They are started once; the last of their commands has a gap that is negative.
    """
    folder, jobs = tmp_path, []
    for name, scene in SCENES.items():
        path = write_toml(folder / f"{name}.toml", scene)
        jobs.append(["run", str(path), "--out", str(folder / name)])
    np.savez(folder / "gap.npz", gap=-np.ones((5, 5)), spacing=(1e-6, 1e-6))
    jobs.append(["leak", str(folder / "gap.npz"), "--out", str(folder / "bad")])
    status, output, error = mpirun("-c", SCRIPT, json.dumps(jobs))
    assert status == 2, error
    # The first process alone prints results and errors.
    assert len([line for line in output.splitlines() if line.startswith("state ")]) == 5, output
    assert error.count("is negative at") == 1
    assert not (folder / "bad").exists()
    for name, scene in SCENES.items():
        one, two = solve(Scene.from_mapping(scene)).result(), Result.from_folder(folder / name)
        assert two.provenance.processes == 2, name
        if name in ("dry", "lifted", "seal"):
            rates = [(result.seal or result).leak_rate for result in (one, two)]
            (low, high), ends = ((rate.lower, rate.upper) for rate in rates)
            assert (low, high) == pytest.approx(ends, rel=1e-3), name
        else:
            assert two.quantities == one.quantities, name
        # Three loads are solved before the clock is read.
        assert name != "seal" or (two.converged and len(two.seal.loads) > 3)
        assert (two.lift and two.lift.steps) == (one.lift and one.lift.steps), name


def test_patches_of_a_sealed_seal_have_one_temporary_folder():
    """Solved under less load as well, which needs a folder: with one each, both wait for ever."""
    sealed = seal_scene(contact={"pressure": 1e6}, limit={"leak_rate": "1 ml/h"})
    code = """
import json, sys
from mpi4py import MPI
from fem_seal.scene import Scene
from fem_seal.solved import solve
seal = solve(Scene.from_mapping(json.loads(sys.argv[1])), comm=MPI.COMM_WORLD).seal
assert seal.state == "sealed" and seal.lowered is not None
assert len(set(MPI.COMM_WORLD.allgather(repr(seal.lowered)))) == 1
"""
    status, _, error = mpirun("-c", code, json.dumps(sealed.to_mapping()))
    assert status == 0, error


def test_a_process_that_waits_sleeps_and_lends_its_core():
    """While the first sleeps for a second, neither computes for as much as half of it."""
    code = """
import os, time
from fem_seal import parallel
def first():
    time.sleep(1)
    return parallel.cores(), os.sched_getaffinity(0)
own, spent = os.sched_getaffinity(0), time.process_time()
cores, lent = parallel.on_root(first)
spent = time.process_time() - spent
assert parallel.total(own <= lent) == 2 and cores == len(lent), (own, cores, lent)
assert spent < 0.5, spent
assert os.sched_getaffinity(0) == own and parallel.cores() == max(1, len(own) // 2)
"""
    status, _, error = mpirun("-c", code, OMP_NUM_THREADS="")
    assert status == 0, error
