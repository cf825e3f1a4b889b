"""fem-seal doctor and fem-seal schema: checks of the installation, and the schema for editors.

Each part of the installation that may crash is tried in a process of its own.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from ctypes.util import find_library
from dataclasses import dataclass
from importlib.util import find_spec
from shutil import which

from fem_seal.cli.options import add_command
from fem_seal.cli.printing import say
from fem_seal.errors import MissingPackage
from fem_seal.files import user_cache
from fem_seal.installed import how_to_add, how_to_get_fenicsx

OFF_SCREEN = "vtkEGLRenderWindow"
PATIENCE = 120  # seconds that one probe may take: the first use of DOLFINx compiles

# Parts that are only looked for, and what needs them; pip installs the first two with fem_seal.
PARTS = {
    "meshio": "the mesh product (flow.vtu)",
    "matplotlib": "plots",
    "h5py": "surfaces and gaps in HDF5 and NetCDF 4",
    "SurfaceTopography": "measured surfaces",
    "gmsh": "seals that are not rectangles",
}
REQUIRED = ("meshio", "matplotlib")
# Phrases in the output of Open MPI and VTK, and their causes. If one failure leads to another, it
# comes first.
CAUSES = {
    "attempt to run as root": "mpirun refuses to run as root",
    "not enough slots": "mpirun starts no more processes than there are cores",
    "unable to find network interfaces": "no network interface is up, not even the loopback (lo)",
    "listener thread failed": "no network interface is up, not even the loopback (lo)",
    "bad X server connection": "VTK_DEFAULT_OPENGL_WINDOW asks for an X server; there is none",
    "libOSMesa not found": "VTK finds no way to draw without a screen",
}
# Open MPI needs these options to run as root, and to start more processes than there are cores.
MPIRUN = ("mpirun", "--oversubscribe", "--allow-run-as-root")

_DOLFINX = """
import fem_seal.fenicsx
import dolfinx
print(dolfinx.__version__)
"""
_PETSC = """
from fem_seal.fenicsx import HAS_HYPRE, PETSc
version = "PETSc " + ".".join(map(str, PETSc.Sys.getVersion()))
gamg = "this PETSc has no hypre: GAMG takes its place, with more iterations"
print(f"{version} with hypre" if HAS_HYPRE else f"{version}; {gamg}")
"""
_MPI = """
from mpi4py import MPI
if MPI.COMM_WORLD.allreduce(1) == 2 and MPI.COMM_WORLD.rank == 0:
    print("2 processes talk")
