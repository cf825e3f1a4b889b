"""A solver of the matrices of the lift's network: CG with the multigrid of PETSc."""

from weakref import finalize

import numpy as np
from scipy import sparse

from fem_seal.fenicsx import PETSc
from fem_seal.flow.linear import MAX_ITERATIONS, destroy, preconditioned_cg
from fem_seal.network.film_pressure import Solve, eliminated
from fem_seal.progress import NOTE, Report, silent


def by_multigrid(matrix: sparse.csr_array, report: Report = silent) -> Solve:
    """Solver (right side, relative tolerance) -> solution of a symmetric positive matrix.

    CG stops by the norm of the preconditioned residual, which is about that of the error: pockets
    that hardly conduct count as much as the channels. CG breaks down at conductances over more
    decades than double precision has digits; elimination takes its place then, and the user is
    told. The iterations and the residual of each solve are reported.
    """
    index = PETSc.IntType
    rows = matrix.indptr.astype(index), matrix.indices.astype(index), matrix.data
    whole = PETSc.Mat().createAIJ(matrix.shape, csr=rows, comm=PETSc.COMM_SELF)
    solver = preconditioned_cg(whole)
    solver.setNormType(PETSc.KSP.NormType.PRECONDITIONED)
    solver.setConvergenceHistory(reset=True)
    x, b = whole.createVecs()
    elimination: Solve | None = None  # from the first breakdown on

    def solve(right_side: np.ndarray, tolerance: float) -> np.ndarray:
        """Solution by CG, or by elimination once CG has broken down."""
        nonlocal elimination
        if elimination is not None:
            return elimination(right_side, tolerance)
        b.setArray(right_side)
        solver.setTolerances(rtol=tolerance, atol=0.0, max_it=2 * MAX_ITERATIONS)
        solver.solve(b, x)
        if solver.getConvergedReason() > 0:
            history = solver.getConvergenceHistory()
            steps, residual = solver.getIterationNumber(), history[-1] / (history[0] or 1.0)
            report("lift", f"{len(right_side)} unknowns, {steps} iterations to {residual:.1e}")
            return x.array_r.copy()
        report(
            NOTE,
            f"the multigrid solver broke down on {len(right_side)} unknowns of the film's "
            "pressure; elimination, as exact but slower, takes its place",
        )
        elimination = eliminated(matrix)
        return elimination(right_side, tolerance)

    # The memory is freed with the function.
    finalize(solve, destroy, solver, whole, x, b).atexit = False
    return solve
