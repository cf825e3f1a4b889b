"""Meshing by gmsh: a .geo file with its numbers set, and a size field that follows the gap.

A .geo file is a program: it can run shell commands and write files. The package's own sources,
recognised by their content, are run as they are; any other one only if the user trusts it. gmsh
always works in a process of its own (`gmsh_process`), so that Ctrl-C, a crash or an endless loop
in it ends with one sentence and leaves nothing behind.
"""

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from select import select

from fem_seal.errors import InvalidInput, MissingPackage
from fem_seal.files import temporary_folder
from fem_seal.mesh.files import GroupNames, Triangles, read_triangles
from fem_seal.mesh.gmsh_process import MESH_FILE, Job, Sizes, triangulate
from fem_seal.worker import Worker

# Geometries of the package, beside its modules; also in a wheel and in an editable install.
SOURCES = Path(__file__).with_name("sources")
LONGEST = 600.0  # longest time [s] for a geometry that is not the package's own
NO_GMSH = (
    "meshing a [shape] needs gmsh; on Debian: apt-get install python3-gmsh, elsewhere: "
    "pip install gmsh"
)
_LOG_FILE = "log.txt"


def require_trust(geo: Path, trust: bool) -> bytes | None:
    """Content of a .geo file of the package itself; None for another one, refused without trust.

    The user trusts a file by `--trust`, or in Python by `trust=True`.
    """
    content = geo.read_bytes()
    if any(content == own.read_bytes() for own in SOURCES.glob("*.geo")):
        return content
    if not trust:
        raise InvalidInput(
            f"{geo} is a program that gmsh would run with your rights; if you trust it, say "
            "--trust (in Python: trust=True), or mesh it in gmsh and name the .msh file"
        )
    return None


def mesh_geometry(
    geo: Path,
    numbers: Mapping[str, float],
    unit: float,
    names: GroupNames,
    sizes: Sizes | None = None,
    largest: float | None = None,
    *,
    trust: bool = False,
) -> Triangles:
    """Run a .geo file through gmsh, in a process of its own.

    Parameters
    ----------
    geo
        Geometry source; it names the groups by Physical Curve.
    numbers
        Values of its DefineConstant, for the package's own sources.
    unit
        Length of its unit [m].
    sizes
        Rectangle of the geometry -> largest edge lengths by position; it is pickled.
    largest
        Largest edge length anywhere [m].
    trust
        Whether to run a file that is not the package's own, for at most `LONGEST`.
    """
    own = require_trust(geo, trust)
    if not find_spec("gmsh"):
        raise MissingPackage(NO_GMSH)
    with temporary_folder() as folder:
        job = Job(str(geo.absolute()), own, dict(numbers), unit, sizes, largest)
        _run(job, folder, None if own else LONGEST)
        if not (folder / MESH_FILE).exists():
            raise InvalidInput(f"gmsh has made no mesh of {geo}: does it have a surface?")
        _refuse_cut_off(folder / MESH_FILE, geo)
        return read_triangles(folder / MESH_FILE, unit, names, source=geo)


def _refuse_cut_off(mesh: Path, geo: Path) -> None:
    """Refuse a mesh that ends early: gmsh does not say when the disk is full."""
    with mesh.open("rb") as file:
        file.seek(max(0, mesh.stat().st_size - 100))
        end = file.read().rstrip().rpartition(b"\n")[2]
    if not end.startswith(b"$End"):
        raise InvalidInput(
            f"gmsh could not write the whole mesh of {geo} to {mesh.parent}: is the disk full? "
            "TMPDIR names another temporary folder"
        )


def _run(job: Job, folder: Path, longest: float | None) -> None:
    """Let a process mesh a job in a folder; InvalidInput if it does not end well."""
    with (folder / _LOG_FILE).open("wb") as log:
        worker = Worker(log)
    try:
        worker.begin(triangulate, job, folder)
        if not select([worker], [], [], longest)[0]:
            raise InvalidInput(
                f"gmsh has not meshed {job.path} within {longest:g} s; mesh it in gmsh and name "
                "the .msh file"
            )
        worker.answer()
    except EOFError:
        lines = (folder / _LOG_FILE).read_text(encoding="utf-8", errors="replace").splitlines()
        status = worker.end()
        cause = f"signal {-status}" if status < 0 else "".join(lines[-1:])
        raise InvalidInput(
            f"gmsh has crashed on {job.path} ({cause}); mesh it in gmsh and name the .msh file"
        ) from None
    finally:
        worker.end()
