"""Adaptive refinement: solve, bound, mark, refine, until the bounds agree.

On each mesh, with unit pressure drop and K = g³ (`level.py`),

    primal             Q_hi   = min_p ∫ K|∇p|²,       p = 1 at the inlet, 0 at the outlet
    dual               1/Q_lo = min_ψ ∫ |∇ψ|²/K,      ψ of unit flux, constant in blocked cells
    regularised dual   1/Q_ε  = min_ψ ∫ ∇ψ·R_ε·∇ψ,    blocked cells conduct ε times as in the primal

    indicators         e_T = ∫_T K|∇p|² + J·R_ε·J + 2 J·∇p >= 0,   Σ e_T = Q_hi - Q_ε

Only primal and dual are bounds. A blocked cell is partly in contact, so that the dual must take ψ
constant in it. The regularised dual shows how much would flow through the blocked cells once they
are resolved. It is solved on every level and steers the refinement; the dual is solved when Q_hi
and Q_ε are close to the tolerance.

Four sets of cells are marked. By Dörfler's rule: those with the largest e_T; the blocked cells
with the largest flux, since a channel that a few blocked cells close has small e_T although all
its flux is missing from Q_lo; and, where the pressure's residuals exceed Σ e_T, those with the
largest jumps of its flux. And the equipotential cells that meet only at vertices of small gap
(`LevelProblem.joints`). `look_ahead.py` refines further without a solve.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fem_seal.errors import Inconsistent, present
from fem_seal.fenicsx import MPI
from fem_seal.flow.energy import ROUNDING
from fem_seal.flow.gap_on_mesh import ConstantGap, LinearGap, VertexGap
from fem_seal.flow.level import LevelProblem, Stream
from fem_seal.flow.linear import Minimum
from fem_seal.flow.look_ahead import refined_ahead
from fem_seal.flow.marking import Marks, completed, doerfler, halvings
from fem_seal.flow.start import Guess, Start
from fem_seal.leak_rate import Level, relative_width
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.triangles import TriangleMesh

# Ratio of the bracket's widths after and before the hierarchical correction, until it is measured.
USUAL_GAIN = 0.4
# Largest growth of the unknowns from level to level: 3.9 was seen on open rough gaps.
GROWTH = 4.0
# Smallest part of a step by indicators while false flow spoils them.
WHILE_JOINED = 0.3


@dataclass(frozen=True)
class Tuning:
    """Parameters that change the cost of the bounds, never their validity (docs/adaptivity.md).

    Parameters
    ----------
    epsilon : float
        Factor ε of the regularised dual: blocked cells conduct ε times as much as in the
        primal.
    theta : float
        Part of the sum of the error indicators that the marked cells hold (Dörfler).
    theta_blocked : float
        Part of the flux through blocked cells that the marked ones carry.
    theta_residual : float
        Least part of the pressure's flux residuals, beyond the sum of the error indicators, that
        the marked cells hold.
    ahead : int
        Largest number of halvings ahead of a solve. More of them save levels and cost unknowns.
        The conductivity tensor does not look ahead.
    cut : float
        The dual treats gaps below this part of the critical constriction's gap as contact.
    floor : float
        The primal raises positive gaps to this part of the critical constriction's gap.
    ceiling : float
        Cells whose mean gap exceeds this multiple of the critical constriction's gap are
        equipotential. `cut`, `floor` and `ceiling` keep the contrast within the range of double
        precision.
    tolerance : float
        Relative error of the energy at which CG stops; the flux then has an error of its root.
    coarsest : int
        Squares along the shorter side of the first mesh.
    """

    epsilon: float = 0.1
    theta: float = 0.9
    theta_blocked: float = 0.7
    theta_residual: float = 0.5
    ahead: int = 2
    cut: float = 1e-2
    floor: float = 1e-4
    ceiling: float = 2e3
    tolerance: float = 1e-8
    coarsest: int = 32


@dataclass(frozen=True)
class Strategy:
    """How the mesh is refined.

    Parameters
    ----------
    uniform : bool
        Halve all cells instead of the marked ones.
    rtol : float
        Relative width (upper - lower) / √(lower upper) that the caller asks for. It decides
        when the true dual is solved and how large the last steps are.
    every_dual : bool
        Solve the true dual on every level, so that both bounds can be watched.
    max_unknowns : int or None
        Largest number of pressure unknowns of a mesh; the first mesh is solved in any case.
    tuning : Tuning
        Parameters of the refinement.
    """

    uniform: bool = False
    rtol: float = 0.05
    every_dual: bool = False
    max_unknowns: int | None = None
    tuning: Tuning = Tuning()


@dataclass(frozen=True, eq=False)
class Bracket:
    """One level of the refinement: the best bounds so far and the solutions on this mesh.

    Attributes
    ----------
    level : Level
        Numbers of this level for unit pressure drop and K = g³, g in units of its maximum.
    problem : LevelProblem
        The mesh with its numberings. The next level frees what PETSc holds of it.
    pressure : Minimum
        Solution of the primal problem.
    stream : Stream or None
        Solution of the true dual problem, if it was solved.
    """

    level: Level
    problem: LevelProblem
    pressure: Minimum
    stream: Stream | None

    @property
    def stalled(self) -> str:
        """Reason why CG stopped short of its tolerance in a solve behind the bounds, else ""."""
        return self.pressure.stalled or (self.stream.stalled if self.stream else "")

    def certified(self) -> "Bracket":
        """The same bracket with the dual solved, for a caller that stops before it was."""
        if self.stream is not None:
            return self
        _, guess = self.problem.mesh.first_guess()
        stream = self.problem.stream(guess)
        if stream is None:
            return self
        lower, upper = self.problem.corrected(self.pressure, stream)
        iterations = {**self.level.iterations, "dual": stream.iterations}
        lower, upper = max(lower, self.level.lower), min(upper, self.level.upper)
        level = replace(self.level, lower=lower, upper=upper, iterations=iterations)
        return Bracket(level, self.problem, self.pressure, stream)


class _Log:
    """Cost of a level: seconds between laps and CG iterations, by stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.iterations: dict[str, int] = {}
        self._last = time.perf_counter()

    def lap(self, name: str, solved: Minimum | Stream | None = None) -> None:
        now = time.perf_counter()
        self.seconds[name] = now - self._last
        self._last = now
        if solved is not None:
            self.iterations[name] = solved.iterations


