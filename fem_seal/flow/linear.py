"""The one place that knows PETSc: energies of functions linear on each cell, and their minima.

A problem is an energy E(v) = ∫ ∇v·T·∇v with a constant tensor T on each cell, over functions
v = lift + P x: P is the 0/1 matrix of the numbering (`numbering.py`), never formed. The cells are
integrated one batch after the other (`integrals.py`), and corners of one unknown add up in its
row. CG with BoomerAMG needs a handful of iterations from the coarser solution at any size, as
long as the matrix is not scaled by its diagonal: that would spoil the constant as near-null vector.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_seal.errors import NotConverged
from fem_seal.fenicsx import MPI, PETSc
from fem_seal.flow.integrals import AT_ONCE, batch
from fem_seal.flow.numbering import Unknowns
from fem_seal.mesh.grouping import parts

MAX_ITERATIONS = 100
# CG knows the energy by what it has taken off that of its start: below this part of it, it has to
# start again from the energy summed cell by cell.
LOST = 1e-11

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

    unknowns, values : a numbering and what its unknowns (count,) are, on every rank
    energy : ∫ ∇v·T·∇v, summed cell by cell (all terms positive)
    iterations : of CG
    """

    unknowns: Unknowns
    values: np.ndarray
    energy: float
    iterations: int

    @property
    def corner_values(self) -> np.ndarray:
        """(C, 3), of every cell."""
        return self.unknowns.corners(self.values)


class CellSpace:
    """Functions linear on each of C triangles; each rank integrates over its share of the cells.

    Parameters
    ----------
    count : number of cells, C
    corners : of a slice of n cells where its corners (n, 3, 2) lie, the same on every rank
    sides : gives the number (C, 3) of the side opposite each corner, the same for two cells at it
    comm : MPI communicator
    """

    def __init__(
        self,
        count: int,
        corners: Callable[[slice], np.ndarray],
        sides: Callable[[], np.ndarray],
        comm: MPI.Comm,
    ):
        self.count, self.comm, self._corners, self._sides = count, comm, corners, sides
        self._shares = [count * rank // comm.size for rank in range(comm.size + 1)]

    def minimise(
        self,
        tensor: Callable[[slice], np.ndarray],
        unknowns: Unknowns,
        guess: np.ndarray,
        tolerance: float,
        balanced: bool = False,
    ) -> Minimum:
        """Minimise ∫ ∇v·T·∇v over the functions that `unknowns` describes.

        Parameters
        ----------
        tensor : of a slice of n cells the components xx, xy, yy of T, (n, 3)
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
        matrix = self._assembled(tensor, unknowns)
        x, right_side = matrix.createVecs()
        right_side.setOption(PETSc.Vec.Option.IGNORE_NEGATIVE_INDICES, True)
        values, iterations = guess, 0
        try:
            while True:
                right_side.set(0)
                start = self._energy(tensor, unknowns, values, right_side)
                right_side.scale(-1)
                lost = LOST * start
                iterations += minimise_by_cg(
                    matrix, right_side, x, start, tolerance, balanced, lost / 2
                )
                values = values + np.concatenate(self.comm.allgather(x.array_r))
                energy = self._energy(tensor, unknowns, values)
                if energy >= lost:
                    return Minimum(unknowns, values, energy, iterations)
        finally:
            # petsc4py puts off freeing what is only dropped, and the meshes come and go.
            for thing in (matrix, x, right_side):
                thing.destroy()

    def _energy(
        self,
        tensor: Callable[[slice], np.ndarray],
        unknowns: Unknowns,
        values: np.ndarray,
        slopes: PETSc.Vec | None = None,
    ) -> float:
        """Energy; half its derivative by the unknowns is added to `slopes`."""
        energy = 0.0
        for part in self._own_parts():
            v = unknowns.corners(values, part)
            # Only differences matter on a cell, and without the rest they keep all their digits.
            v -= v[:, :1].copy()
            batch().place(self._corners(part), tensor(part))
            of_corner = batch().slopes(v)
            energy += (v * of_corner).sum()
            if slopes is not None:
                slopes.setValues(unknowns.of_corner[part], of_corner, PETSc.InsertMode.ADD_VALUES)
        if slopes is not None:
            slopes.assemble()
        return float(self.comm.allreduce(energy))

    def _own_parts(self) -> list[slice]:
        """Batches of this rank, as many as of the rank with the most: all assemble together."""
        begin, end = self._shares[self.comm.rank : self.comm.rank + 2]
        own = list(parts(begin, end, AT_ONCE))
        most = -(-self.count // self.comm.size)
        return own + [slice(end, end)] * (-(-most // AT_ONCE) - len(own))

    def _assembled(self, tensor: Callable[[slice], np.ndarray], unknowns: Unknowns) -> PETSc.Mat:
        """The matrix of the unknowns."""
        begin, end = self._rows(unknowns)
        own, count = end - begin, unknowns.count
        # Entries of a row: its neighbours and itself.
        most = 1 + unknowns.neighbours(self._sides())[begin:end].astype(PETSc.IntType)
        matrix = PETSc.Mat().createAIJ(
            ((own, count), (own, count)),
            nnz=(np.minimum(most, own), np.minimum(most, count - own)),
            comm=self.comm,
        )
        # A rank without rows would else take another path through the assembly, and all would wait.
        matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, True)
        for part in self._own_parts():
            batch().place(self._corners(part), tensor(part))
            batch().add_to(matrix, unknowns.of_corner[part])
        matrix.assemble()
        return matrix

    def _rows(self, unknowns: Unknowns) -> tuple[int, int]:
        """First row of this rank and of the next; a rank has the unknowns that its cells bring.

        Unknowns are numbered as the cells come to meet them.
        """
        begin, end = self._shares[self.comm.rank : self.comm.rank + 2]
        met = unknowns.of_corner[begin:end].max(initial=-1) + 1
        met = np.maximum.accumulate(self.comm.allgather(int(met)))
        first = [0, *met[:-1].tolist(), unknowns.count]
        return first[self.comm.rank], first[self.comm.rank + 1]


def minimise_by_cg(
    matrix: PETSc.Mat,
    right_side: PETSc.Vec,
    x: PETSc.Vec,
    start: float,
    tolerance: float,
    balanced: bool = False,
    least: float = 0.0,
) -> int:
    """CG for x from zero until the energy r'Mr of the error is `tolerance` of the energy reached.

    Parameters
    ----------
    matrix, right_side : of the correction to a start
    x : where the solution goes
    start : energy of the start
    tolerance, balanced : as in `CellSpace.minimise`
    least : stop as well where the energy falls below it

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
        if energy < least:
            return PETSc.KSP.ConvergedReason.CONVERGED_ITS
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
