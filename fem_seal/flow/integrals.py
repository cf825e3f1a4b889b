"""Energies ∫ ∇v·T·∇v (`forms.py`) of functions linear on triangles, one batch after the other.

The functions may jump between cells, so that no cell needs its neighbours: DOLFINx integrates on
one small mesh of triangles that share no vertex, and that mesh is moved over the cells of any
other. A DOLFINx mesh of all cells would take more memory than everything else, and more time than
the integration.
"""

from functools import cache

import numpy as np

from fem_seal.fenicsx import (
    MPI,
    PETSc,
    cell_dofs,
    create_triangle_mesh,
    fem,
    functionspace,
    geometry_dofs,
    ufl,
)
from fem_seal.flow.forms import reynolds

AT_ONCE = 1 << 12  # cells of a batch


class Batch:
    """Triangles on which DOLFINx integrates; `place` moves them onto cells of another mesh."""

    def __init__(self) -> None:
        corners = np.tile([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], (AT_ONCE, 1))
        cells = np.arange(3 * AT_ONCE).reshape(-1, 3)
        self._mesh = create_triangle_mesh(MPI.COMM_SELF, corners, cells)
        # intp, so that NumPy need not convert the indices on every use.
        self._points = geometry_dofs(self._mesh).astype(np.intp)
        V, W = functionspace(self._mesh, ("DG", 1)), functionspace(self._mesh, ("DG", 0))
        self._corner_dofs = cell_dofs(V, 3).astype(np.intp)
        self._cell_dofs = cell_dofs(W, 1).ravel().astype(np.intp)
        self._tensor = [fem.Function(W) for _ in range(3)]
        xx, xy, yy = self._tensor
        T = ufl.as_tensor([[xx, xy], [xy, yy]])
        u, v, self._v = ufl.TrialFunction(V), ufl.TestFunction(V), fem.Function(V)
        self._matrix = fem.form(reynolds(u, v, T))
        self._slopes = fem.form(reynolds(self._v, v, T))
        self._vector = fem.petsc.assemble_vector(self._slopes)

    def place(self, corners: np.ndarray, tensor: np.ndarray) -> None:
        """Move the triangles onto n ≤ AT_ONCE cells with corners (n, 3, 2).

        `tensor` (n, 3) has the components xx, xy, yy of T, which is 0 on the remaining triangles.
        """
        n = len(corners)
        # Assign x and y separately: both at once would take three times as long.
        for axis, x in enumerate(self._mesh.geometry.x.T[:2]):
            x[self._points[:n]] = corners[..., axis]
        for component, values in zip(self._tensor, tensor.T, strict=True):
            component.x.array[self._cell_dofs[:n]] = values
            component.x.array[self._cell_dofs[n:]] = 0.0

    def slopes(self, corner_values: np.ndarray) -> np.ndarray:
        """Half the derivative (n, 3) of the energy by the corner values (n, 3)."""
        dofs = self._corner_dofs[: len(corner_values)]
        self._v.x.array[dofs] = corner_values
        self._vector.set(0)
        fem.petsc.assemble_vector(self._vector, self._slopes)
        return self._vector.array_r[dofs]

    def add_to(self, matrix: PETSc.Mat, rows: np.ndarray) -> None:
        """Add the energy to a matrix; rows (n, 3) of the corners, -1 for a prescribed value.

        All ranks of the matrix must call this together.
        """
        of_dof = np.full(self._corner_dofs.size, -1, dtype=PETSc.IntType)
        of_dof[self._corner_dofs[: len(rows)]] = rows
        numbering = PETSc.LGMap().create(of_dof, comm=matrix.comm)
        matrix.setLGMap(numbering, numbering)
        fem.petsc.assemble_matrix(matrix, self._matrix)
        numbering.destroy()


@cache
def batch() -> Batch:
    """The one batch of this process."""
    return Batch()
