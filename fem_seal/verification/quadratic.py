"""Quadratic elements on the pixel mesh: another upper bound, to compare with linear elements.

∫K|∇p|² of a continuous piecewise quadratic p, K = g³. UFL chooses the degree of the quadrature, 3
for K and 1 for each of the gradients, so that it is exact. Where the gap is smooth this energy
converges at order 4 in the spacing, that of linear elements at order 2.

It runs in one process, and needs gaps whose conductivities do not differ by more than the digits of
double precision.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from fem_seal.errors import present
from fem_seal.fenicsx import (
    MPI,
    cell_dofs,
    cell_vertices,
    create_triangle_mesh,
    fem,
    functionspace,
    input_cells,
    ufl,
)
from fem_seal.film import GridFilm, film_conductivity
from fem_seal.flow.forms import energy, reynolds
from fem_seal.flow.gap_on_mesh import REPRESENTATIONS
from fem_seal.flow.linear import by_multigrid
from fem_seal.flow.marking import Tuning
from fem_seal.flow.numbering import Numbering
from fem_seal.flow.topology import OpenCells, open_cells, primal_numbering
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.mesh.nested import PIXEL, uniform_mesh

METHOD = "quadratic"
TOLERANCE = 1e-8  # of the pressure; the energy errs by its square


@dataclass(frozen=True, eq=False)
class _NodeNumbering:
    """Unknowns of the six nodes of each cell: three corners and the opposite midpoints."""

    of_node: np.ndarray  #: (C, 6) int, unknown of each node, or -1 where the pressure is prescribed
    prescribed: np.ndarray  #: (C, 6), prescribed pressure; 0 at nodes with an unknown
    count: int  #: number of unknowns


def quadratic_upper(film: GridFilm, *, viscosity: float, pressure_drop: float) -> LeakRate:
    """Upper bound of the leak rate by quadratic elements on the pixel mesh; the lower one is 0."""
    if film.sealed:
        return LeakRate.sealed(METHOD)
    gap, highest, tuning = film.gap, film.highest, Tuning()
    scaled = GridField(gap.values / highest, gap.spacing, gap.periodic)
    narrowest = present(film.constriction, "constriction").gap / highest
    represented = REPRESENTATIONS[film.representation](
        scaled, tuning.cut * narrowest, tuning.floor * narrowest, 1
    )
    mesh = uniform_mesh(represented.squares, 1, film.sides == "periodic")
    values = represented.vertex_values(mesh)
    data = represented.cell_data(mesh, values)
    cells = open_cells(mesh, data)
    numbering = _numbered(primal_numbering(mesh, data, cells), cells)
    triangles = mesh.cells[cells.kept]
    # A gap that is constant on each cell has no vertex values: use the cube root of K.
    corners = values[triangles][..., 0] if values.size else np.cbrt(data.K[cells.kept])[:, None]
    least = _least_energy(
        mesh.xy / PIXEL * represented.aspect,
        triangles,
        np.broadcast_to(corners, triangles.shape),
        numbering,
    )
    upper = least * film_conductivity(highest, viscosity) * pressure_drop
    return LeakRate("leaking", METHOD, upper, 0.0, upper, unknowns=numbering.count)


def _numbered(corners: Numbering, cells: OpenCells) -> _NodeNumbering:
    """Add an unknown for each side; the two cells at a zero-gap side have one each."""
    slots = np.arange(3 * len(cells.kept))
    slots[cells.pairs[:, 1]] = cells.pairs[:, 0]
    prescribed = np.full(len(slots), np.nan)
    prescribed[cells.inlet], prescribed[cells.outlet] = 1.0, 0.0
    slots, prescribed = (array.reshape(-1, 3)[cells.kept] for array in (slots, prescribed))
    of_side = np.full(slots.shape, -1)
    free, number = np.unique(slots[np.isnan(prescribed)], return_inverse=True)
    of_side[np.isnan(prescribed)] = corners.count + number
    return _NodeNumbering(
        np.concatenate([corners.of_corner, of_side], axis=1),
        np.concatenate([corners.offset, np.nan_to_num(prescribed)], axis=1),
        corners.count + len(free),
    )


def _least_energy(
    points: np.ndarray, cells: np.ndarray, gap: np.ndarray, numbering: _NodeNumbering
) -> float:
    """Minimum of ∫g³|∇p|² over the quadratic functions of a numbering; gap (C, 3) at corners."""
    msh = create_triangle_mesh(MPI.COMM_SELF, points, cells)
    own = input_cells(msh)
    if not np.array_equal(cells[own], cell_vertices(msh)):
        raise AssertionError("DOLFINx has reordered the vertices of a cell")
    V, W = functionspace(msh, ("DG", 2)), functionspace(msh, ("DG", 1))
    g, p = fem.Function(W), fem.Function(V)
    g.x.array[cell_dofs(W, 3)] = gap[own]
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    A = fem.petsc.assemble_matrix(fem.form(reynolds(u, v, g**3)))
    A.assemble()
    form = fem.form(energy(p, g**3))
    nodes, size = cell_dofs(V, 6), 6 * len(cells)
    indptr, indices, entries = A.getValuesCSR()
    matrix = csr_array((entries, indices, indptr), shape=(size, size))
    free = numbering.of_node[own] >= 0
    ones = np.ones(np.count_nonzero(free))
    places = nodes[free], numbering.of_node[own][free]
    P = csr_array((ones, places), shape=(size, numbering.count))
    p.x.array[nodes] = numbering.prescribed[own]
    load = -(P.T @ (matrix @ p.x.array))
    p.x.array[:] += P @ by_multigrid(csr_array(P.T @ matrix @ P))(load, TOLERANCE)
    A.destroy()
    return float(fem.assemble_scalar(form))
