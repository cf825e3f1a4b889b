"""A function in a process of its own: its answer, its error, and its end."""

import os
import signal
import subprocess

import pytest
from in_workers import ended_elsewhere
from project import scene_of_samples

from fem_seal import grid_series, parallel
from fem_seal.arguments import require_known
from fem_seal.errors import Inconsistent, InvalidInput
from fem_seal.grid_series import estimated_error, half_in_worker, half_solver
from fem_seal.patch import Patch
from fem_seal.scene import Scene
from fem_seal.solved import solve
from fem_seal.worker import environment, in_worker, peak_of_workers

TESTING = os.getpid()


def from_worker(function, *arguments):
    with in_worker(function, *arguments) as answer:
        return answer()


def test_it_has_one_thread_and_starts_mpi_on_its_own(monkeypatch):
    for name in ("PMIX_RANK", "OMPI_COMM_WORLD_SIZE", "OMPI_MCA_btl"):
        monkeypatch.setenv(name, "1")
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    assert environment()["OMP_NUM_THREADS"] == "1"
    assert not {"PMIX_RANK", "OMPI_COMM_WORLD_SIZE"} & environment().keys()
    assert "OMPI_MCA_btl" in environment()
    assert from_worker(parallel.cores) == 1
    assert from_worker(parallel.processes) == 1
    assert from_worker(os.getppid) == TESTING
    # Python alone takes about 10 MB.
    assert peak_of_workers() > 5e6


def test_its_error_is_raised_here():
    with pytest.raises(InvalidInput, match="unknown"):
        from_worker(require_known, {"known": 1}, "other", "name")


@pytest.mark.parametrize("ended", ["killed", "no memory"])
def test_an_ended_process_is_made_up_for(ended, capfd):
    assert from_worker(ended_elsewhere, TESTING, ended) == TESTING
    assert capfd.readouterr().err == ""
    with in_worker(os.getppid) as late:
        pass
    # Once its process has ended, it is this one that computes the answer.
    assert late() == os.getppid()


def test_it_ends_with_the_process_that_started_it(worker_always, monkeypatch):
    """If the flow fails, the processes of a notebook do not compute on."""
    monkeypatch.setattr(Patch, "solve_film", lambda patch: require_known((), "flow", "step"))
    with pytest.raises(InvalidInput, match="step"):
        solve(Scene.from_mapping(scene_of_samples(32)))
    (process,) = worker_always
    assert process.returncode == -signal.SIGKILL


@pytest.fixture
def worker_always(monkeypatch):
    """Solve half of the samples during the flow, however few they are; the processes started."""
    started = []
    popen = subprocess.Popen
    monkeypatch.setattr(
        subprocess, "Popen", lambda *a, **k: started.append(popen(*a, **k)) or started[-1]
    )
    monkeypatch.setattr(grid_series, "DRY_IN_WORKER", 1)
    monkeypatch.setattr(grid_series, "LIFTED_IN_WORKER", 1)
    monkeypatch.setattr(parallel, "cores", lambda: 2)
    return started


@pytest.mark.parametrize(("pressure", "lift"), [(0.2, "none"), (0.2, "resolved"), (3.0, "none")])
def test_the_coarser_grid_says_the_same_in_a_worker(pressure, lift, request):
    sections = scene_of_samples(32)
    sections["contact"] = {"pressure": f"{pressure} MPa"}
    sections["flow"] |= {"rtol": 0.3, "lift": lift}
    here, other = (Patch(Scene.from_mapping(sections)) for _ in range(2))
    expected = estimated_error(here)
    started = request.getfixturevalue("worker_always")
    with half_in_worker(other):
        assert estimated_error(other) == expected
    assert bool(started) == (here.state == "leaking")


def test_a_computed_value_is_not_replaced():
    """Whoever has read it would not see the new one."""
    patch = Patch(Scene.from_mapping(scene_of_samples(32)))
    half_solver(patch)
    with pytest.raises(Inconsistent, match="half_solver of this patch is computed already"):
        patch.keep(half_solver, lambda: None)
