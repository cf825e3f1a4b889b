"""The adaptive loop: solve, bound, mark, refine, until the bounds agree.

The loop is the same for a leak rate, a conductivity tensor, and uniform refinement, which marks all
cells. For a leak rate, with unit pressure drop and K = g³, it solves on each mesh (`level.py`)

    primal             Q_hi   = min_p ∫ K|∇p|²,       p = 1 at the inlet, 0 at the outlet
    dual               1/Q_lo = min_ψ ∫ |∇ψ|²/K,      ψ of unit flux, constant in blocked cells
    regularised dual   1/Q_χ  = min_ψ ∫ ∇ψ·R_χ·∇ψ,    blocked cells conduct χ times as in the primal

    indicators         e_T = ∫_T (K|∇p|² + Q_χ² ∇ψ·R_χ ∇ψ + 2 j·∇p) >= 0,   Σ e_T ≈ Q_hi - Q_χ,
                       with the flux j = Q_χ (∂ψ/∂y, -∂ψ/∂x) of the regularised dual

Only primal and dual are bounds. A blocked cell is partly in contact, so that the dual must take ψ
constant in it. The regularised dual shows how much would flow through the blocked cells once they
are resolved. It is solved on every level and steers the refinement (`marking.py`); the dual is
solved when Q_hi and Q_χ are close to the tolerance. `look_ahead.py` refines further without a
solve.
"""

import time
from collections.abc import Iterator

import numpy as np

from fem_seal.digits import number_of
from fem_seal.errors import Inconsistent
from fem_seal.flow.energy import SUM_ROUNDING
from fem_seal.flow.families import Family, Streams
from fem_seal.flow.gap_on_mesh import GapOnMesh
from fem_seal.flow.level import LevelProblem, LevelSolution
from fem_seal.flow.look_ahead import refined_ahead
from fem_seal.flow.marking import Marks, Strategy, mark_all
from fem_seal.flow.solution import Flux, SolvedLevel, Start
from fem_seal.flow.stopping import Stopping
from fem_seal.mesh.nested import TooFine

# Ratio of (u - l)/l after and before the hierarchical correction, until it is measured.
USUAL_CORRECTION_RATIO = 0.4
# Largest growth of the unknowns from level to level: 3.9 was seen on open rough gaps.
GROWTH = 4.0
# Multiples of the tolerance that the expected (u - l)/l is compared with: below DUAL_AT_ONCE the
# true dual is solved at once; below DUAL_NEXT on the next mesh, before the regularised dual, which
# is not needed if the bounds decide there. A full step leaves a third of the width. To wait longer
# with the true dual costs a level next to closing, where the first correction narrows less.
DUAL_AT_ONCE, DUAL_NEXT = 2.0, 3.0


def _too_many(unknowns: float) -> str:
    return f"the next mesh would have more than {number_of(int(unknowns), 'unknown')}"


def refined(
    gap: GapOnMesh,
    start: Start,
    strategy: Strategy,
    stopping: Stopping,
) -> Iterator[LevelSolution]:
    """Yield a solution on each finer mesh, until `stopping` ends the refinement.

    Parameters
    ----------
    start
        The first mesh, which must leave a path for the flow, and functions to start from.
    """
    max_unknowns = stopping.limits.unknowns or np.inf
    loop = _Loop(strategy, stopping)
    while True:
        problem = LevelProblem(
            gap, start.mesh, start.values, stopping.comm, strategy.tuning.tolerance
        )
        if stopping.levels and problem.unknowns > max_unknowns:
            stopping.stop(_too_many(max_unknowns))
            return
        guesses, psi = problem.guesses(start), start.streams
        del start
        loop.log.lap("mesh")
        solution, regularised = loop.solve(problem, guesses, psi)
        yield stopping.judged(solution)
        if stopping.ended:
            return
        # A uniform mesh has at least twice as many unknowns: every unknown has at least two sides,
        # a side has at most two ends, and the midpoint of each side becomes an unknown.
        if strategy.uniform and 2 * problem.unknowns > max_unknowns:
            stopping.stop(_too_many(max_unknowns))
            return
        loop.log = _Log()
        start, marks, fluxes = loop.marked(solution, regularised, psi)
        # Two meshes together may not fit into memory: of this one only what is refined stays.
        del problem, guesses, psi, solution, regularised
        try:
            start = refined_ahead(start, gap, marks, fluxes, strategy.tuning.ahead)
        except TooFine as limit:
            stopping.stop(str(limit))
            return
        loop.log.lap("refine")


