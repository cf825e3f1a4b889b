"""fem-seal doctor: checks of the installation.

Each part of the installation that may crash is tried in a process of its own.
"""

import argparse
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from shutil import which

from fem_seal.cli.printing import say
from fem_seal.errors import MissingPackage
from fem_seal.installed import how_to_add, how_to_get_fenicsx
from fem_seal.tables import aligned

PROBE_SECONDS = 120  # seconds that one probe may take: the first use of DOLFINx compiles

# Parts that are only looked for, and what needs them; pip installs the first two with fem_seal.
LOOKED_FOR = {
    "meshio": "the mesh product (flow.vtu)",
    "matplotlib": "plots",
    "h5py": "surfaces and gaps in HDF5 and NetCDF 4",
    "SurfaceTopography": "measured surfaces",
    "gmsh": "seals that are not rectangles",
}
REQUIRED = ("meshio", "matplotlib")
COMPILER = "apt-get install gcc python3-dev; unset CC if it names no compiler"
NO_DRAWING = "unset VTK_DEFAULT_OPENGL_WINDOW; {}; apt-get install libegl1"
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
from fem_seal.fenicsx import HAS_HYPRE, PETSc
import dolfinx
versions = f"{dolfinx.__version__}, PETSc {'.'.join(map(str, PETSc.Sys.getVersion()))}"
gamg = "without hypre: GAMG takes its place, with more iterations"
print(versions, "with hypre" if HAS_HYPRE else gamg)
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


def add(command: argparse.ArgumentParser) -> None:
    """Let the command check the installation."""
    command.set_defaults(command=_doctor)


def _doctor(options: argparse.Namespace) -> int:
    """Print the findings in columns, with the remedy below each failed check."""
    findings, lines = list(examine()), []
    for finding in findings:
        mark = "ok  " if finding.works else ("FAIL" if finding.required else "no  ")
        lines.append((mark, finding.name, finding.found))
        if not finding.works:
            lines.append(("", "", f"for {finding.needed_for}: {finding.remedy}"))
    say(aligned(lines))
    broken = [finding.name for finding in findings if finding.required and not finding.works]
    if broken:
        raise MissingPackage(f"not working here: {', '.join(broken)}; the table says what to do")
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
    """Run all checks; takes a few seconds."""
    for name, use, code, remedy in (
        ("DOLFINx", "leak rates with bounds", _DOLFINX, how_to_get_fenicsx()),
        ("form compiler", "leak rates with bounds", _FORM, COMPILER),
        ("pictures", "contact.png and others", _PICTURE, NO_DRAWING.format(how_to_add("pyvista"))),
        ("FFTW threads", "elastic contact", _FFTW, how_to_add("pyfftw")),
    ):
        yield Finding(name, use, *_try([sys.executable, "-c", code]), remedy)
    yield _mpi()
    for name, use in LOOKED_FOR.items():
        works = find_spec(name) is not None
        found = "installed" if works else "not installed"
        remedy = "apt-get install python3-gmsh" if name == "gmsh" else how_to_add(name)
        yield Finding(name, use, works, found, remedy, required=name in REQUIRED)


def _try(command: list[str]) -> tuple[bool, str]:
    """Run a command; it works if it ends with status 0 and prints something."""
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=PROBE_SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        return False, f"no answer within {PROBE_SECONDS:g} s"
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
