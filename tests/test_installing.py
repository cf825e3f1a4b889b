"""The source distribution holds the project, and its wheel works after any way of installing."""

import os
import subprocess
import sys
import sysconfig
import tarfile
from pathlib import Path

import pytest
from project import ROOT

# setuptools is fetched for each build: minutes, and a network.
pytestmark = pytest.mark.slow

DEBIAN_PYTHON = "/usr/bin/python3"
PIP = ("-m", "pip", "--disable-pip-version-check", "-q")


def run(*command, cwd=ROOT.parent, **changes):
    clean = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(
        command, env=clean | changes, capture_output=True, text=True, check=False, cwd=cwd
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def distributions(tmp_path_factory):
    """Folder with the source distribution of the last commit and the wheel built from it."""
    folder = tmp_path_factory.mktemp("distributions")
    checkout = folder / "checkout"
    run("git", "clone", "-q", str(ROOT), str(checkout))
    run(sys.executable, "-m", "build", "--outdir", str(folder), str(checkout))
    return folder


def only(folder, pattern):
    (path,) = folder.glob(pattern)
    return path


def test_the_source_distribution_holds_every_file_of_the_project(distributions):
    with tarfile.open(only(distributions, "*.tar.gz")) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    tracked = run("git", "-C", str(distributions / "checkout"), "ls-files").splitlines()
    about_git = {".gitignore", ".ci/run", "fem_seal/mesh/sources"}  # the last is a link to meshes/
    assert set(tracked) - about_git <= held


def installed(way, distributions, folder):
    """Interpreter and environment of an installation of the wheel without its dependencies."""
    # The dependencies come from the environment of the tests; fem_seal itself is not found there,
    # since Python reads no .pth file in folders that PYTHONPATH or a .pth file names.
    libraries = sysconfig.get_path("purelib")
    wheel = str(only(distributions, "*.whl"))
    if way == "target":
        run(DEBIAN_PYTHON, *PIP, "install", "--no-deps", "--target", str(folder), wheel)
        return DEBIAN_PYTHON, {"PYTHONPATH": f"{folder}:{libraries}"}
    if way == "user":
        user = {"PYTHONUSERBASE": str(folder), "PIP_BREAK_SYSTEM_PACKAGES": "1"}
        run(DEBIAN_PYTHON, *PIP, "install", "--no-deps", "--user", wheel, **user)
        return DEBIAN_PYTHON, {"PYTHONPATH": libraries} | user
    run(DEBIAN_PYTHON, "-m", "venv", "--system-site-packages", str(folder))
    python = str(folder / "bin/python")
    what = ("-e", str(distributions / "checkout")) if way == "editable" else (wheel,)
    run(python, *PIP, "install", "--no-deps", *what)
    (site,) = (folder / "lib").glob("python3*/site-packages")
    (site / "dependencies.pth").write_text(libraries + "\n")
    return python, {}


@pytest.mark.parametrize("way", ["venv", "user", "target", "editable"])
def test_a_built_in_shape_runs_after_any_way_of_installing(way, distributions, tmp_path):
    python, environment = installed(way, distributions, tmp_path / "installed")
    # From a folder that holds a checkout called fem_seal, which must not stand for the package.
    (tmp_path / "fem_seal").mkdir()
    code = "import fem_seal; print(fem_seal.__file__)"
    where = Path(run(python, "-c", code, cwd=tmp_path, **environment))
    home = distributions / "checkout" if way == "editable" else tmp_path / "installed"
    assert where.is_relative_to(home)
    scene = str(ROOT / "demos/scenes/face-seal.toml")
    out = tmp_path / "out"
    run(python, "-m", "fem_seal", "mesh", scene, "--out", str(out), **environment)
    assert (out / "mesh.vtu").is_file()