def brackets(
    gap: LinearGap | ConstantGap | VertexGap,
    mesh: NestedMesh | TriangleMesh,
    strategy: Strategy,
    comm: MPI.Comm,
    start: Start | None = None,
) -> Iterator[Bracket]:
    """Yield bounds on finer and finer meshes; the caller decides when to stop.

    Parameters
    ----------
    gap : the gap as represented; it must leave a path from inlet to outlet
    mesh : the first mesh
    strategy : how the mesh grows
    comm : MPI communicator; all ranks must take the same steps
    start : the first mesh with functions to start from, in place of `mesh`

    Raises
    ------
    TooFine
        If the next mesh would need triangles that the coordinates cannot hold.
    """
    # A mesh of a similar film is likely to be fine enough.
    near = strategy.uniform or strategy.every_dual or start is not None
    start = start or Start.first(gap, mesh)
    lower, upper = 0.0, np.inf
    gain, log = USUAL_GAIN, _Log()
    while True:
        problem = LevelProblem(gap, start.mesh, start.values, comm, strategy.tuning.tolerance)
        if upper < np.inf and problem.unknowns > (strategy.max_unknowns or np.inf):
            return
        guess = start.guess(problem)
        del start
        log.lap("mesh")
        solution = _solve(problem, guess, strategy, near, gain, log)
        upper = min(upper, solution.pressure.total.least_upper())
        if solution.stream is not None:
            corrected = problem.corrected(solution.pressure, solution.stream)
            lower, upper = max(lower, corrected[0]), min(upper, corrected[1])
            gain, near = solution.gain(*corrected), True
            log.lap("sharpening")
        counts = problem.unknowns, problem.space.count
        level = Level(*counts, lower, upper, log.iterations, log.seconds)
        yield Bracket(level, problem, solution.pressure, solution.stream)
        log = _Log()
        if strategy.uniform:
            # Stop before making a mesh that would exceed the limit. It has at least twice as many
            # unknowns: every unknown has at least two sides, a side has at most two ends, and the
            # midpoint of each side becomes an unknown.
            if 2 * problem.unknowns > (strategy.max_unknowns or np.inf):
                return
            # Halving all cells twice makes the uniform mesh with squares half as wide.
            twice = np.full(len(problem.kept), 2, dtype=np.int8)
            start = Start.after(problem, solution.pressure, solution.stream)
            del problem, guess, solution
            start = start.refined(gap, twice)
        else:
            solution = _with_regularised_dual(problem, guess, solution, strategy, log)
            reached = relative_width(lower, upper) if solution.stream is not None else np.inf
            marks = _mark(problem, solution, gain * solution.difference, reached, strategy)
            regularised = solution.regularised_dual
            start = Start.after(problem, solution.pressure, regularised)
            # Free this mesh before the next one is made.
            del problem, guess, solution
            start = refined_ahead(start, gap, marks, regularised, strategy.tuning.ahead)
        log.lap("refine")


