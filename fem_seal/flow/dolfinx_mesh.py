"""Exchange with DOLFINx: a film from its mesh and functions, a flow as its functions."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from fem_seal import parallel
from fem_seal.errors import InvalidInput
from fem_seal.fenicsx import (
    MeshTags,
    cell_dofs,
    cell_facets,
    cell_vertices,
    create_triangle_mesh,
    fem,
    functionspace,
    geometry_dofs,
    input_cells,
    is_linear,
    mesh,
    vector_functionspace,
)
from fem_seal.film import MeshFilm
from fem_seal.leak_rate import FacetTag, FlowField
from fem_seal.mesh.mesh import ends_of_sides

SOURCE = "the DOLFINx mesh"


def film_from_dolfinx(
    msh: mesh.Mesh,
    facet_tags: MeshTags,
    gap: fem.Function,
    inlet: int | Collection[int] = FacetTag.INLET,
    outlet: int | Collection[int] = FacetTag.OUTLET,
    wall: int | Collection[int] = FacetTag.WALL,
) -> MeshFilm:
    """Film on a DOLFINx mesh, for `leak_rate` and all else that takes a film.

    All ranks of the mesh must call this together; each gets the whole film.

    Parameters
    ----------
    msh : dolfinx.mesh.Mesh
        Straight triangles in a plane [m].
    facet_tags : dolfinx.mesh.MeshTags
        Tags of the edges, such as `gmsh` gives for physical curves. Edges inside the mesh may have
        other tags.
    gap : dolfinx.fem.Function
        Continuous and linear (P1) on this mesh [m], exactly 0 in contact.
    inlet, outlet, wall
        One or several tags of the edges on the inlet, the outlet and the walls; each edge of the
        boundary has one.

    Raises
    ------
    InvalidInput
        If the mesh is not of straight triangles in a plane, the gap is not P1 on it or negative, an
        edge of the boundary has no tag, inlet or outlet have no edge, or `shape_mesh` rejects the
        shape.
    """
    # Imported here: no other film needs the modules that check and cut a mesh.
    from fem_seal.mesh.checks import labelled
    from fem_seal.mesh.files import Triangles, plane_points
    from fem_seal.mesh.shape import shape_mesh_with_values

    _require_gap_on(msh, gap)
    if facet_tags.dim != 1:
        raise InvalidInput(
            f"the facet tags are tags of dimension {facet_tags.dim}; give those of the edges"
        )
    vertices, points, values, edges, tags = _gathered(msh, facet_tags, gap)
    # Sort vertices by position and cells by vertices: the film is the same on any number of ranks.
    _, first, number = np.unique(vertices, return_index=True, return_inverse=True)
    xyz, at_vertex = points.reshape(-1, 3)[first], values.ravel()[first]
    order = np.lexsort(xyz.T[::-1])
    place = np.argsort(order)
    xyz, at_vertex, edges = xyz[order], at_vertex[order], place[edges]
    cells = np.unique(np.sort(place[number].reshape(-1, 3), axis=1), axis=0)
    xy = plane_points(SOURCE, xyz, cells)
    groups = {}
    for name, numbers in (("inlet", inlet), ("outlet", outlet), ("wall", wall)):
        several = [*numbers] if isinstance(numbers, Collection) else [numbers]
        groups[name] = edges[np.isin(tags, several)]
        if name != "wall" and not len(groups[name]):
            known = ", ".join(map(str, np.unique(tags))) or "none"
            raise InvalidInput(
                f"{SOURCE} has no {name}: no facet has the tag {numbers}; its tags are {known}"
            )
    triangles = Triangles(xy, cells, **groups)
    parts = labelled(triangles, SOURCE)
    return MeshFilm(*shape_mesh_with_values(*parts, at_vertex))


def _require_gap_on(msh: mesh.Mesh, gap: fem.Function) -> None:
    """Raise InvalidInput unless the gap is P1 on straight triangles of this mesh."""
    if gap.function_space.mesh is not msh:
        raise InvalidInput("the gap is a function on another mesh; give it on the mesh of the film")
    if msh.topology.cell_type != mesh.CellType.triangle:
        raise InvalidInput(
            f"{SOURCE} has cells of type {msh.topology.cell_type.name}; a film needs triangles"
        )
    if not is_linear(gap):
        raise InvalidInput(
            "the gap is not linear on straight triangles; interpolate it into a space "
            '("Lagrange", 1) on a mesh of degree 1'
        )


def _gathered(msh: mesh.Mesh, facet_tags: MeshTags, gap: fem.Function) -> list[np.ndarray]:
    """Cells and tagged edges of all ranks, vertices by their number in the whole mesh.

    Returns vertices (C, 3) of the cells, points (C, 3, 3) [m] and gap (C, 3) [m] at the corners,
    vertices (n, 2) of the tagged edges, and their tags (n,).
    """
    gap.x.scatter_forward()
    dofmap, facets = gap.function_space.dofmap, cell_facets(msh)
    count = dofmap.index_map.size_local + dofmap.index_map.num_ghosts
    # The degrees of freedom of P1 are the vertices.
    in_whole = dofmap.index_map.local_to_global(np.arange(count, dtype=np.int32))
    dofs = cell_dofs(gap.function_space, 3)
    vertices = in_whole[dofs].astype(np.int64)
    tagged = np.isin(facets, facet_tags.indices)
    tags = facet_tags.values[np.searchsorted(facet_tags.indices, facets[tagged])]
    edges = np.sort(ends_of_sides(vertices)[tagged], axis=1)
    # Send each cell once, from the rank that owns it, but the tagged edges of ghost cells too:
    # perhaps only one of the ranks knows the tag.
    own = slice(msh.topology.index_map(2).size_local)
    cells = vertices[own], msh.geometry.x[geometry_dofs(msh)[own]], gap.x.array[dofs[own]]
    parts = msh.comm.allgather((*cells, np.column_stack([edges, tags])))
    *whole, rows = (np.concatenate(part) for part in zip(*parts, strict=True))
    rows = np.unique(rows, axis=0)
    return [*whole, rows[:, :2], rows[:, 2]]


@dataclass(frozen=True, eq=False)
class FlowFunctions:
    """The flow of a `FlowField` as DOLFINx functions."""

    #: mesh of the cells that carry flow, parted along contact lines
    mesh: mesh.Mesh
    gap: fem.Function  #: gap, linear [m]
    pressure: fem.Function  #: pressure, linear [Pa]
    flux: fem.Function  #: flow density, constant on each cell [m²/s]
    #: `FacetTag` of every exterior facet; None if the field has none.
    #: The pressure on opposite facets of a SEAM is the same, but the mesh does not join them
    facet_tags: MeshTags | None


def flow_functions(field: FlowField, comm: parallel.Comm = None) -> FlowFunctions:
    """Interpolate the fields of a flow onto a DOLFINx mesh.

    Parameters
    ----------
    field
        Field of a `leak_rate` whose settings have `field=True`, the same on every rank.
    comm
        The ranks over which the mesh is distributed; all of this run if left out.
    """
    msh = create_triangle_mesh(parallel.communicator(comm), field.points, field.cells)
    linear = functionspace(msh, ("Lagrange", 1))
    vertices, dofs = cell_vertices(msh), cell_dofs(linear, 3)
    gap, pressure = fem.Function(linear, name="gap"), fem.Function(linear, name="pressure")
    gap.x.array[dofs], pressure.x.array[dofs] = field.gap[vertices], field.pressure[vertices]
    flux = fem.Function(vector_functionspace(msh, ("DG", 0)), name="flux")
    of_cell = cell_dofs(flux.function_space, 1)
    flux.x.array.reshape(-1, 2)[of_cell[:, 0]] = field.flux[input_cells(msh)]
    for function in (gap, pressure, flux):
        function.x.scatter_forward()
    tags = None if field.facet_tags is None else _mesh_tags(msh, field.facet_tags)
    return FlowFunctions(msh, gap, pressure, flux, tags)


def _mesh_tags(msh: mesh.Mesh, tags: np.ndarray) -> MeshTags:
    """MeshTags of the exterior facets, from the tags (C, 3) of all cells of the field."""
    facets, own = cell_facets(msh), tags[input_cells(msh)]
    exterior = own != FacetTag.INSIDE
    facet, first = np.unique(facets[exterior], return_index=True)
    return mesh.meshtags(msh, 1, facet.astype(np.int32), own[exterior][first].astype(np.int32))
