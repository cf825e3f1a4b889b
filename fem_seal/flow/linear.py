"""The one place that knows PETSc: energies of functions linear on each cell, and their minima.

A problem is an energy E(v) = ∫ ∇v·T·∇v with a constant tensor T on each cell, over functions
v = lift + P x: P is the 0/1 matrix of the numbering (`unknowns.py`). With A the block-diagonal
matrix of E on the discontinuous space, the unknowns solve P'AP x = -P'A lift. CG with BoomerAMG
does it in three to six iterations from the coarser solution at any size, as long as the matrix is
not scaled by its diagonal: that would spoil the constant as near-null vector.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import NotConverged
from fem_seal.fenicsx import (
    MPI,
    PETSc,
    cell_vertices,
    create_triangle_mesh,
    fem,
    functionspace,
    input_cells,
    ufl,
)
from fem_seal.flow.unknowns import Unknowns

MAX_ITERATIONS = 100

# The defaults take as long and up to an iteration more (docs/adaptivity.md).
_BOOMERAMG = {
    "pc_hypre_type": "boomeramg",
    "pc_hypre_boomeramg_coarsen_type": "HMIS",
    "pc_hypre_boomeramg_interp_type": "ext+i",
    "pc_hypre_boomeramg_P_max": 4,
    "pc_hypre_boomeramg_strong_threshold": 0.25,
}


@dataclass(frozen=True, eq=False)
class Minimum:
    """The minimiser of an energy.

    corner_values : (C, 3), of every cell, on every rank
    energy : ∫ ∇v·T·∇v, summed cell by cell (all terms positive)
    iterations : of CG
    """

    corner_values: np.ndarray
    energy: float
    iterations: int


class CellSpace:
    """Functions linear on each of C triangles, on a DOLFINx mesh distributed over the ranks.

    Parameters
    ----------
    points : (V, 2), cells : (C, 3), the same on every rank
    comm : MPI communicator
    """

    def __init__(self, points: np.ndarray, cells: np.ndarray, comm: MPI.Comm):
        self.comm = comm
        self.mesh = create_triangle_mesh(comm, points, cells)
        self.own = input_cells(self.mesh)
        if not np.array_equal(cells[self.own], cell_vertices(self.mesh)):
            raise AssertionError("DOLFINx has reordered the vertices of a cell")
        self.V = functionspace(self.mesh, ("DG", 1))
        self.W = functionspace(self.mesh, ("DG", 0))
        self._corner_dofs = _dofs(self.V, 3)
        self._cell_dofs = _dofs(self.W, 1).ravel()
        self._tensor = [fem.Function(self.W) for _ in range(3)]
        xx, xy, yy = self._tensor
        T = ufl.as_tensor([[xx, xy], [xy, yy]])
        u, v, self._v = ufl.TrialFunction(self.V), ufl.TestFunction(self.V), fem.Function(self.V)
        self._a = fem.form(ufl.inner(ufl.dot(T, ufl.grad(u)), ufl.grad(v)) * ufl.dx)
        one = ufl.TestFunction(self.W)
        grad = ufl.grad(self._v)
        self._cell_energy = fem.form(ufl.inner(ufl.dot(T, grad), grad) * one * ufl.dx)
        self._A = fem.petsc.create_matrix(self._a)
        self._owners = self._owner_of_cells(len(cells))

    def _owner_of_cells(self, count: int) -> np.ndarray:
        owner = np.empty(count, dtype=np.int32)
        for rank, cells in enumerate(self.comm.allgather(self.own)):
            owner[cells] = rank
        return owner

    def function(self, corner_values: np.ndarray) -> fem.Function:
        """The function with given corner values (C, 3)."""
        v = fem.Function(self.V)
        v.x.array[self._corner_dofs] = corner_values[self.own]
        return v

    def coefficient(self, cell_values: np.ndarray) -> fem.Function:
        """The cell-wise constant with given values (C,)."""
        c = fem.Function(self.W)
        c.x.array[self._cell_dofs] = cell_values[self.own]
        return c

    def integrals(self, integrand: ufl.core.expr.Expr) -> np.ndarray:
        """Integral (C,) of an expression over each cell, on every rank."""
        form = fem.form(integrand * ufl.TestFunction(self.W) * ufl.dx)
        vector = fem.petsc.assemble_vector(form)
        values = self._everywhere(vector.array_r[self._cell_dofs])
        vector.destroy()
        return values

    def _everywhere(self, values: np.ndarray) -> np.ndarray:
        """Gather values of own cells (c, ...) into (C, ...) on every rank."""
        whole = np.empty((len(self._owners), *values.shape[1:]))
        for cells, part in self.comm.allgather((self.own, values)):
            whole[cells] = part
        return whole

    def minimise(
        self, tensor: np.ndarray, unknowns: Unknowns, guess: np.ndarray, tolerance: float
    ) -> Minimum:
        """Minimise ∫ ∇v·T·∇v over the functions that `unknowns` describes.

        Parameters
        ----------
        tensor : (C, 3), components xx, xy, yy of T on each cell, in units of its largest
        unknowns : numbering of the corners
        guess : (count,), start
        tolerance : relative error of the energy at which CG stops

        Raises
        ------
        NotConverged
            If CG does not get there; the energy then is still that of an admissible function,
            but the caller's bound would be needlessly wide.
        """
        for component, values in zip(self._tensor, tensor.T, strict=True):
            component.x.array[self._cell_dofs] = values[self.own]
        self._A.zeroEntries()
        fem.petsc.assemble_matrix(self._A, self._a)
        self._A.assemble()
        P, place = self._numbering(unknowns)
        lift = self._corner_vector(unknowns.lift)
        x, residual = P.createVecRight(), P.createVecRight()
        x.array = guess[place]
        y, r = lift.duplicate(), lift.duplicate()
        P.multAdd(x, lift, y)
        start = self._energy(y)
        self._A.mult(y, r)
        P.multTranspose(r, residual)
        residual.scale(-1)
        matrix = self._A.PtAP(P)
        try:
            iterations = _solve(matrix, residual, x, start, tolerance)
            P.multAdd(x, y, r)
            energy = self._energy(r)
            values = self._everywhere(r.array_r[self._corner_dofs])
        finally:
            # petsc4py puts off freeing what is only dropped, and the meshes come and go.
            for thing in (P, matrix, lift, x, y, r, residual):
                thing.destroy()
        return Minimum(values, energy, iterations)

    def close(self) -> None:
        """Free the matrix; nothing more can be minimised."""
        self._A.destroy()

    def _energy(self, values: PETSc.Vec) -> float:
        self._v.x.array[:] = values.array_r
        cells = fem.petsc.assemble_vector(self._cell_energy)
        own = cells.array.sum()
        cells.destroy()
        return float(self.comm.allreduce(own))

    def _corner_vector(self, corner_values: np.ndarray) -> PETSc.Vec:
        vector = self._A.createVecRight()
        vector.array[self._corner_dofs] = corner_values[self.own]
        return vector

    def _numbering(self, unknowns: Unknowns) -> tuple[PETSc.Mat, np.ndarray]:
        """The matrix P, and which unknowns this rank owns in which order."""
        # An unknown belongs to the lowest rank that has a cell of it.
        owner = np.full(unknowns.count, self.comm.size, dtype=np.int32)
        used = unknowns.of_corner >= 0
        owner_of_corner = np.repeat(self._owners[:, None], 3, axis=1)[used]
        np.minimum.at(owner, unknowns.of_corner[used], owner_of_corner)
        order = np.argsort(owner, kind="stable")
        position = np.empty_like(order)
        position[order] = np.arange(unknowns.count)
        place = order[owner[order] == self.comm.rank]
        columns = np.empty(3 * len(self.own), dtype=np.int64)
        columns[self._corner_dofs] = unknowns.of_corner[self.own]
        filled = columns >= 0
        rows = np.concatenate([[0], np.cumsum(filled)]).astype(PETSc.IntType)
        entries = position[columns[filled]].astype(PETSc.IntType)
        sizes = [[len(columns), None], [len(place), unknowns.count]]
        P = PETSc.Mat().createAIJ(sizes, csr=(rows, entries, np.ones(len(entries))), comm=self.comm)
        return P, place


def _dofs(space, per_cell: int) -> np.ndarray:
    dofs = space.dofmap.list
    dofs = dofs if isinstance(dofs, np.ndarray) else dofs.array
    return dofs.reshape(-1, per_cell)


def _solve(
    matrix: PETSc.Mat, right_side: PETSc.Vec, x: PETSc.Vec, start: float, tolerance: float
) -> int:
    """CG for x from zero until the energy r'Mr of the error is `tolerance` of the energy reached.

    Relative residuals would lie: the energy of the start may exceed the minimum a million times.
    In CG the energy after k steps is start - b·x_k, and r'Mr, with M the preconditioner, is the
    energy of the error within a factor of two.
    """
    ksp = PETSc.KSP().create(matrix.comm)
    ksp.setOptionsPrefix("fem_seal_")
    options = PETSc.Options("fem_seal_")
    for name, value in _BOOMERAMG.items():
        options[name] = value
    ksp.setOperators(matrix)
    ksp.setType("cg")
    ksp.setNormType(PETSc.KSP.NormType.NATURAL)
    ksp.getPC().setType("hypre")
    ksp.setFromOptions()
    reached = [np.inf]

    def converged(ksp, iteration, natural_norm):
        energy = start - (right_side.dot(ksp.buildSolution()) if iteration else 0.0)
        reached[0] = natural_norm**2 / energy if energy > 0 else np.inf
        if not np.isfinite(natural_norm):
            return PETSc.KSP.ConvergedReason.DIVERGED_NANORINF
        if natural_norm**2 <= tolerance * energy:
            return PETSc.KSP.ConvergedReason.CONVERGED_RTOL
        if iteration >= MAX_ITERATIONS:
            return PETSc.KSP.ConvergedReason.DIVERGED_MAX_IT
        return PETSc.KSP.ConvergedReason.CONVERGED_ITERATING

    ksp.setConvergenceTest(converged)
    ksp.solve(right_side, x)
    reason, iterations = ksp.getConvergedReason(), ksp.getIterationNumber()
    ksp.destroy()
    if reason <= 0:
        raise NotConverged(
            f"CG with BoomerAMG stopped after {iterations} iterations (PETSc reason {reason}) at "
            f"a relative energy error of {reached[0]:.1e}, wanted {tolerance:.0e}"
        )
    return iterations