@dataclass(frozen=True, eq=False)
class _Solved:
    """Solutions on one mesh: pressure, regularised and true stream function."""

    pressure: Minimum
    regularised: Stream | None
    stream: Stream | None

    @property
    def regularised_dual(self) -> Stream:
        """The regularised stream function, once it has been solved for."""
        return present(self.regularised, "regularised dual")

    @property
    def difference(self) -> float:
        """(Q_hi - Q_ε) / Q_ε, the relative width if all blocked cells were resolved."""
        return self.pressure.energy / self.regularised_dual.conductance - 1

    def gain(self, lower: float, upper: float) -> float:
        """Ratio of the relative widths of the corrected bounds and of the solved ones."""
        width = self.pressure.energy / present(self.stream, "dual").conductance - 1
        return (upper / lower - 1) / width if width > ROUNDING else 1.0


def _solve(
    problem: LevelProblem, guess: Guess, strategy: Strategy, near: bool, gain: float, log: _Log
) -> _Solved:
    """Solve the primal, the regularised dual unless `near`, and the dual if it may decide."""
    pressure = problem.pressure(guess.pressure)
    log.lap("primal", pressure)
    solution = _Solved(pressure, None, None)
    psi = guess.stream
    if not near:
        solution = _with_regularised_dual(problem, guess, solution, strategy, log)
        psi = solution.regularised_dual.psi
        last = GROWTH * problem.unknowns > (strategy.max_unknowns or np.inf)
        if not last and gain * solution.difference >= 2 * strategy.rtol:
            return solution
    stream = problem.stream(psi)
    log.lap("dual", stream)
    return replace(solution, stream=stream)


def _with_regularised_dual(
    problem: LevelProblem, guess: Guess, solution: _Solved, strategy: Strategy, log: _Log
) -> _Solved:
    """Solve the regularised dual unless that has been done.

    Where the dual has been solved first, this solve belongs to the refinement, and its time to
    the next level.
    """
    if solution.regularised is not None:
        return solution
    psi = guess.stream if solution.stream is None else solution.stream.psi
    regularised = problem.regularised_stream(psi, strategy.tuning.epsilon)
    if regularised is None:
        raise Inconsistent("contact bars an open gap; please report the gap as a defect")
    log.lap("regularised dual", regularised)
    return replace(solution, regularised=regularised)


def _mark(
    problem: LevelProblem, solution: _Solved, expected: float, reached: float, strategy: Strategy
) -> Marks:
    """Mark the cells of the whole mesh, and say how often to halve each.

    Parameters
    ----------
    problem, solution : the mesh and its solutions
    expected : relative width of the corrected bounds if all blocked cells were resolved
    reached : relative width of the corrected bounds; infinite if the dual was not solved
    strategy : tolerance and parameters
    """
    tuning = strategy.tuning
    regularised = solution.regularised_dual
    indicators = problem.indicators(solution.pressure, regularised)
    blocked_flux = problem.blocked_flux(regularised)
    # The flux that blocked cells withhold from Q_lo shows in `reached`, but neither in the
    # indicators nor in `expected`: take the size of its step from `reached`.
    part, part_reached = part_of_a_step(expected, strategy), part_of_a_step(reached, strategy)
    large = doerfler(indicators, part * tuning.theta)
    through = doerfler(blocked_flux, part_reached * tuning.theta_blocked)
    # Where the linear pressure leaks (see `residuals`), the indicators of the leaking cells are
    # small, but those of all cells along the false flow are large, whatever their size. Refine the
    # leaking cells first. Elsewhere the sum of the residuals is no more than that of the
    # indicators, which alone do better then.
    residuals = problem.residuals(solution.pressure, regularised.conductance)
    unexplained = max(residuals.sum() - indicators.sum(), 0.0)
    required = part_reached * tuning.theta_residual * unexplained
    held = residuals[large | through].sum()
    joints = problem.joints(regularised.conductance)
    whole = WHILE_JOINED if joints.any() else 1.0
    if held < required:
        whole = min(whole, max(held / required, WHILE_JOINED))
    if whole < 1:
        large = doerfler(indicators, whole * part * tuning.theta)
    leaks = completed(large | through, residuals, required)
    large = halvings(indicators, large)
    times = np.zeros(len(problem.kept), dtype=np.int8)
    times[problem.kept] = np.max([large, through, 2 * leaks, 4 * joints], axis=0)
    # The last step has a measured size: do not look ahead by indicators then.
    least_indicator = indicators[large > 0].min(initial=np.inf) if part == 1 else np.inf
    return Marks(times, float(least_indicator), float(blocked_flux[through].min(initial=np.inf)))


def part_of_a_step(width: float, strategy: Strategy) -> float:
    """Part of a full step that is still needed, so that the last step does not overshoot.

    Halving the cells that hold a part θ of the difference lowers it by about 0.63 θ. A step that
    just fails costs another level, a slightly larger one only a few unknowns: aim a tenth below
    the tolerance.

    Parameters
    ----------
    width : relative width of the bounds; infinite if there is no lower bound yet
    strategy : tolerance and parameters
    """
    aim = 0.9 * strategy.rtol
    needed = 1.6 * (1 - aim / max(width, aim)) / strategy.tuning.theta
    return float(np.clip(needed, 0.15, 1.0))
