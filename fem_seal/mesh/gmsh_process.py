"""What gmsh does in a process of its own, which `geometry.mesh_geometry` starts."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

from fem_seal.errors import InvalidInput

MESH_FILE, SOURCE_FILE, START_FILE = "mesh.msh", "source.geo", "start.geo"
MOST_EDGES = 1e5  # largest number of edges along the longer side


@dataclass(frozen=True)
class Box:
    """Bounding box of a geometry."""

    x0: float  #: ends along x and y [m]
    x1: float
    y0: float
    y1: float


@dataclass(frozen=True, eq=False)
class SizeField:
    """Largest edge lengths on a rectangular raster, bilinear between its points."""

    sizes: np.ndarray  #: (nx, ny), edge lengths [m], at least 2 × 2
    #: point (x0, y0) of sizes[0, 0], and distances (dx, dy) of the points [m]
    origin: tuple[float, float]
    spacing: tuple[float, float]

    def __call__(self, x: float, y: float) -> float:
        """Edge length [m] at a point, extended constantly beyond the raster."""
        nx, ny = self.sizes.shape
        s = min(max((x - self.origin[0]) / self.spacing[0], 0.0), nx - 1.0)
        t = min(max((y - self.origin[1]) / self.spacing[1], 0.0), ny - 1.0)
        i, j = min(int(s), nx - 2), min(int(t), ny - 2)
        s, t = s - i, t - j
        a, b, c, d = self.sizes[i : i + 2, j : j + 2].ravel().tolist()
        return (1 - s) * ((1 - t) * a + t * b) + s * ((1 - t) * c + t * d)


Sizes = Callable[[Box], SizeField]


@dataclass(frozen=True)
class Job:
    """One geometry to mesh."""

    path: str  #: the .geo file, named in messages
    #: text of one of the package's own sources, which is run in place of the file; None runs the
    #: file
    content: bytes | None
    numbers: Mapping[str, float]  #: values of the constants of `content` by name
    unit: float  #: unit of length of the geometry [m]
    sizes: Sizes | None  #: largest edge lengths by position
    largest: float | None  #: largest edge length anywhere [m]


def triangulate(job: Job, folder: Path) -> None:
    """Mesh a job's geometry into MESH_FILE of a folder, in which the process works from now on."""
    import gmsh

    os.chdir(folder)
    gmsh.initialize(["gmsh"], readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    # Errors are read from the log: gmsh would raise them as bare exceptions.
    gmsh.option.setNumber("General.AbortOnError", 0)
    gmsh.logger.start()
    gmsh.open(str(_start(job, folder)))
    _refuse_errors(gmsh, job.path)
    if job.largest is not None:
        _refuse_tiny_edges(gmsh, job.path, job.largest / job.unit)
        gmsh.option.setNumber("Mesh.MeshSizeMax", job.largest / job.unit)
    if job.sizes is not None:
        _set_sizes(gmsh, job.sizes, job.unit)
    gmsh.model.mesh.generate(2)
    _refuse_errors(gmsh, job.path)
    gmsh.write(str(folder / MESH_FILE))


def _start(job: Job, folder: Path) -> Path:
    """File that gmsh opens: the user's, or one that sets constants and includes `content`."""
    if job.content is None:
        return Path(job.path)
    (folder / SOURCE_FILE).write_bytes(job.content)
    lines = [*(f"{name} = {value!r};" for name, value in job.numbers.items())]
    (folder / START_FILE).write_text("\n".join([*lines, f'Include "{SOURCE_FILE}";\n']))
    return folder / START_FILE


def _refuse_errors(gmsh: ModuleType, geo: str) -> None:
    errors = [line for line in gmsh.logger.get() if line.startswith("Error")]
    if errors:
        text = errors[0].removeprefix("Error").lstrip(" :")
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        raise InvalidInput(f"gmsh cannot mesh {geo}: {text}{more}")


def _refuse_tiny_edges(gmsh: ModuleType, geo: str, edge: float) -> None:
    """Refuse edges so small that gmsh would never finish."""
    x0, y0, _, x1, y1, _ = gmsh.model.getBoundingBox(-1, -1)
    extent = max(x1 - x0, y1 - y0)
    if edge * MOST_EDGES < extent:
        raise InvalidInput(
            f"mesh_size is {edge / extent:.0e} of the extent of {geo}; choose at least "
            f"{1 / MOST_EDGES:.0e} of it"
        )


def _set_sizes(gmsh: ModuleType, sizes: Sizes, unit: float) -> None:
    x0, y0, _, x1, y1, _ = gmsh.model.getBoundingBox(-1, -1)
    field = sizes(Box(x0 * unit, x1 * unit, y0 * unit, y1 * unit))

    # Newer versions of gmsh also pass the size that they would take.
    def size(dim: int, tag: int, x: float, y: float, z: float, *own: float) -> float:
        return field(x * unit, y * unit) / unit

    gmsh.model.mesh.setSizeCallback(size)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
