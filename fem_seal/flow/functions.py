"""The flow as functions and facet tags on a DOLFINx mesh, for computations in FEniCSx."""

from dataclasses import dataclass

import numpy as np

from fem_seal.fenicsx import (
    MPI,
    MeshTags,
    cell_dofs,
    cell_facets,
    cell_vertices,
    create_triangle_mesh,
    fem,
    functionspace,
    input_cells,
    mesh,
    vector_functionspace,
)
from fem_seal.leak_rate import FacetTag, FlowField


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


def flow_functions(field: FlowField, comm: MPI.Comm = MPI.COMM_WORLD) -> FlowFunctions:
    """Interpolate the fields of a flow onto a DOLFINx mesh.

    Parameters
    ----------
    field : field of `leak_rate(..., field=True)`, the same on every rank
    comm : the ranks over which the mesh is distributed
    """
    msh = create_triangle_mesh(comm, field.points, field.cells)
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
