"""What pip, conda and the container install must be what fem_seal imports."""

import re
import sys
import tomllib

from project import ROOT, imported, trees

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
# Names of modules and of conda's packages that differ from those of pip's.
MODULES = {"fenics-dolfinx": "dolfinx"}
CONDA = {"matplotlib": "matplotlib-base", "gmsh": "python-gmsh"}
# They come with DOLFINx, matplotlib or pydantic, whose versions must fit.
OF_OTHERS = {"_typeshed", "basix", "cffi", "mpi4py", "ufl", "PIL", "pydantic_core"}
# Imported where they are installed; setup.sh installs them.
OPTIONAL = {"SurfaceTopography", "distributed", "gmsh", "h5py", "xarray"}


def requirement(line: str) -> tuple[str, str]:
    """Name and versions of a line such as "numpy>=1"."""
    return re.fullmatch(r"([\w.-]+)([^\w-].*)?", line).groups(default="")


PIP = dict(map(requirement, PROJECT["dependencies"]))


def test_every_import_is_required_and_every_requirement_imported():
    names = {name.partition(".")[0] for tree in trees().values() for name in imported(tree)}
    required = {MODULES.get(name, name) for name in PIP} | {"fem_seal"}
    assert names - set(sys.stdlib_module_names) - OF_OTHERS - OPTIONAL == required


def test_conda_installs_what_pip_requires():
    lines = (ROOT / "environment.yml").read_text().partition("dependencies:\n")[2].splitlines()
    conda = dict(requirement(line.strip(" -").partition("  #")[0]) for line in lines)
    assert conda["python"] == PROJECT["requires-python"]
    for name, versions in (PIP | {"gmsh": ""}).items():
        found = conda[CONDA.get(name, name)]
        # conda-forge has no DOLFINx before 0.9 for a Python that is still maintained.
        assert found == versions.replace(">=0.5,", ">=0.9,"), name


def test_the_image_is_of_a_release_that_is_tried_and_runs_our_program():
    image = (ROOT / "Dockerfile").read_text()
    [release] = re.findall(r"^FROM debian:(\w+)-slim$", image, re.M)
    assert f"tests/clean_root.sh {release}" in (ROOT / "Makefile").read_text()
    [program] = re.findall(r'^ENTRYPOINT \["(.*)"\]$', image, re.M)
    assert program in PROJECT["scripts"]


def test_one_version():
    """The package names it; the release notes and the citation repeat it."""
    [version] = re.findall(
        r'^__version__ = "(.*)"$', (ROOT / "fem_seal/__init__.py").read_text(), re.M
    )
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    headings = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.M)
    assert headings[0] in ("Unreleased", version)
