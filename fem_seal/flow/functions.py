"""The flow as functions on a DOLFINx mesh, for whoever wants to go on with it in FEniCSx."""

from dataclasses import dataclass

from fem_seal.fenicsx import (
    MPI,
    cell_dofs,
    cell_vertices,
    create_triangle_mesh,
    fem,
    functionspace,
    input_cells,
    vector_functionspace,
)
from fem_seal.leak_rate import FlowField


@dataclass(frozen=True, eq=False)
class FlowFunctions:
    """What a leak rate keeps of its last mesh, in the hands of DOLFINx.

    mesh : dolfinx.mesh.Mesh of the cells that carry flow, parted along contact lines
    gap : dolfinx.fem.Function, linear [m]
    pressure : dolfinx.fem.Function, linear [Pa]
    flux : dolfinx.fem.Function, a constant vector on each cell [m^2/s]
    """

    mesh: object
    gap: fem.Function
    pressure: fem.Function
    flux: fem.Function


def flow_functions(field: FlowField, comm: MPI.Comm = MPI.COMM_WORLD) -> FlowFunctions:
    """Interpolate the fields of a flow onto a DOLFINx mesh.

    Parameters
    ----------
    field : from `leak_rate(..., field=True).field`, the same on every rank
    comm : the ranks over which the mesh is distributed
    """
    mesh = create_triangle_mesh(comm, field.points, field.cells)
    linear = functionspace(mesh, ("Lagrange", 1))
    vertices, dofs = cell_vertices(mesh), cell_dofs(linear, 3)
    gap, pressure = fem.Function(linear, name="gap"), fem.Function(linear, name="pressure")
    gap.x.array[dofs], pressure.x.array[dofs] = field.gap[vertices], field.pressure[vertices]
    flux = fem.Function(vector_functionspace(mesh, ("DG", 0)), name="flux")
    of_cell = cell_dofs(flux.function_space, 1)
    flux.x.array.reshape(-1, 2)[of_cell[:, 0]] = field.flux[input_cells(mesh)]
    for function in (gap, pressure, flux):
        function.x.scatter_forward()
    return FlowFunctions(mesh, gap, pressure, flux)
