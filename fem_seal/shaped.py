"""From the [shape] section of a scene to a mesh with a gap."""

from collections.abc import Callable
from functools import partial

from fem_seal.errors import present
from fem_seal.field_file.recorded import in_si
from fem_seal.film.mesh_film import MeshFilm
from fem_seal.grid import GridField
from fem_seal.mesh.checks import labelled
from fem_seal.mesh.files import GroupNames, Triangles, read_triangles
from fem_seal.mesh.gap_source import (
    CartesianGrid,
    Formula,
    GapSource,
    PolarGrid,
    UniformGap,
    channel_sizes,
)
from fem_seal.mesh.geometry import SOURCES, mesh_geometry
from fem_seal.mesh.shape import shape_mesh
from fem_seal.scene.shape import AnyShape, MeshFile, Shape


def shaped_film(shape: AnyShape, grid: GridField | None, *, trust: bool = False) -> MeshFilm:
    """Mesh a shape and interpolate its gap; `trust` lets gmsh run any .geo file.

    The grid has the samples of the gap, if the section gives neither a number nor a formula.
    """
    source = gap_source(shape, grid)
    triangles = _triangles(shape, source, trust)
    name = shape.path.name if isinstance(shape, MeshFile) else shape.kind
    mesh = shape_mesh(*labelled(triangles, name))
    return MeshFilm(mesh, source(mesh.xy))


def gap_source(shape: Shape, grid: GridField | None) -> GapSource:
    """Gap of a shape as a function of position; arguments as in `shaped_film`."""
    if shape.gap is not None:
        return UniformGap(shape.gap)
    if shape.gap_expression is not None:
        return Formula(shape.gap_expression, shape.middle_angle)
    return GRIDS[shape.grid](present(grid, "grid of the gap"), shape.grid_origin)


GRIDS: dict[str, Callable[[GridField, tuple[float, float]], GapSource]] = {
    "cartesian": CartesianGrid.of,
    "polar": PolarGrid.of,
}


def _triangles(shape: AnyShape, source: GapSource, trust: bool) -> Triangles:
    sizes = None
    if shape.smallest_size is not None:
        largest = present(shape.mesh_size, "shape.mesh_size")
        sizes = partial(channel_sizes, source, smallest=shape.smallest_size, largest=largest)
    if not isinstance(shape, MeshFile):
        geometry = SOURCES / f"{shape.kind}.geo"
        return mesh_geometry(geometry, shape.numbers(), 1.0, GroupNames(), sizes)
    unit = in_si(shape.unit, "m", "lengths of the mesh")
    names = GroupNames(shape.inlet, shape.outlet, shape.wall)
    if shape.needs_gmsh:
        return mesh_geometry(shape.path, {}, unit, names, sizes, shape.mesh_size, trust=trust)
    return read_triangles(shape.path, unit, names)
