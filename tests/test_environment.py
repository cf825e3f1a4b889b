"""Machines with a faulty set-up: one sentence names the fault, or the command works anyway."""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from project import ROOT, leak_scene, write_toml

from fem_seal import fenicsx
from fem_seal.cli import doctor, main
from fem_seal.cli.options import default_folder
from fem_seal.errors import MissingPackage
from fem_seal.files import use_writable_cache
from fem_seal.installed import DEBIAN_PETSC

LEAK = [sys.executable, "-m", "fem_seal", "leak", "gap.npz"]


@pytest.fixture
def folder(tmp_path, here):
    """Current folder with a gap, whose leak rate is computed on a few unknowns."""
    np.savez(tmp_path / "gap.npz", gap=np.full((5, 5), 1e-6), spacing=(1e-6, 1e-6))
    return tmp_path


def environment(**changes):
    """That of a user who has set nothing, with changes."""
    ours = ("OMPI_", "PMIX_", "PETSC_", "PYTHON")
    return {k: v for k, v in os.environ.items() if not k.startswith(ours)} | changes


def outcome(command, **changes):
    done = subprocess.run(
        command, env=environment(**changes), capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout, done.stderr


def sentence(command, **changes):
    """The one line of a command that ends with status 2."""
    status, out, error = outcome(command, **changes)
    assert (status, out) == (2, "")
    assert error.count("\n") == 1, error
    return error


of_debian = pytest.mark.skipif(
    not (DEBIAN_PETSC / "lib/python3/dist-packages/dolfinx").is_dir(),
    reason="DOLFINx, its MPI and what setup.sh mends are not from Debian",
)


@of_debian
def test_petsc_dir_hides_dolfinx(folder):
    said = sentence(LEAK, PETSC_DIR="/nowhere")
    assert "PETSC_DIR = '/nowhere' hides it: unset PETSC_DIR" in said
    assert "apt-get" not in said


def test_pythonpath_hides_a_package(folder):
    (folder / "other").mkdir()
    (folder / "other" / "numpy.py").write_text("raise ImportError('of another Python')\n")
    path = str(folder / "other")
    said = sentence(LEAK, PYTHONPATH=path)
    assert "of another Python" in said
    assert f"PYTHONPATH = {path!r} may hide the right one: unset it" in said


def test_no_compiler_and_nothing_compiled_yet(folder):
    said = sentence(LEAK, CC="/nowhere/gcc", XDG_CACHE_HOME=str(folder / "cache"))
    assert "FEniCSx could not compile a form" in said
    assert "apt-get install gcc python3-dev" in said


def test_a_home_that_cannot_be_written(folder, monkeypatch):
    """A file in place of the home folder: one line, and a cache that only this user can write."""
    for name in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME"):
        monkeypatch.delenv(name, raising=False)
    homeless = {"HOME": "/dev/null", "TMPDIR": str(folder)}
    status, _, error = outcome([*LEAK, "--method", "finite-difference"], **homeless)
    (cache,) = folder.glob("fem-seal-cache-*")
    assert (status, error.count("\n")) == (0, 1)
    assert f"{cache} keeps compiled forms" in error
    assert cache.stat().st_mode & 0o077 == 0
    # A folder that others can write, and might fill with programs, is not used.
    cache.chmod(0o777)
    monkeypatch.setenv("HOME", "/dev/null")
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    assert use_writable_cache()
    assert os.environ["XDG_CACHE_HOME"] != str(cache)


@pytest.mark.parametrize(
    ("flags", "scalar", "said"),
    [
        ({"has_petsc4py": False}, float, "this DOLFINx has no PETSc"),
        ({"has_petsc4py": True}, complex, "this PETSc computes with complex numbers"),
        ({}, complex, "this PETSc computes with complex numbers"),
    ],
)
def test_builds_of_dolfinx_that_do_not_do(flags, scalar, said, monkeypatch):
    monkeypatch.setattr(fenicsx, "dolfinx", SimpleNamespace(**flags))
    monkeypatch.setattr(fenicsx, "PETSc", SimpleNamespace(ScalarType=scalar))
    with pytest.raises(MissingPackage, match=said):
        fenicsx._require_real_petsc()


def test_only_the_time_out_of_a_compilation_says_that_a_form_is_missing():
    """FFCx's words, here also as several processes report them; other errors pass unchanged."""
    words = "JIT compilation timed out, probably due to a failed\n  previous compile."
    together = RuntimeError(f"Failed just-in-time compilation of form: {words}")
    for error in (TimeoutError(words), together):
        with (
            pytest.raises(MissingPackage, match=r"has no form: .*failed previous compile"),
            fenicsx.explained_compilation(),
        ):
            raise error
    for other in (TimeoutError("the worker did not answer"), RuntimeError("of another kind")):
        with pytest.raises(type(other), match=str(other)), fenicsx.explained_compilation():
            raise other


def test_readme_starts_mpi_with_the_options_that_the_doctor_tries():
    [line] = re.findall(r"^    (mpirun .*)", (ROOT / "README.md").read_text(), re.MULTILINE)
    assert line.startswith(" ".join([*doctor.MPIRUN, "-n"]))


@of_debian
@pytest.mark.mpi
def test_doctor_finds_this_machine_fit():
    """The tests need all that a run needs. Root is told apart from an MPI that does not work."""
    status, out, error = outcome([sys.executable, "-m", "fem_seal", "doctor"])
    assert status == 0, out + error
    assert not re.search(r"^FAIL", out, re.MULTILINE)
    assert re.search(r"^ok +pictures", out, re.MULTILINE)
    assert "2 processes talk" in out
    if os.geteuid() == 0:
        assert "mpirun refuses to run as root" in out
        assert "--allow-run-as-root" in out


def test_doctor_says_why_nothing_is_drawn(monkeypatch):
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkXOpenGLRenderWindow")
    monkeypatch.delenv("DISPLAY", raising=False)
    works, found = doctor._try([sys.executable, "-c", doctor._PICTURE])
    assert not works
    assert "VTK_DEFAULT_OPENGL_WINDOW" in found or "libGL" in found


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("print('1.2.3')", "1.2.3"),
        ("import nothing_of_this_name", "ModuleNotFoundError: No module named"),
        ("import os; os.abort()", "ended with status -6"),
        ("pass", "ended with status 0"),
        ("import time; time.sleep(60)", "no answer"),
    ],
)
def test_probe(code, found, monkeypatch):
    """Silence, death and going on for ever are failures as much as an exception is."""
    if "sleep" in code:
        monkeypatch.setattr(doctor, "PROBE_SECONDS", 0.2)
    works, said = doctor._try([sys.executable, "-c", code])
    assert works == (found == "1.2.3")
    assert said.startswith(found)


