"""Minimisation of energies of functions linear on each cell, by CG with multigrid (PETSc).

A problem is an energy E(v) = ∫ ∇v·T·∇v (`forms.py`) with a constant tensor T on each cell, over
functions v = offset + P x. P is the 0/1 matrix of the numbering (`numbering.py`), never formed.
With the stiffness matrix A of the cells, x solves

    Pᵀ A P x = -Pᵀ A offset.

The cells are integrated in batches (`integrals.py`), and the corners of an unknown add up in its
row. From the solution on the coarser mesh, CG with BoomerAMG needs a handful of iterations at any
size, and with GAMG, where PETSc has no hypre, a few dozen. Whatever CG reaches is an admissible
function, so that an inexact solve only widens the bounds. The matrix must not be scaled by its
diagonal: constants would no longer be near-null vectors.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from math import fsum

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.fenicsx import HAS_HYPRE, MPI, PETSc
from fem_seal.flow.energy import Energy
from fem_seal.flow.integrals import AT_ONCE, batch
from fem_seal.flow.numbering import Numbering
from fem_seal.memory import slices

MAX_ITERATIONS = 100  # 3 to 7 on rough gaps; 43 on pixels 20 times as long as wide
# CG computes its energy as that of its start minus a decrease. Where less than this part of the
# start is left, cancellation has spoilt it: restart from the energy summed cell by cell.
RESTART_BELOW = 1e-11
# After a breakdown of CG, restart only if the last run lowered the energy below this part of its
# start.
WORTHWHILE_DECREASE = 0.9

UNSMOOTHED_UNKNOWNS = 50  # unknowns that GAMG aggregates without smoothing

# The options tried are in docs/measurements/bounds.md.
_OPTIONS = {
    "hypre": {
        "pc_hypre_type": "boomeramg",
        "pc_hypre_boomeramg_coarsen_type": "PMIS",
        "pc_hypre_boomeramg_interp_type": "ext+i",
        "pc_hypre_boomeramg_P_max": 4,
        "pc_hypre_boomeramg_strong_threshold": 0.25,
    },
    "gamg": {
        "pc_gamg_threshold": 0.02,
        # Chebyshev, the default, estimates eigenvalues, which goes wrong at large contrasts.
        "mg_levels_ksp_type": "richardson",
        "mg_levels_pc_type": "sor",
    },
}
_PREFIX = "fem_seal_"
# PETSc's error code of GAMG where the smallest conductivities vanish beside the largest.
_INCONSISTENT = 77


@dataclass(frozen=True, eq=False)
class Minimum:
    """The minimiser of an energy."""

    numbering: Numbering  #: numbering of the corners
    values: np.ndarray  #: (count,), values of the unknowns, on every rank
    total: Energy  #: ∫ ∇v·T·∇v, summed cell by cell (all terms are positive)
    residuals: tuple[float, ...]  #: relative error of the energy after each iteration of CG
    #: reason why CG stopped short of its tolerance, else "". The energy is then further above its
    #: minimum, but still that of an admissible function
    stalled: str = ""

    @property
    def corner_values(self) -> np.ndarray:
        """Corner values (C, 3) on all cells."""
        return self.corners(slice(None))

    def corners(self, cells: np.ndarray | slice) -> np.ndarray:
        """Corner values (n, 3) on some cells."""
        return self.numbering.corners(self.values, cells)


class CellSpace:
    """Functions linear on each of C triangles; each rank integrates over its share of the cells.

    Parameters
    ----------
    corners
        Coordinates (n, 3, 2) of the corners of a slice of n cells, relative to the first corner;
        the same on every rank.
    blur
        Largest error of a coordinate in units of the rounding unit.
    """

    def __init__(
        self,
        count: int,
        corners: Callable[[slice], np.ndarray],
        comm: MPI.Comm,
        blur: float,
    ):
        self.count, self.comm, self._corners = count, comm, corners
        self._blur = blur
        self._shares = [count * rank // comm.size for rank in range(comm.size + 1)]

    def minimise(
        self,
        tensor: Callable[[slice], np.ndarray],
        numberings: Sequence[Numbering],
        guesses: Sequence[np.ndarray],
        tolerance: float,
        balanced: bool = False,
    ) -> list[Minimum]:
        """Minimise ∫ ∇v·T·∇v over the functions of numberings that differ in their offsets.

        They share the matrix and its preconditioner, which takes longer to set up than CG to run.
        Where the tensor spans more decades than double precision has digits, CG may break down. It
        is then restarted from the energy summed cell by cell: once in any case, and again as long
        as the energy falls noticeably.

        Parameters
        ----------
        tensor
            Components xx, xy, yy of T, (n, 3), on a slice of n cells.
        guesses
            (count,) each, initial values of the unknowns.
        tolerance
            Relative error of the energy at which CG stops.
        balanced
            Stop only if the sum of the residuals, too, is at most √tolerance times the energy. For
            a pressure this sum is the difference of inflow and outflow.
        """
        if not numberings:
            return []
        matrix = self._assembled(tensor, numberings[0])
        solver = preconditioned_cg(matrix)
        try:
            run = partial(self._run_cg, solver, tensor, tolerance, balanced)
            return [
                _restarted(partial(run, numbering), numbering.representable(guess))
                for numbering, guess in zip(numberings, guesses, strict=True)
            ]
        finally:
            # Free the memory now: petsc4py would defer it.
            solver.destroy()
            matrix.destroy()

    def _run_cg(
        self,
        solver: PETSc.KSP,
        tensor: Callable[[slice], np.ndarray],
        tolerance: float,
        balanced: bool,
        numbering: Numbering,
        values: np.ndarray,
    ) -> tuple[float, Minimum]:
        """Energy of values (count,), and what one run of CG from there reaches, or those values."""
        x, right_side = solver.getOperators()[0].createVecs()
        try:
            start = self._started(tensor, numbering, values, right_side)
            # Half: summed anew, the energy is then below the part that asks for a restart.
            least = RESTART_BELOW * start / 2
            residuals, stalled = minimise_by_cg(
                solver, right_side, x, start, tolerance, balanced, least
            )
            moved = values + np.concatenate(self.comm.allgather(x.array_r))
        finally:
            destroy(x, right_side)
        if np.isfinite(moved).all():
            moved = numbering.representable(moved)
            total = self.energy(tensor, partial(numbering.corners, moved))
            # False for NaN: the returned function is always admissible.
            if total.value < start:
                return start, Minimum(numbering, moved, total, residuals, stalled)
        total = self.energy(tensor, partial(numbering.corners, values))
        return start, Minimum(numbering, values, total, residuals, stalled)

    def energy(
        self,
        tensor: Callable[[slice], np.ndarray],
        corner_values: Callable[[slice], np.ndarray],
    ) -> Energy:
        """Energy ∫ ∇v·T·∇v of a function with corner values (n, 3) on a slice of n cells."""
        energies = []
        for part in self._own_parts():
            corners, v = self._corners(part), corner_values(part)
            energies.append(Energy.of_cells(corners, tensor(part), v, self._blur))
        return Energy.sum(self.comm.allgather(Energy.sum(energies)))

    def _started(
        self,
        tensor: Callable[[slice], np.ndarray],
        numbering: Numbering,
        values: np.ndarray,
        right_side: PETSc.Vec,
    ) -> float:
        """Energy to start from; minus half its derivative by the unknowns is the right side."""
        right_side.setOption(PETSc.Vec.Option.IGNORE_NEGATIVE_INDICES, True)
        right_side.set(0)
        energies = []
        for part in self._own_parts():
            v = numbering.corners(values, part)
            # Subtract the value at the first corner: the differences then keep all their digits.
            v -= v[:, :1].copy()
            batch().place(self._corners(part), tensor(part))
            of_corner = batch().slopes(v)
            # The energy is quadratic: it is v times half its derivative.
            energies.append(float((v * of_corner).sum()))
            corners = numbering.of_corner[part]
            right_side.setValues(corners, -of_corner, PETSc.InsertMode.ADD_VALUES)
        right_side.assemble()
        return fsum(self.comm.allgather(fsum(energies)))

    def _own_parts(self) -> list[slice]:
        """Batches of this rank, padded by empty ones: collective assembly needs as many on all."""
        begin, end = self._shares[self.comm.rank : self.comm.rank + 2]
        own = list(slices(begin, end, AT_ONCE))
        most = -(-self.count // self.comm.size)
        return own + [slice(end, end)] * (-(-most // AT_ONCE) - len(own))

    def _assembled(self, tensor: Callable[[slice], np.ndarray], numbering: Numbering) -> PETSc.Mat:
        """The matrix of the unknowns."""
        begin, end = self._rows_of_rank(numbering)
        own, count = end - begin, numbering.count
        # Entries of a row: its neighbours and the diagonal.
        most = 1 + numbering.neighbours()[begin:end].astype(PETSc.IntType)
        matrix = PETSc.Mat().createAIJ(
            ((own, count), (own, count)),
            nnz=(np.minimum(most, own), np.minimum(most, count - own)),
            comm=self.comm,
        )
        # Without this option a rank without rows assembles differently, and the others hang.
        matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, True)
        for part in self._own_parts():
            batch().place(self._corners(part), tensor(part))
            batch().add_to(matrix, numbering.of_corner[part])
        matrix.assemble()
        return matrix

    def _rows_of_rank(self, numbering: Numbering) -> tuple[int, int]:
        """First row of this rank and of the next.

        Unknowns are numbered in the order in which the cells first use them; a rank owns those
        that its cells use first.
        """
        begin, end = self._shares[self.comm.rank : self.comm.rank + 2]
        met = numbering.of_corner[begin:end].max(initial=-1) + 1
        met = np.maximum.accumulate(self.comm.allgather(int(met)))
        first = [0, *met[:-1].tolist(), numbering.count]
        return first[self.comm.rank], first[self.comm.rank + 1]


def _restarted(run: Callable[[np.ndarray], tuple[float, Minimum]], values: np.ndarray) -> Minimum:
    """The minimum that runs of CG reach, each from where the last one ended; see `minimise`."""
    stalled_before = False
    residuals: tuple[float, ...] = ()
    while True:
        start, reached = run(values)
        residuals += reached.residuals
        worthwhile = WORTHWHILE_DECREASE if reached.stalled else RESTART_BELOW
        again = reached.total.value < worthwhile * start
        if not again and (not reached.stalled or stalled_before):
            return replace(reached, residuals=residuals)
        values, stalled_before = reached.values, bool(reached.stalled)


def preconditioner() -> str:
    """PETSc's name of the preconditioner: "hypre" (BoomerAMG), or "gamg" where PETSc has no hypre.

    The environment variable PETSC_OPTIONS = "-fem_seal_pc_type gamg" asks for GAMG anywhere.
    """
    return PETSc.Options(_PREFIX).getString("pc_type", "hypre" if HAS_HYPRE else "gamg")


def preconditioned_cg(matrix: PETSc.Mat) -> PETSc.KSP:
    """CG for a matrix, with a preconditioner that is set up at the first solve."""
    solver = PETSc.KSP().create(matrix.comm)
    solver.setOptionsPrefix(_PREFIX)
    stated, name = _stated_options(), preconditioner()
    defaults = dict(_OPTIONS.get(name, {}))
    if name == "gamg":
        # It smooths with an eigenvalue that CG estimates, which may break down on few unknowns.
        defaults["pc_gamg_agg_nsmooths"] = int(matrix.size[0] > UNSMOOTHED_UNKNOWNS)
    # The options are not deleted after setFromOptions: GAMG sets up its levels at the first solve,
    # and reads theirs then.
    for option in defaults.keys() - stated:
        PETSc.Options(_PREFIX)[option] = defaults[option]
    solver.setOperators(matrix)
    solver.setType("cg")
    solver.setNormType(PETSc.KSP.NormType.NATURAL)
    try:
        solver.getPC().setType(name)
    except PETSc.Error:
        raise InvalidInput(
            f"PETSC_OPTIONS: -fem_seal_pc_type {name} is no preconditioner of this PETSc"
        ) from None
    solver.setFromOptions()
    return solver


@cache
def _stated_options() -> frozenset[str]:
    """Options of this solver that the user has set, asked for before the solver sets its own."""
    return frozenset(PETSc.Options(_PREFIX).getAll())


def minimise_by_cg(
    solver: PETSc.KSP,
    right_side: PETSc.Vec,
    x: PETSc.Vec,
    start: float,
    tolerance: float,
    balanced: bool = False,
    least: float = 0.0,
) -> tuple[tuple[float, ...], str]:
    """Solve A x = b by CG from x = 0, a correction, until the energy of the error is small enough.

    After k steps the energy is that of the start less b·x_k, and r'Mr, with the residual r and the
    preconditioner M, is the energy of the error within a factor of two. CG stops if the latter is
    at most `tolerance` times the former, or if the energy falls below `least`. A test of r relative
    to its start would be misleading, since the energy of the start may be a million times the
    minimum.

    Returns this ratio after each iteration, and the reason why CG stopped short, else "".
    """
    residuals = []
    # petsc4py would never free vectors that PETSc makes anew at each iteration.
    solution, residual = right_side.duplicate(), right_side.duplicate()

    def converged(ksp: PETSc.KSP, iteration: int, natural_norm: float) -> int:
        """PETSc's reason to stop; `natural_norm` is (r'Mr)^½."""
        decrease = right_side.dot(ksp.buildSolution(solution)) if iteration else 0.0
        if not np.isfinite([natural_norm, decrease]).all():
            return PETSc.KSP.ConvergedReason.DIVERGED_NANORINF
        energy = start - decrease
        residuals.append(natural_norm**2 / energy if energy > 0 else np.inf)
        if energy < least:
            return PETSc.KSP.ConvergedReason.CONVERGED_ITS
        if natural_norm**2 <= tolerance * energy and (
            not balanced or abs(ksp.buildResidual(residual).sum()) <= np.sqrt(tolerance) * energy
        ):
            return PETSc.KSP.ConvergedReason.CONVERGED_RTOL
        if iteration >= MAX_ITERATIONS:
            return PETSc.KSP.ConvergedReason.DIVERGED_MAX_IT
        return PETSc.KSP.ConvergedReason.CONVERGED_ITERATING

    solver.setConvergenceTest(converged)
    try:
        solver.solve(right_side, x)
    except PETSc.Error as error:
        if error.ierr != _INCONSISTENT:
            raise
        x.set(0)
        return (), "no preconditioner can be set up for conductivities so far apart"
    finally:
        destroy(solution, residual)
    history = tuple(residuals[1:])
    if solver.getConvergedReason() > 0:
        return history, ""
    state = "where rounding hides what is left of the residuals"
    reached = residuals[-1] if residuals else np.inf
    if not reached <= tolerance:
        state = f"at a relative energy error of {reached:.1e}, wanted {tolerance:.0e}"
    return history, f"CG stopped after {len(history)} iterations {state}"


def destroy(*petsc_objects: PETSc.Object) -> None:
    """Free objects of PETSc at once: petsc4py would defer it."""
    for one in petsc_objects:
        one.destroy()
