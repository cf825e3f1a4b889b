"""A function in a process of its own: its answer, its error, and its end."""

import os
import signal
import subprocess

import pytest
from in_workers import ended_elsewhere
from project import scene_of_samples

from fem_seal import grid_series, parallel
from fem_seal.beside import beside, environment, peak_beside
from fem_seal.errors import InvalidInput
from fem_seal.grid_series import estimated_error, half_beside
from fem_seal.patch import Patch
from fem_seal.registry import require_known
from fem_seal.scene import Scene
from fem_seal.solved import solve

TESTING = os.getpid()


def from_beside(function, *arguments):
    with beside(function, *arguments) as answer:
        return answer()


def test_it_has_one_thread_and_starts_mpi_on_its_own(monkeypatch):
    for name in ("PMIX_RANK", "OMPI_COMM_WORLD_SIZE", "OMPI_MCA_btl"):
        monkeypatch.setenv(name, "1")
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    assert environment()["OMP_NUM_THREADS"] == "1"
    assert not {"PMIX_RANK", "OMPI_COMM_WORLD_SIZE"} & environment().keys()
    assert "OMPI_MCA_btl" in environment()
    assert from_beside(parallel.cores) == 1
    assert from_beside(parallel.processes) == 1
    assert from_beside(os.getppid) == TESTING
    # Python alone takes about 10 MB.
    assert peak_beside() > 5e6


def test_its_error_is_raised_here():
    with pytest.raises(InvalidInput, match="unknown"):
        from_beside(require_known, {"known": 1}, "other", "name")


@pytest.mark.parametrize("ended", ["killed", "no memory"])
def test_an_ended_process_is_made_up_for(ended, capfd):
    assert from_beside(ended_elsewhere, TESTING, ended) == TESTING
    assert capfd.readouterr().err == ""
    with beside(os.getppid) as late:
        pass
    # Once its process has ended, it is this one that computes the answer.
    assert late() == os.getppid()


def test_it_ends_with_what_it_stands_beside(beside_always, monkeypatch):
    """If the flow fails, the processes of a notebook do not compute on."""
    monkeypatch.setattr(Patch, "solve_film", lambda patch: require_known((), "flow", "step"))
    with pytest.raises(InvalidInput, match="step"):
        solve(Scene.from_mapping(scene_of_samples(32)))
    (process,) = beside_always
    assert process.returncode == -signal.SIGKILL


@pytest.fixture
def beside_always(monkeypatch):
    """Solve half of the samples beside the flow, however few they are; the processes started."""
    started = []
    popen = subprocess.Popen
    monkeypatch.setattr(
        subprocess, "Popen", lambda *a, **k: started.append(popen(*a, **k)) or started[-1]
    )
    monkeypatch.setattr(grid_series, "DRY_BESIDE", 1)
    monkeypatch.setattr(grid_series, "LIFTED_BESIDE", 1)
    monkeypatch.setattr(parallel, "cores", lambda: 2)
    return started


@pytest.mark.parametrize(("pressure", "lift"), [(0.2, "none"), (0.2, "resolved"), (3.0, "none")])
def test_the_coarser_grid_says_the_same_beside_the_flow(pressure, lift, request):
    sections = scene_of_samples(32)
    sections["contact"] = {"pressure": f"{pressure} MPa"}
    sections["flow"] |= {"rtol": 0.3, "lift": lift}
    here, other = (Patch(Scene.from_mapping(sections)) for _ in range(2))
    expected = here.once(estimated_error)
    started = request.getfixturevalue("beside_always")
    with half_beside(other):
        assert other.once(estimated_error) == expected
    assert bool(started) == (here.state == "leaking")