"""
_FORM = """
import fem_seal.fenicsx
import dolfinx, ufl
from mpi4py import MPI
mesh = dolfinx.mesh.create_unit_square(MPI.COMM_SELF, 1, 1)
one = dolfinx.fem.Constant(mesh, 1.0)
area = dolfinx.fem.assemble_scalar(dolfinx.fem.form(one * ufl.dx(mesh)))
print("compiles" if abs(area - 1) < 1e-12 else "")
"""
_PICTURE = """
from fem_seal.render.offscreen import require_gl
require_gl()
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(16, 16))
plotter.set_background("red")
print("draws" if plotter.screenshot(return_img=True)[8, 8, 0] == 255 else "")
"""
_FFTW = """
import numpy, pyfftw
y = pyfftw.interfaces.numpy_fft.rfft2(numpy.ones((64, 64)), threads=2)
print("2 threads" if abs(y[0, 0] - 4096) < 1e-9 else "")
"""


def add(subparsers: argparse._SubParsersAction) -> None:
    """Add both commands."""
    command = add_command(
        subparsers,
        "doctor",
        "say what works here, and what to install",
        "fem-seal doctor",
    )
    command.set_defaults(command=_doctor)
    command = add_command(
        subparsers,
        "schema",
        "print the JSON schema of scene files, by which editors complete and check them",
        "fem-seal schema > scene.schema.json",
    )
    command.set_defaults(command=_schema)


def _doctor(options: argparse.Namespace) -> int:
    findings = list(examine())
    say(table(findings))
    broken = [finding.name for finding in findings if finding.required and not finding.works]
    if broken:
        raise MissingPackage(f"not working here: {', '.join(broken)}; the table says what to do")
    return 0


def _schema(options: argparse.Namespace) -> int:
    from fem_seal.scene.schema import scene_schema

    say(json.dumps(scene_schema(), indent=2))
    return 0


@dataclass(frozen=True)
class Finding:
    """Result of one check."""

    name: str  #: name of the part
    needed_for: str  #: feature that needs the part
    works: bool  #: whether the part works
    found: str  #: its version, or the first line of the error
    remedy: str  #: remedy: a package to install, or a command
    required: bool = True  #: whether `fem-seal run` needs the part


def examine() -> Iterator[Finding]:
    """Run all checks, those with the simplest remedy first; takes a few seconds."""
    yield _probe("DOLFINx", "leak rates with bounds", _DOLFINX, how_to_get_fenicsx())
    yield _probe("PETSc", "the linear solver", _PETSC, how_to_get_fenicsx())
    yield _mpi()
    yield _cache()
    yield _probe("form compiler", "leak rates with bounds", _FORM, _compiler_remedy())
    yield _probe("pictures", "contact.png and others", _PICTURE, _picture_remedy())
    yield _probe("FFTW threads", "elastic contact", _FFTW, "pip install pyfftw")
    for name, use in PARTS.items():
        works = find_spec(name) is not None
        found = "installed" if works else "not installed"
        remedy = "apt-get install python3-gmsh" if name == "gmsh" else how_to_add(name)
        yield Finding(name, use, works, found, remedy, required=name in REQUIRED)


def table(findings: list[Finding]) -> str:
    """Format the findings in columns, with the remedy below each failed check."""
    width = max(len(finding.name) for finding in findings)
    lines = []
    for finding in findings:
        mark = "ok  " if finding.works else ("FAIL" if finding.required else "no  ")
        lines.append(f"{mark}  {finding.name:<{width}}  {finding.found}")
        if not finding.works:
            lines.append(f"{'':<6}{'':<{width}}  for {finding.needed_for}: {finding.remedy}")
    return "\n".join(lines)


def _probe(name: str, needed_for: str, code: str, remedy: str) -> Finding:
    works, found = _try([sys.executable, "-c", code])
    return Finding(name, needed_for, works, found, remedy)


def _try(command: list[str], patience: float = PATIENCE) -> tuple[bool, str]:
    """Run a command; it works if it ends with status 0 and prints something."""
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=patience, check=False
        )
    except subprocess.TimeoutExpired:
        return False, f"no answer within {patience:g} s"
    except OSError as error:
        return False, f"{command[0]}: {error.strerror}"
    lines = done.stdout.strip().splitlines()
    if done.returncode == 0 and lines:
        return True, lines[-1]
    complaint = done.stdout + done.stderr
    causes = [cause for words, cause in CAUSES.items() if words in complaint]
    lines = [line for line in done.stderr.splitlines() if line.strip(" -")]
    if causes or not lines:
        return False, causes[0] if causes else f"ended with status {done.returncode}"
    return False, lines[-1].strip()[:100]


def _mpi() -> Finding:
    probe = ["-n", "2", sys.executable, "-c", _MPI]
    works, found = _try(["mpirun", *probe])
    if not works:
        works, with_options = _try([*MPIRUN, *probe])
        found = f"{with_options} by {' '.join(MPIRUN)} ({found})" if works else with_options
    remedy = "ip link set lo up; in a container without a network: export OMPI_MCA_btl=^tcp"
    if which("mpirun") is None:
        remedy = "apt-get install openmpi-bin"
    return Finding("mpirun", "several processes", works, found, remedy, required=False)


def _cache() -> Finding:
    folder = user_cache() / "fenics"
    existing = next(p for p in (folder, *folder.parents) if p.exists())
    name, use = "JIT cache", "compiled forms"
    if not (existing.is_dir() and os.access(existing, os.W_OK)):
        remedy = "set XDG_CACHE_HOME to a folder that can be written"
        return Finding(name, use, False, f"{folder} cannot be written", remedy)
    return Finding(name, use, True, f"{folder} can be written", "")


def _picture_remedy() -> str:
    if os.environ.get("VTK_DEFAULT_OPENGL_WINDOW", OFF_SCREEN) != OFF_SCREEN:
        return "unset VTK_DEFAULT_OPENGL_WINDOW"
    if not (find_library("EGL") or find_library("OSMesa")):
        return "apt-get install libegl1"
    return "pip install pyvista; apt-get install libegl1"


def _compiler_remedy() -> str:
    if "CC" in os.environ and which(os.environ["CC"]) is None:
        return f"unset CC, which names no compiler: {os.environ['CC']!r}"
    return "apt-get install gcc python3-dev" if which("gcc") is None else "see the lines above"
