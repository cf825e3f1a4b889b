"""The adaptive loop: solve, bound, mark, refine, until the bounds agree.

The loop is the same for a leak rate, a conductivity tensor, and uniform refinement, which marks all
cells. For a leak rate, with unit pressure drop and K = g³, it solves on each mesh (`level.py`)

    primal             Q_hi   = min_p ∫ K|∇p|²,       p = 1 at the inlet, 0 at the outlet
    dual               1/Q_lo = min_ψ ∫ |∇ψ|²/K,      ψ of unit flux, constant in blocked cells
    regularised dual   1/Q_χ  = min_ψ ∫ ∇ψ·R_χ·∇ψ,    blocked cells conduct χ times as in the primal

    indicators         e_T = ∫_T K|∇p|² + Q_χ² ∇ψ·R_χ ∇ψ + 2 J·∇p >= 0,   Σ e_T ≈ Q_hi - Q_χ,
                       with the flux J = Q_χ (∂ψ/∂y, -∂ψ/∂x) of the regularised dual

Only primal and dual are bounds. A blocked cell is partly in contact, so that the dual must take ψ
constant in it. The regularised dual shows how much would flow through the blocked cells once they
are resolved. It is solved on every level and steers the refinement (`marking.py`); the dual is
solved when Q_hi and Q_χ are close to the tolerance. `look_ahead.py` refines further without a
solve.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from fem_seal.digits import number_of
from fem_seal.errors import Inconsistent
from fem_seal.flow.bounds import Bounds
from fem_seal.flow.energy import SUM_ROUNDING
from fem_seal.flow.gap_on_mesh import GapOnMesh
from fem_seal.flow.level import (
    CorrectedBounds,
    Family,
    Guess,
    LevelProblem,
    LevelSolution,
    Pressures,
    Streams,
)
from fem_seal.flow.look_ahead import refined_ahead
from fem_seal.flow.marking import Marks, Strategy, mark, mark_all
from fem_seal.flow.solution import FlowEstimate, SolvedLevel, Start
from fem_seal.flow.stopping import Stopping
from fem_seal.mesh.bisection import TooFine

# Ratio of the bracket's widths after and before the hierarchical correction, until it is measured.
USUAL_CORRECTION_RATIO = 0.4
# Largest growth of the unknowns from level to level: 3.9 was seen on open rough gaps.
GROWTH = 4.0
# Multiples of the tolerance that the expected width is compared with: below DUAL_AT_ONCE the true
# dual is solved at once; below DUAL_NEXT on the next mesh, before the regularised dual, which is
# not needed if the bounds decide there. A full step leaves a third of the width.
DUAL_AT_ONCE, DUAL_NEXT = 2.0, 3.0


def _too_many(unknowns: float) -> str:
    return f"the next mesh would have more than {number_of(int(unknowns), 'unknown')}"


def unchanged(solution: LevelSolution) -> LevelSolution:
    """Return the solution as it is: without slip there are no bounds to add."""
    return solution


def refined(
    gap: GapOnMesh,
    start: Start,
    strategy: Strategy,
    stopping: Stopping,
    widen: Callable[[LevelSolution], LevelSolution] = unchanged,
) -> Iterator[LevelSolution]:
    """Yield a solution on each finer mesh, until `stopping` ends the refinement.

    Parameters
    ----------
    start
        The first mesh, which must leave a path for the flow, and functions to start from.
    widen
        Adds to a solution the bounds for a gas that slips, before `stopping` judges it.
    """
    max_unknowns = strategy.max_unknowns or np.inf
    solve_true_dual = strategy.uniform or strategy.every_dual
    correction_ratio = USUAL_CORRECTION_RATIO
    best, log = None, _Log()
    while True:
        problem = LevelProblem(
            gap, start.mesh, start.values, stopping.comm, strategy.tuning.tolerance
        )
        if best is not None and problem.unknowns > max_unknowns:
            return stopping.end(_too_many(max_unknowns))
        guess = problem.guess(start)
        del start
        log.lap("mesh")
        # Solve the primal, the regularised dual, and the dual if it may decide.
        solution = _solve(problem, guess, strategy, solve_true_dual, correction_ratio, log)
        # Correct the bounds, keep the best so far.
        bounds = problem.upper_bound(solution.pressure)
        corrected: CorrectedBounds | None = None
        if solution.stream is not None:
            corrected = problem.corrected(solution.pressure, solution.stream)
            bounds = corrected.tightened(bounds)
            log.lap("correction")
            if np.isfinite(bounds.excess):
                difference = problem.difference(solution.pressure, solution.stream)
                solve_true_dual, correction_ratio = True, width_ratio(bounds.excess, difference)
        best = bounds if best is None else bounds.tightened(best)
        # Stop if the bounds meet the criterion, or if unknowns, time or memory reach their limit.
        cells = problem.space.count
        level = SolvedLevel(problem.unknowns, cells, best, log.residuals, log.seconds)
        yield stopping.judged(
            LevelSolution(level, problem, solution.pressure, solution.stream, corrected), widen
        )
        del corrected
        if stopping.ended:
            return None
        solve_true_dual = solve_true_dual or solution.expected < DUAL_NEXT * strategy.rtol
        # Mark, refine, look ahead.
        log = _Log()
        # Stop before making a uniform mesh that would exceed the limit. It has at least twice as
        # many unknowns: every unknown has at least two sides, a side has at most two ends, and the
        # midpoint of each side becomes an unknown.
        if strategy.uniform and 2 * problem.unknowns > max_unknowns:
            return stopping.end(_too_many(max_unknowns))
        stream, marks, flows = _marked(
            problem, guess, solution, best, correction_ratio, strategy, log
        )
        ahead = 0 if strategy.uniform else strategy.tuning.ahead
        from_here = problem.start(solution.pressure, stream)
        refine = partial(refined_ahead, from_here, gap, marks, flows, ahead)
        # Free this mesh before the next one is made.
        del problem, guess, solution, stream, from_here
        try:
            start = refine()
        except TooFine as limit:
            return stopping.end(str(limit))
        del refine
        log.lap("refine")


def width_ratio(corrected: float, solved: float) -> float:
    """Ratio of the relative widths of the corrected bounds and of the solved ones."""
    return corrected / solved if solved > SUM_ROUNDING else 1.0


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


@dataclass(frozen=True, eq=False)
class _Solved:
    """Solutions on one mesh: pressure, regularised and true stream function."""

    pressure: Pressures
    regularised: Streams | None = None
    stream: Streams | None = None
    #: relative width of the corrected bounds that the regularised dual foretells
    expected: float = np.inf


def _solve(
    problem: LevelProblem,
    guess: Guess,
    strategy: Strategy,
    solve_true_dual: bool,
    correction_ratio: float,
    log: _Log,
) -> _Solved:
    """Solve the primal and, if it may end the refinement, the true dual.

    Unless `solve_true_dual`, the regularised dual is solved before it: the true dual then follows
    if the expected width is close to the tolerance, or if the next mesh would be too large.
    """
    pressure = problem.pressure(guess.pressures)
    log.lap("primal", pressure)
    psi, regularised, expected = guess.streams, None, np.inf
    if not solve_true_dual:
        regularised = _regularised_dual(problem, psi, strategy, log)
        psi = regularised.psi
        last = GROWTH * problem.unknowns > (strategy.max_unknowns or np.inf)
        expected = correction_ratio * problem.difference(pressure, regularised)
        if not last and expected >= DUAL_AT_ONCE * strategy.rtol:
            return _Solved(pressure, regularised, expected=expected)
    stream = problem.stream(psi)
    log.lap("dual", stream)
    return _Solved(pressure, regularised, stream, expected)


def _regularised_dual(
    problem: LevelProblem, psi: np.ndarray, strategy: Strategy, log: _Log
) -> Streams:
    """Solve the regularised dual from stream functions of unit jumps."""
    regularised = problem.regularised_stream(psi, strategy.tuning.chi)
    if regularised is None:
        raise Inconsistent("contact bars an open gap; please report the gap as a defect")
    log.lap("regularised dual", regularised)
    return regularised


def _marked(
    problem: LevelProblem,
    guess: Guess,
    solution: _Solved,
    best: Bounds,
    correction_ratio: float,
    strategy: Strategy,
    log: _Log,
) -> tuple[Streams | None, Marks, list[FlowEstimate]]:
    """Mark cells: all, or by the regularised dual and the flows that it shows.

    Returns the stream functions to start from, the marks, and the flows without their functions.
    """
    if strategy.uniform:
        return solution.stream, mark_all(problem), []
    # If the true dual came first, the next level logs the time of this solve.
    psi = guess.streams if solution.stream is None else solution.stream.psi
    regularised = solution.regularised or _regularised_dual(problem, psi, strategy, log)
    flows = problem.flows(solution.pressure, regularised)
    expected = correction_ratio * problem.difference(solution.pressure, regularised)
    reached = best.width if solution.stream is not None else np.inf
    marks = mark(problem, flows, expected, reached, strategy)
    # Free the functions with the mesh: looking ahead takes them from the start.
    return regularised, marks, [flow.without_functions() for flow in flows]
