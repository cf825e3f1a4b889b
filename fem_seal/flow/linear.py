"""The one place that knows PETSc: energies of functions linear on each cell, and their minima.

A problem is an energy E(v) = ∫ ∇v·T·∇v with a constant tensor T on each cell, over functions
v = lift + P x: P is the 0/1 matrix of the numbering (`unknowns.py`), never formed. DOLFINx
assembles on the discontinuous space, whose dofs are the corners, and PETSc's map from local to
global rows is the numbering: corners of one unknown add up in its row, prescribed ones are
dropped. CG with BoomerAMG needs a handful of iterations from the coarser solution at any size, as
long as the matrix is not scaled by its diagonal: that would spoil the constant as near-null vector.
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

# What each is worth: docs/adaptivity.md.
_BOOMERAMG = {
    "pc_hypre_type": "boomeramg",
    "pc_hypre_boomeramg_coarsen_type": "PMIS",
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
        self._corner_dofs = cell_dofs(self.V, 3)
        self._cell_dofs = cell_dofs(self.W, 1).ravel()
        self._tensor = [fem.Function(self.W) for _ in range(3)]
        xx, xy, yy = self._tensor
        T = ufl.as_tensor([[xx, xy], [xy, yy]])
        u, v, self._v = ufl.TrialFunction(self.V), ufl.TestFunction(self.V), fem.Function(self.V)
        flux = ufl.dot(T, ufl.grad(self._v))
        self._matrix = fem.form(ufl.inner(ufl.dot(T, ufl.grad(u)), ufl.grad(v)) * ufl.dx)
        self._residual = fem.form(ufl.inner(flux, ufl.grad(v)) * ufl.dx)
        # The cells of every rank, one rank after the other.
        self._of_ranks = comm.allgather(self.own)

    @property
    def count(self) -> int:
        """Number of cells, of all ranks."""
        return sum(len(cells) for cells in self._of_ranks)

    def minimise(
        self,
        tensor: np.ndarray,
        unknowns: Unknowns,
        guess: np.ndarray,
        tolerance: float,
        balanced: bool = False,
    ) -> Minimum:
        """Minimise ∫ ∇v·T·∇v over the functions that `unknowns` describes.

        Parameters
        ----------
        tensor : (C, 3), components xx, xy, yy of T on each cell
        unknowns : numbering of the corners
        guess : (count,), start
        tolerance : relative error of the energy at which CG stops
        balanced : ask too that the residuals add up to no more than the root of `tolerance` times
            the energy: of a pressure they are what flows in and not out

        Raises
        ------
        NotConverged
            If CG does not get there; the energy then is still that of an admissible function,
            but the caller's bound would be needlessly wide.
        """
        for component, values in zip(self._tensor, tensor.T, strict=True):
            component.x.array[self._cell_dofs] = values[self.own]
        rows = _Rows.of(unknowns, self._of_ranks)
        start, residual = self._energy_and_residual(unknowns.corners(guess), unknowns, rows)
        matrix = self._assembled(unknowns, rows)
        x, right_side = matrix.createVecs()
        right_side.array = -residual
        try:
            iterations = minimise_by_cg(matrix, right_side, x, start, tolerance, balanced)
            correction = np.concatenate(self.comm.allgather(x.array_r))
        finally:
            # petsc4py puts off freeing what is only dropped, and the meshes come and go.
            for thing in (matrix, x, right_side):
                thing.destroy()
        found = unknowns.corners(guess + correction[rows.of_unknown])
        return Minimum(found, self._energy_and_slopes(found)[0], iterations)

    def _energy_and_slopes(self, corner_values: np.ndarray) -> tuple[float, np.ndarray]:
        """Energy, and its half derivative (c, 3) by the corner values of the cells of this rank."""
        v = corner_values[self.own]
        # Only differences matter on a cell, and without the rest they keep all their digits.
        v -= v[:, :1].copy()
        self._v.x.array[self._corner_dofs] = v
        slopes = _assembled(self._residual)[self._corner_dofs]
        return float(self.comm.allreduce((v * slopes).sum())), slopes

    def _energy_and_residual(
        self, corner_values: np.ndarray, unknowns: Unknowns, rows: "_Rows"
    ) -> tuple[float, np.ndarray]:
        """Energy, and its half derivative by the unknowns in the rows of this rank."""
        energy, of_corner = self._energy_and_slopes(corner_values)
        number = unknowns.of_corner[self.own]
        used = number >= 0
        of_unknown = np.bincount(number[used], of_corner[used], unknowns.count)
        by_row = np.empty_like(of_unknown)
        by_row[rows.of_unknown] = self.comm.allreduce(of_unknown)
        return energy, by_row[rows.first[self.comm.rank] : rows.first[self.comm.rank + 1]]

    def _assembled(self, unknowns: Unknowns, rows: "_Rows") -> PETSc.Mat:
        """The matrix of the unknowns."""
        rank, count = self.comm.rank, unknowns.count
        begin, end = rows.first[rank], rows.first[rank + 1]
        # Each corner of an unknown brings two neighbours at most.
        most = np.empty(count, dtype=PETSc.IntType)
        corners = np.bincount((unknowns.of_corner + 1).ravel(), minlength=count + 1)[1:]
        most[rows.of_unknown] = 2 * corners + 1
        most, own = most[begin:end], end - begin
        matrix = PETSc.Mat().createAIJ(
            ((own, count), (own, count)),
            nnz=(np.minimum(most, own), np.minimum(most, count - own)),
            comm=self.comm,
        )
        # A rank without rows would else take another path through the assembly, and all would wait.
        matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, True)
        row_of_corner = np.append(rows.of_unknown, -1)[unknowns.of_corner[self.own]]
        of_dof = np.empty(3 * len(self.own), dtype=PETSc.IntType)
        of_dof[self._corner_dofs] = row_of_corner
        numbering = PETSc.LGMap().create(of_dof, comm=self.comm)
        matrix.setLGMap(numbering, numbering)
        fem.petsc.assemble_matrix(matrix, self._matrix)
        matrix.assemble()
        numbering.destroy()
        # The copy has room for what is in it and no more.
        compact = matrix.duplicate(copy=True)
        matrix.destroy()
        return compact


@dataclass(frozen=True, eq=False)
class _Rows:
    """Rows of the matrix, numbered as the cells of the ranks come to meet the unknowns.

    DOLFINx sorts the cells so that neighbours are close in memory, and so will be the unknowns.

    of_unknown : (count,) int, row of each unknown
    first : ranks + 1 numbers, first row of each rank: an unknown belongs to the first rank with a
        cell of it
    """

    of_unknown: np.ndarray
    first: list[int]

    @classmethod
    def of(cls, unknowns: Unknowns, of_ranks: list[np.ndarray]) -> "_Rows":
        corners = unknowns.of_corner[np.concatenate(of_ranks)].ravel()
        met_at = np.empty(unknowns.count + 1, dtype=np.int64)
        # Written backwards, what stays is the first place; prescribed corners (-1) share the last.
        met_at[corners[::-1]] = np.arange(len(corners) - 1, -1, -1)
        new = np.zeros(len(corners), dtype=bool)
        new[met_at[:-1]] = True
        met_before = np.append(0, np.cumsum(new))
        ends = 3 * np.cumsum([0, *(len(cells) for cells in of_ranks)])
        return cls(met_before[met_at[:-1]], met_before[ends].tolist())


def _assembled(form) -> np.ndarray:
    """Vector of a linear form on a discontinuous space: no dof is shared."""
    vector = fem.petsc.assemble_vector(form)
    values = vector.array.copy()
    vector.destroy()
    return values


def cell_dofs(space, per_cell: int) -> np.ndarray:
    """(c, per_cell) int, degrees of freedom of each cell of this rank."""
    dofs = space.dofmap.list
    dofs = dofs if isinstance(dofs, np.ndarray) else dofs.array
    return dofs.reshape(-1, per_cell)


def minimise_by_cg(
    matrix: PETSc.Mat,
    right_side: PETSc.Vec,
    x: PETSc.Vec,
    start: float,
    tolerance: float,
    balanced: bool = False,
) -> int:
    """CG for x from zero until the energy r'Mr of the error is `tolerance` of the energy reached.

    Parameters
    ----------
    matrix, right_side : of the correction to a start
    x : where the solution goes
    start : energy of the start
    tolerance, balanced : as in `CellSpace.minimise`

    Returns
    -------
    Number of iterations.

    Raises
    ------
    NotConverged
        If CG does not get there.

    Notes
    -----
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
        if natural_norm**2 <= tolerance * energy and (
            not balanced or abs(ksp.buildResidual().sum()) <= np.sqrt(tolerance) * energy
        ):
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