def test_no_mpirun(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    finding = doctor._mpi()
    assert not finding.works
    assert not finding.required
    assert "apt-get install" in finding.remedy


def test_table_and_exit_status(monkeypatch, capsys):
    good = doctor.Finding("good", "all", True, "1.0", "")
    bad = doctor.Finding("bad", "flow", False, "not found", "install it")
    extra = doctor.Finding("extra", "files", False, "not installed", "fetch it", required=False)
    monkeypatch.setattr(doctor, "examine", lambda: iter([good, extra]))
    assert main(["doctor"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "ok    good   1.0",
        "no    extra  not installed",
        "             for files: fetch it",
    ]
    monkeypatch.setattr(doctor, "examine", lambda: iter([good, bad]))
    assert main(["doctor"]) == 2
    assert "not working here: bad" in capsys.readouterr().err


LATIN = os.fsdecode(b"s\xe9al")  # not UTF-8


def test_input_whose_name_is_not_utf8(folder, refused):
    (folder / "gap.npz").rename(f"{LATIN}.npz")
    assert "that is not UTF-8; rename it" in refused("leak", f"{LATIN}.npz")


def test_other_names_need_not_be_utf8(folder):
    """Scene, result folder and page: nothing records these."""
    path = write_toml(folder / f"{LATIN}.toml", leak_scene(gap={"path": "gap.npz"}))
    sweep = ["sweep", path.name, "--vary", "flow.rtol=0.1,0.2"]
    for command in (["run", path.name], ["report", f"results/{LATIN}"], sweep):
        assert main(command) == 0
    assert (folder / "results" / LATIN / "result.json").is_file()
    assert (folder / "results" / LATIN / "report.html").is_file()


def test_name_of_a_folder_says_what_counts_and_is_one_name():
    scene = Path("scenes") / "first.toml"
    settings = ["flow.rtol=0.1", "output.products=['contact']", "flow.rtol=0.02"]
    assert default_folder(scene, settings) == Path("results") / "first-flow.rtol=0.02"
    for text in ("flow.sides=../../x", "a.b=" + 500 * "c", "a.b=\x1b[2J\n/"):
        path = default_folder(scene, [text])
        assert (path.parent, path.name[:6]) == (Path("results"), "first-"), text
        assert path.name.isprintable(), text
        assert len(path.name.encode()) < 256, text  # what file systems take
