"""Solver of a sparse matrix on one process, by CG with algebraic multigrid (PETSc)."""

from collections.abc import Callable
from weakref import finalize

import numpy as np
from scipy import sparse

from fem_seal.fenicsx import PETSc
from fem_seal.finite_difference.film_pressure import eliminated
from fem_seal.flow.linear import preconditioned_cg

MOST_ITERATIONS = 200


def by_multigrid(matrix: sparse.csr_array) -> Callable[[np.ndarray, float], np.ndarray]:
    """Solver (right side, relative tolerance) -> solution of a symmetric positive matrix.

    CG stops by the norm of the preconditioned residual, which is about that of the error: pockets
    that hardly conduct count as much as the channels.
    """
    index = PETSc.IntType
    rows = matrix.indptr.astype(index), matrix.indices.astype(index), matrix.data
    whole = PETSc.Mat().createAIJ(matrix.shape, csr=rows, comm=PETSc.COMM_SELF)
    solver = preconditioned_cg(whole)
    solver.setNormType(PETSc.KSP.NormType.PRECONDITIONED)
    x, b = whole.createVecs()

    def solve(right_side: np.ndarray, tolerance: float) -> np.ndarray:
        b.setArray(right_side)
        solver.setTolerances(rtol=tolerance, atol=0.0, max_it=MOST_ITERATIONS)
        solver.solve(b, x)
        if solver.getConvergedReason() > 0:
            return x.array_r.copy()
        # CG breaks down at conductances over more decades than double precision has digits.
        return eliminated(matrix)(right_side, tolerance)

    # Free the memory with the function: petsc4py would defer it.
    finalize(solve, _destroy, solver, whole, x, b).atexit = False
    return solve


def _destroy(*petsc_objects: PETSc.Object) -> None:
    for one in petsc_objects:
        one.destroy()
