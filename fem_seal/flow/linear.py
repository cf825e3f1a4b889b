"""The one place that knows PETSc: energies of functions linear on each cell, and their minima.

A problem is an energy E(v) = ∫ ∇v·T·∇v (`forms.py`) with a constant tensor T on each cell, over
functions v = lift + P x: P is the 0/1 matrix of the numbering (`numbering.py`), never formed. The
cells are integrated one batch after the other (`integrals.py`), and corners of one unknown add up
in its row. CG with BoomerAMG needs a handful of iterations from the coarser solution at any size,
as long as the matrix is not scaled by its diagonal: that would spoil the constant as near-null
vector.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_seal.fenicsx import MPI, PETSc
from fem_seal.flow.energy import Energy
from fem_seal.flow.integrals import AT_ONCE, batch
from fem_seal.flow.numbering import Unknowns
from fem_seal.mesh.grouping import parts

MAX_ITERATIONS = 100
# CG knows the energy by what it has taken off that of its start: below this part of it, it has to
# start again from the energy summed cell by cell.
LOST = 1e-11
# Where CG breaks down, one more start must lower the energy at least to this part to be worth it.
WORTH = 0.9

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
    total : ∫ ∇v·T·∇v, summed cell by cell (all terms positive)
    iterations : of CG
    stalled : why CG stopped short of its tolerance, "" if it did not. The energy then is above the
        least one by more, but still that of an admissible function
    """

    unknowns: Unknowns
    values: np.ndarray
    total: Energy
    iterations: int
    stalled: str = ""

    @property
    def energy(self) -> float:
        """∫ ∇v·T·∇v."""
        return self.total.value

    @property
    def corner_values(self) -> np.ndarray:
        """(C, 3), of every cell."""
        return self.unknowns.corners(self.values)


class CellSpace:
    """Functions linear on each of C triangles; each rank integrates over its share of the cells.

    Parameters
    ----------
    count : number of cells, C
    corners : of a slice of n cells where its corners (n, 3, 2) lie, seen from the first one, the
        same on every rank
    sides : gives the number (C, 3) of the side opposite each corner, the same for two cells at it
    comm : MPI communicator
    blur : coordinates are off by this times the rounding unit at most
    """

    def __init__(
        self,
        count: int,
        corners: Callable[[slice], np.ndarray],
        sides: Callable[[], np.ndarray],
        comm: MPI.Comm,
        blur: float,
    ):
        self.count, self.comm, self._corners, self._sides = count, comm, corners, sides
        self._blur = blur
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

        Notes
        -----
        Where the tensor spans more decades than double precision has digits, CG may break down. It
        then starts again from the energy summed cell by cell: once, and as long as that pays.
        """
        matrix = self._assembled(tensor, unknowns)
        x, right_side = matrix.createVecs()
        right_side.setOption(PETSc.Vec.Option.IGNORE_NEGATIVE_INDICES, True)
        values, iterations, stalled_before = unknowns.representable(guess), 0, False
        try:
            while True:
                right_side.set(0)
                total = start = self._energy(tensor, unknowns, values, right_side)
                right_side.scale(-1)
                lost = LOST * start.value
                found = minimise_by_cg(
                    matrix, right_side, x, start.value, tolerance, balanced, lost / 2
                )
                iterations += found.iterations
                moved = values + np.concatenate(self.comm.allgather(x.array_r))
                moved = unknowns.representable(moved)
                energy = self._energy(tensor, unknowns, moved)
                # Not a number is never less: what is returned is always an admissible function.
                if energy.value < start.value:
                    values, total = moved, energy
                again = total.value < (WORTH * start.value if found.stalled else lost)
                if not again and (not found.stalled or stalled_before):
                    return Minimum(unknowns, values, total, iterations, found.stalled)
                stalled_before = bool(found.stalled)
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
    ) -> Energy:
        """Energy; half its derivative by the unknowns is added to `slopes`."""
        energies = []
        for part in self._own_parts():
            v = unknowns.corners(values, part)
            # Only differences matter on a cell, and without the rest they keep all their digits.
            v -= v[:, :1].copy()
            corners, T = self._corners(part), tensor(part)
            energies.append(Energy.of_cells(corners, T, v, self._blur))
            if slopes is not None:
                batch().place(corners, T)
                of_corner = batch().slopes(v)
                slopes.setValues(unknowns.of_corner[part], of_corner, PETSc.InsertMode.ADD_VALUES)
        if slopes is not None:
            slopes.assemble()
        return Energy.sum(self.comm.allgather(Energy.sum(energies)))

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


@dataclass(frozen=True)
class Iterations:
    """How CG ended.

    iterations : of CG; stalled : why it stopped short of its tolerance, "" if it did not
    """

    iterations: int
    stalled: str


def minimise_by_cg(
    matrix: PETSc.Mat,
    right_side: PETSc.Vec,
    x: PETSc.Vec,
    start: float,
    tolerance: float,
    balanced: bool = False,
    least: float = 0.0,
) -> Iterations:
    """CG for x from zero until the energy r'Mr of the error is `tolerance` of the energy reached.

    Parameters
    ----------
    matrix, right_side : of the correction to a start
    x : where the solution goes
    start : energy of the start
    tolerance, balanced : as in `CellSpace.minimise`
    least : stop as well where the energy falls below it

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
    if reason > 0:
        return Iterations(iterations, "")
    what = "where rounding hides what is left of the residuals"
    if not reached[0] <= tolerance:
        what = f"at a relative energy error of {reached[0]:.1e}, wanted {tolerance:.0e}"
    return Iterations(iterations, f"CG with BoomerAMG stopped after {iterations} iterations {what}")