class _Log:
    """Cost of a level: seconds between laps and residuals of CG, by stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.residuals: dict[str, tuple[float, ...]] = {}
        self._last = time.perf_counter()

    def lap(self, name: str, solved: Family | None = None) -> None:
        now = time.perf_counter()
        self.seconds[name] = now - self._last
        self._last = now
        if solved is not None:
            self.residuals[name] = solved.residuals


class _Loop:
    """What the loop keeps from mesh to mesh: what to solve first on the next one, and costs."""

    def __init__(self, strategy: Strategy, stopping: Stopping) -> None:
        self.strategy, self.stopping, self.log = strategy, stopping, _Log()
        # Whether the true dual is solved first, as the bounds may decide there.
        self.true_dual = strategy.uniform or strategy.every_dual
        # Ratio of (u - l)/l after and before the hierarchical correction.
        self.correction_ratio = USUAL_CORRECTION_RATIO

    def solve(
        self, problem: LevelProblem, guesses: list[np.ndarray], psi: np.ndarray
    ) -> tuple[LevelSolution, Streams | None]:
        """Solve the primal and, if it may end the refinement, the true dual.

        Unless the true dual is wanted at once, the regularised one is solved before it. The true
        dual then follows if the expected width is close to the tolerance, or if the next mesh would
        be too large. Returns the solution, and the regularised dual if it was solved.
        """
        stopping, log = self.stopping, self.log
        # Also where the bounds are far apart: marking by the least indicator alone, without the
        # primal, takes a level or two more.
        pressure = problem.pressure(guesses)
        log.lap("primal", pressure)
        best = problem.upper_bound(pressure)
        if stopping.levels:
            best = best.tightened(stopping.levels[-1].bounds)
        regularised = None if self.true_dual else self._regularised_dual(problem, psi)
        level = SolvedLevel(problem.unknowns, problem.space.count, best, log.residuals, log.seconds)
        solution = LevelSolution(level, problem, pressure)
        if regularised is not None:
            psi = regularised.psi
            # Near a tolerance (u - l)/l is nearly the width (u - l)/√(l u).
            expected = self.correction_ratio * problem.excess(pressure, regularised)
            self.true_dual = expected < DUAL_NEXT * self.strategy.rtol
            last = GROWTH * problem.unknowns > (stopping.limits.unknowns or np.inf)
            if not last and expected >= DUAL_AT_ONCE * self.strategy.rtol:
                return solution, regularised
        solution = solution.certified(psi)
        stream, corrected = solution.stream, solution.corrected
        if stream is not None and corrected is not None and np.isfinite(corrected.excess):
            solved = problem.excess(pressure, stream)
            self.correction_ratio = corrected.excess / solved if solved > SUM_ROUNDING else 1.0
            self.true_dual = True
        return solution, regularised

    def _regularised_dual(self, problem: LevelProblem, psi: np.ndarray) -> Streams:
        """Solve the regularised dual from stream functions of unit jumps."""
        regularised = problem.stream(psi, self.strategy.tuning.chi)
        if regularised is None:
            raise Inconsistent("contact bars an open gap; please report the gap as a defect")
        self.log.lap("regularised dual", regularised)
        return regularised

    def marked(
        self, solution: LevelSolution, regularised: Streams | None, psi: np.ndarray
    ) -> tuple[Start, Marks, list[Flux]]:
        """Mark cells: all, or by the regularised dual and the flows that it shows.

        Returns the start to be refined, the marks, and the fluxes of these flows.
        """
        problem, pressure, stream = solution.problem, solution.pressure, solution.stream
        if self.strategy.marking is None:
            return problem.start(pressure, stream), mark_all(problem), []
        # By the true dual alone the bounds stall: side channels stay blocked. If it came first, the
        # next level logs the time of this solve.
        if regularised is None:
            psi = psi if stream is None else stream.psi
            regularised = self._regularised_dual(problem, psi)
        flows = problem.flows(pressure, regularised)
        expected = self.correction_ratio * problem.excess(pressure, regularised)
        reached = np.inf if stream is None else solution.level.bounds.width
        marks = self.strategy.marking(problem, flows, expected, reached, self.strategy)
        return problem.start(pressure, regularised), marks, [flow.flux for flow in flows]
