"""Meshing by gmsh: a .geo file with its numbers set, and a size field that follows the gap."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numpy as np

from fem_seal.errors import InvalidInput, MissingPackage
from fem_seal.mesh.files import GroupNames, Triangles, read_triangles

MOST_EDGES = 1e5  # along the longer side


@dataclass(frozen=True)
class Rectangle:
    """x0 <= x <= x1, y0 <= y <= y1 [m]."""

    x0: float
    x1: float
    y0: float
    y1: float


@dataclass(frozen=True, eq=False)
class SizeField:
    """Wanted edge lengths on a rectangular raster, linear between its points.

    sizes : (nx, ny) [m], at least 2 x 2
    origin : (x0, y0) [m] of sizes[0, 0]; spacing : (dx, dy) [m]
    """

    sizes: np.ndarray
    origin: tuple[float, float]
    spacing: tuple[float, float]

    def __call__(self, x: float, y: float) -> float:
        """Edge length [m] at a point; outside the raster that of its rim."""
        nx, ny = self.sizes.shape
        s = min(max((x - self.origin[0]) / self.spacing[0], 0.0), nx - 1.0)
        t = min(max((y - self.origin[1]) / self.spacing[1], 0.0), ny - 1.0)
        i, j = min(int(s), nx - 2), min(int(t), ny - 2)
        s, t = s - i, t - j
        a, b, c, d = self.sizes[i : i + 2, j : j + 2].ravel().tolist()
        return (1 - s) * ((1 - t) * a + t * b) + s * ((1 - t) * c + t * d)


Sizes = Callable[[Rectangle], SizeField]


def mesh_geometry(
    geo: Path,
    numbers: Mapping[str, float],
    unit: float,
    names: GroupNames,
    sizes: Sizes | None = None,
    largest: float | None = None,
) -> Triangles:
    """Run a .geo file through gmsh.

    Parameters
    ----------
    geo : geometry source; it names the groups by Physical Curve
    numbers : values of its DefineConstant
    unit : length of its unit [m]
    names : of the groups
    sizes : gives, for the rectangle of the geometry, edge lengths that are not to be exceeded
    largest : edge length [m] that is not to be exceeded anywhere

    Raises
    ------
    InvalidInput
        If gmsh finds an error in the file, or what `files.read_triangles` says of its mesh.
    MissingPackage
        If gmsh is not installed.
    """
    gmsh = _gmsh()
    with TemporaryDirectory(prefix="fem-seal-") as folder:
        mesh = Path(folder) / f"{geo.stem}.msh"
        # gmsh keeps the constants of one file for the next of the same process.
        lines = ["Delete Variables;", *(f"{name} = {value!r};" for name, value in numbers.items())]
        start = Path(folder) / "start.geo"
        start.write_text("\n".join([*lines, f'Include "{geo.absolute()}";\n']), encoding="utf-8")
        gmsh.initialize(["gmsh"], readConfigFiles=False)
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            # Errors are read from the log: gmsh would raise them as bare exceptions.
            gmsh.option.setNumber("General.AbortOnError", 0)
            gmsh.logger.start()
            gmsh.open(str(start))
            _refuse_errors(gmsh, geo)
            if largest is not None:
                _refuse_tiny_edges(gmsh, geo, largest / unit)
                gmsh.option.setNumber("Mesh.MeshSizeMax", largest / unit)
            if sizes is not None:
                _set_sizes(gmsh, sizes, unit)
            gmsh.model.mesh.generate(2)
            _refuse_errors(gmsh, geo)
            gmsh.write(str(mesh))
        finally:
            gmsh.logger.stop()
            gmsh.finalize()
        if not mesh.exists():
            raise InvalidInput(f"gmsh has made no mesh of {geo}: does it have a surface?")
        return read_triangles(mesh, unit, names, source=geo)


def _gmsh() -> ModuleType:
    try:
        import gmsh
    except (ModuleNotFoundError, OSError) as error:
        raise MissingPackage(
            f"meshing needs gmsh ({error}); on Debian: apt-get install python3-gmsh, elsewhere: "
            "pip install gmsh"
        ) from None
    return gmsh


def _refuse_errors(gmsh: ModuleType, geo: Path) -> None:
    errors = [line for line in gmsh.logger.get() if line.startswith("Error")]
    if errors:
        text = errors[0].removeprefix("Error").lstrip(" :")
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        raise InvalidInput(f"gmsh cannot mesh {geo}: {text}{more}")


def _refuse_tiny_edges(gmsh: ModuleType, geo: Path, edge: float) -> None:
    """Refuse edges of which gmsh would never see the end."""
    x0, y0, _, x1, y1, _ = gmsh.model.getBoundingBox(-1, -1)
    extent = max(x1 - x0, y1 - y0)
    if edge * MOST_EDGES < extent:
        raise InvalidInput(
            f"mesh_size is {edge / extent:.0e} of the extent of {geo}; choose at least "
            f"{1 / MOST_EDGES:.0e} of it"
        )


def _set_sizes(gmsh: ModuleType, sizes: Sizes, unit: float) -> None:
    x0, y0, _, x1, y1, _ = gmsh.model.getBoundingBox(-1, -1)
    field = sizes(Rectangle(x0 * unit, x1 * unit, y0 * unit, y1 * unit))

    def size(dim: int, tag: int, x: float, y: float, z: float, *given: float) -> float:
        return field(x * unit, y * unit) / unit

    # Newer versions of gmsh also hand over the size they would take.
    gmsh.model.mesh.setSizeCallback(size)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
