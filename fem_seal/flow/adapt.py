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
from fem_seal.flow.families import Family, Pressures, Streams
from fem_seal.flow.gap_on_mesh import GapOnMesh
from fem_seal.flow.level import CorrectedBounds, LevelProblem, LevelSolution
from fem_seal.flow.look_ahead import refined_ahead
from fem_seal.flow.marking import Strategy, mark_all
from fem_seal.flow.solution import SolvedLevel, Start
from fem_seal.flow.stopping import Stopping
from fem_seal.mesh.bisection import TooFine

# Ratio of (u - l)/l after and before the hierarchical correction, until it is measured.
USUAL_CORRECTION_RATIO = 0.4
# Largest growth of the unknowns from level to level: 3.9 was seen on open rough gaps.
GROWTH = 4.0
# Multiples of the tolerance that the expected (u - l)/l is compared with: below DUAL_AT_ONCE the
# true dual is solved at once; below DUAL_NEXT on the next mesh, before the regularised dual, which
# is not needed if the bounds decide there. A full step leaves a third of the width.
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
    max_unknowns = strategy.max_unknowns or np.inf
    outlook = _Outlook(strategy.uniform or strategy.every_dual)
    best, log = None, _Log()
    while True:
        problem = LevelProblem(
            gap, start.mesh, start.values, stopping.comm, strategy.tuning.tolerance
        )
        if best is not None and problem.unknowns > max_unknowns:
            stopping.stop(_too_many(max_unknowns))
            return
        guesses, psi = problem.guesses(start), start.streams
        del start
        log.lap("mesh")
        solution = _solve(problem, guesses, psi, strategy, outlook, log)
        bounds, corrected = _bounded(problem, solution, log)
        outlook.learn(problem, solution, bounds, strategy.rtol)
        best = bounds if best is None else bounds.tightened(best)
        cells = problem.space.count
        level = SolvedLevel(problem.unknowns, cells, best, log.residuals, log.seconds)
        yield stopping.judged(
            LevelSolution(level, problem, solution.pressure, solution.stream, corrected)
        )
        del corrected
        if stopping.ended:
            return
        # A uniform mesh has at least twice as many unknowns: every unknown has at least two sides,
        # a side has at most two ends, and the midpoint of each side becomes an unknown.
        if strategy.uniform and 2 * problem.unknowns > max_unknowns:
            stopping.stop(_too_many(max_unknowns))
            return
        log = _Log()
        refine = _refinement(problem, psi, solution, best, strategy, outlook, log)
        # Two meshes together may not fit into memory: this one goes, and only `refine` stays.
        del problem, guesses, psi, solution
        try:
            start = refine(gap)
        except TooFine as limit:
            stopping.stop(str(limit))
            return
        del refine
        log.lap("refine")


@dataclass(frozen=True, eq=False)
class _Solved:
    """Solutions on one mesh: pressure, regularised and true stream function."""

    pressure: Pressures
    regularised: Streams | None = None
    stream: Streams | None = None
    #: (u - l)/l of the corrected bounds that the regularised dual foretells; near a tolerance it is
    #: nearly the width (u - l)/√(l u)
    expected: float = np.inf


@dataclass
class _Outlook:
    """What the meshes so far foretell of the next one."""

    true_dual: bool  #: whether the true dual is solved first, since the bounds may decide there
    #: ratio of (u - l)/l after and before the hierarchical correction
    correction_ratio: float = USUAL_CORRECTION_RATIO

    def learn(self, problem: LevelProblem, solution: _Solved, bounds: Bounds, rtol: float) -> None:
        """Take how much the correction has narrowed the bounds of a mesh, and how near they are."""
        if solution.stream is not None and np.isfinite(bounds.excess):
            solved = problem.excess(solution.pressure, solution.stream)
            self.correction_ratio = excess_ratio(bounds.excess, solved)
            self.true_dual = True
        if solution.expected < DUAL_NEXT * rtol:
            self.true_dual = True


def excess_ratio(corrected: float, solved: float) -> float:
    """Ratio of (u - l)/l of the corrected bounds and of the solved ones."""
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


def _solve(
    problem: LevelProblem,
    guesses: list[np.ndarray],
    psi: np.ndarray,
    strategy: Strategy,
    outlook: _Outlook,
    log: _Log,
) -> _Solved:
    """Solve the primal and, if it may end the refinement, the true dual.

    Unless that comes first, the regularised dual is solved before it: the true dual then follows
    if the expected width is close to the tolerance, or if the next mesh would be too large.
    """
    pressure = problem.pressure(guesses)
    log.lap("primal", pressure)
    regularised, expected = None, np.inf
    if not outlook.true_dual:
        regularised = _regularised_dual(problem, psi, strategy, log)
        psi = regularised.psi
        last = GROWTH * problem.unknowns > (strategy.max_unknowns or np.inf)
        expected = outlook.correction_ratio * problem.excess(pressure, regularised)
        if not last and expected >= DUAL_AT_ONCE * strategy.rtol:
            return _Solved(pressure, regularised, expected=expected)
    stream = problem.stream(psi)
    log.lap("dual", stream)
    return _Solved(pressure, regularised, stream, expected)


def _bounded(
    problem: LevelProblem, solution: _Solved, log: _Log
) -> tuple[Bounds, CorrectedBounds | None]:
    """Bounds of a solution, with the hierarchical correction if the true dual is solved."""
    bounds = problem.upper_bound(solution.pressure)
    if solution.stream is None:
        return bounds, None
    corrected = problem.corrected(solution.pressure, solution.stream)
    log.lap("correction")
    return corrected.tightened(bounds), corrected


def _regularised_dual(
    problem: LevelProblem, psi: np.ndarray, strategy: Strategy, log: _Log
) -> Streams:
    """Solve the regularised dual from stream functions of unit jumps."""
    regularised = problem.stream(psi, strategy.tuning.chi)
    if regularised is None:
        raise Inconsistent("contact bars an open gap; please report the gap as a defect")
    log.lap("regularised dual", regularised)
    return regularised


def _refinement(
    problem: LevelProblem,
    psi: np.ndarray,
    solution: _Solved,
    best: Bounds,
    strategy: Strategy,
    outlook: _Outlook,
    log: _Log,
) -> Callable[[GapOnMesh], Start]:
    """Mark cells: all, or by the regularised dual and the flows that it shows.

    Returns what refines and looks ahead; of the problem it holds no more than that needs.
    """
    if strategy.marking is None:
        start = problem.start(solution.pressure, solution.stream)
        return partial(refined_ahead, start, marks=mark_all(problem), flows=[], times=0)
    # If the true dual came first, the next level logs the time of this solve.
    if solution.stream is not None:
        psi = solution.stream.psi
    regularised = solution.regularised or _regularised_dual(problem, psi, strategy, log)
    flows = problem.flows(solution.pressure, regularised)
    expected = outlook.correction_ratio * problem.excess(solution.pressure, regularised)
    reached = best.width if solution.stream is not None else np.inf
    marks = strategy.marking(problem, flows, expected, reached, strategy)
    return partial(
        refined_ahead,
        problem.start(solution.pressure, regularised),
        marks=marks,
        # Looking ahead takes the functions from the start.
        flows=[flow.without_functions() for flow in flows],
        times=strategy.tuning.ahead,
    )
