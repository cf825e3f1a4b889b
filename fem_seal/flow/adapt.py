"""Refine where the bounds disagree until they agree: the loop around one level.

Each level solves the primal and the regularised dual; cells are marked by what they add to the
difference of the two (Dörfler), and among the closed cells those that most of the flow would pass
are marked too: a channel kept shut by a few cells of small resistance adds little to the
difference of energies, yet all its flow is missing from the lower bound. What marked cells leave to
mark is refined as well, without a solve (`look_ahead.py`). The true dual, which alone is a bound,
is solved when the regularised one says that the tolerance is near.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fem_seal.errors import Inconsistent
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

USUAL_GAIN = 0.4  # ratio of the half-widths after and before sharpening, until one is measured
GROWTH = 4.0  # of the unknowns from level to level, at most: 3.9 were seen on open rough gaps
WHILE_JOINED = 0.3  # least part of a step by shares, where false flow spoils them


@dataclass(frozen=True)
class Tuning:
    """Numbers that cost time or unknowns but never the truth of the bounds (docs/adaptivity.md).

    epsilon : conductivity of closed cells in the regularised dual, relative to the primal's
    theta : part of the difference of energies that the marked cells hold
    theta_throughflow : part of the flow through closed cells that the marked ones carry
    theta_residual : part of the pressure's residuals that the marked cells hold at least
    ahead : halvings ahead of a solve, at most; more of them save levels and cost unknowns (of the
        leak rate; the conductivity tensor does not look ahead)
    cut : the dual takes gaps below this part of the critical constriction for contact
    floor : the primal raises positive gaps to this part of it
    ceiling : where the gap is this many times it, the pressure is taken to be constant; cut, floor
        and ceiling keep the contrast within what double precision can solve
    tolerance : relative error of the energy at which CG stops; the flux has its square root
    coarsest : squares along the shorter side of the first mesh
    """

    epsilon: float = 0.1
    theta: float = 0.9
    theta_throughflow: float = 0.7
    theta_residual: float = 0.5
    ahead: int = 2
    cut: float = 1e-2
    floor: float = 1e-4
    ceiling: float = 2e3
    tolerance: float = 1e-8
    coarsest: int = 32


@dataclass(frozen=True)
class Strategy:
    """How the mesh grows.

    uniform : halve all cells instead of those that matter
    rtol : tolerance (upper - lower) / √(lower upper) the caller is after; it steers when the true
        dual is solved and how large the last steps are
    every_dual : solve the true dual on every level, so that both bounds can be watched
    max_unknowns : no mesh with more pressure unknowns is solved, except the first
    tuning : the numbers behind it
    """

    uniform: bool = False
    rtol: float = 0.05
    every_dual: bool = False
    max_unknowns: int | None = None
    tuning: Tuning = Tuning()


@dataclass(frozen=True, eq=False)
class Bracket:
    """A level of the refinement: the bounds so far and the solution behind them.

    level : numbers of this level for unit pressure drop and K = g³, g in units of its maximum
    problem, pressure : the mesh with its primal solution; what PETSc holds of it is freed when
        the next level is asked for
    stream : the true dual's, if it was solved
    """

    level: Level
    problem: LevelProblem
    pressure: Minimum
    stream: Stream | None

    @property
    def stalled(self) -> str:
        """Why CG stopped short of its tolerance in a solve behind the bounds, "" if it did not."""
        return self.pressure.stalled or (self.stream.stalled if self.stream else "")

    def certified(self) -> "Bracket":
        """The same with the true dual, for a caller who has to stop before it was solved."""
        if self.stream is not None:
            return self
        _, guess = self.problem.mesh.first_guess()
        stream = self.problem.stream(guess)
        if stream is None:
            return self
        lower, upper = self.problem.sharpened(self.pressure, stream)
        iterations = {**self.level.iterations, "dual": stream.iterations}
        lower, upper = max(lower, self.level.lower), min(upper, self.level.upper)
        level = replace(self.level, lower=lower, upper=upper, iterations=iterations)
        return Bracket(level, self.problem, self.pressure, stream)


class _Log:
    """What a level costs: seconds between laps, by name, and iterations of the solves."""

    def __init__(self):
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
) -> Iterator[Bracket]:
    """Bounds on ever finer meshes; the caller stops when it has seen enough.

    Parameters
    ----------
    gap : the gap as represented; it must leave a path from inlet to outlet
    mesh : the first mesh
    strategy : how the mesh grows
    comm : MPI communicator; all ranks must take the same steps

    Raises
    ------
    TooFine
        If the next mesh would need triangles that the coordinates cannot hold.
    """
    start = Start.first(gap, mesh)
    lower, upper, near = 0.0, np.inf, strategy.uniform or strategy.every_dual
    gain, log = USUAL_GAIN, _Log()
    while True:
        problem = LevelProblem(gap, start.mesh, start.values, comm, strategy.tuning.tolerance)
        if upper < np.inf and problem.unknowns > (strategy.max_unknowns or np.inf):
            return
        guess = start.guess(problem)
        del start
        log.lap("mesh")
        found = _solve(problem, guess, strategy, near, gain, log)
        upper = min(upper, found.pressure.total.least_upper())
        if found.stream is not None:
            sharper = problem.sharpened(found.pressure, found.stream)
            lower, upper = max(lower, sharper[0]), min(upper, sharper[1])
            gain, near = found.gain(*sharper), True
            log.lap("sharpening")
        counts = problem.unknowns, problem.space.count
        level = Level(*counts, lower, upper, log.iterations, log.seconds)
        yield Bracket(level, problem, found.pressure, found.stream)
        log = _Log()
        if strategy.uniform:
            # Each unknown has two sides at least, each of them two ends at most, and its middle
            # becomes an unknown: a mesh that would only be counted need not be made.
            if 2 * problem.unknowns > (strategy.max_unknowns or np.inf):
                return
            # Halving all cells twice makes the uniform mesh with squares half as wide.
            twice = np.full(len(problem.kept), 2, dtype=np.int8)
            start = Start.after(problem, found.pressure, found.stream)
            del problem, guess, found
            start = start.refined(gap, twice)
        else:
            found = _guided(problem, guess, found, strategy, log)
            reached = relative_width(lower, upper) if found.stream is not None else np.inf
            marks = _mark(problem, found, gain * found.difference, reached, strategy)
            start, guide = Start.after(problem, found.pressure, found.guide), found.guide
            # Two meshes need not be in memory at once.
            del problem, guess, found
            start = refined_ahead(start, gap, marks, guide, strategy.tuning.ahead)
        log.lap("refine")


@dataclass(frozen=True, eq=False)
class _Solved:
    """Solutions on one mesh: pressure, guiding (regularised) and true stream function."""

    pressure: Minimum
    guide: Stream | None
    stream: Stream | None

    @property
    def difference(self) -> float:
        """Relative width of the bounds before sharpening, if all closed cells were open."""
        return self.pressure.energy / self.guide.conductance - 1

    def gain(self, lower: float, upper: float) -> float:
        """Relative width of sharper bounds over that of those solved for."""
        width = self.pressure.energy / self.stream.conductance - 1
        return (upper / lower - 1) / width if width > ROUNDING else 1.0


def _solve(
    problem: LevelProblem, guess: Guess, strategy: Strategy, near: bool, gain: float, log: _Log
) -> _Solved:
    """Solve the primal, and the true dual where it may decide: if it is near, or by the guide."""
    pressure = problem.pressure(guess.pressure)
    log.lap("primal", pressure)
    found = _Solved(pressure, None, None)
    psi = guess.stream
    if not near:
        found = _guided(problem, guess, found, strategy, log)
        psi = found.guide.psi
        last = GROWTH * problem.unknowns > (strategy.max_unknowns or np.inf)
        if not last and gain * found.difference >= 2 * strategy.rtol:
            return found
    stream = problem.stream(psi)
    log.lap("dual", stream)
    return replace(found, stream=stream)


def _guided(
    problem: LevelProblem, guess: Guess, found: _Solved, strategy: Strategy, log: _Log
) -> _Solved:
    """Solve the regularised dual, unless that was done.

    After the true dual it is solved only if the mesh is refined: its time is the next level's.
    """
    if found.guide is not None:
        return found
    psi = guess.stream if found.stream is None else found.stream.psi
    guide = problem.regularised_stream(psi, strategy.tuning.epsilon)
    if guide is None:
        raise Inconsistent("contact bars an open gap; please report the gap as a defect")
    log.lap("regularised dual", guide)
    return replace(found, guide=guide)


def _mark(
    problem: LevelProblem, found: _Solved, expected: float, reached: float, strategy: Strategy
) -> Marks:
    """Which cells of the whole mesh to halve, and how often.

    Parameters
    ----------
    expected : relative width of the sharpened bounds if all closed cells were open
    reached : what it is, infinite where that is not known
    """
    tuning = strategy.tuning
    shares = problem.shares(found.pressure, found.guide)
    throughflow = problem.throughflow(found.guide)
    # What closed cells keep from the lower bound is not in the shares, nor in what is expected.
    part, part_reached = part_of_a_step(expected, strategy), part_of_a_step(reached, strategy)
    large = doerfler(shares, part * tuning.theta)
    through = doerfler(throughflow, part_reached * tuning.theta_throughflow)
    # Where the pressure lets flow pass that should not, the cells concerned add little to the
    # difference of energies, but all others on the way of that flow do, whatever their size: it is
    # no use to refine these before those.
    residuals = problem.residuals(found.pressure, found.guide.conductance)
    wanted = part_reached * tuning.theta_residual * residuals.sum()
    held = residuals[large | through].sum()
    joints = problem.joints()
    whole = WHILE_JOINED if joints.any() else 1.0
    if held < wanted:
        whole = min(whole, max(held / wanted, WHILE_JOINED))
    if whole < 1:
        large = doerfler(shares, whole * part * tuning.theta)
    leaks = completed(large | through, residuals, part_reached * tuning.theta_residual)
    large = halvings(shares, large)
    times = np.zeros(len(problem.kept), dtype=np.int8)
    times[problem.kept] = np.max([large, through, 2 * leaks, 4 * joints], axis=0)
    # The size of a last step is measured: nothing is added to its share ahead of the solve.
    least_share = shares[large > 0].min(initial=np.inf) if part == 1 else np.inf
    return Marks(times, float(least_share), float(throughflow[through].min(initial=np.inf)))


def part_of_a_step(width: float, strategy: Strategy) -> float:
    """How much of a full step is left to do: the last one should not overshoot the tolerance.

    Halving the cells that hold a part θ of the difference lowers it by about 0.63 θ. A step that
    just fails costs one level more, a larger one few unknowns: it aims a tenth below the tolerance.

    Parameters
    ----------
    width : relative, of the bounds; infinite if they are still far apart
    """
    aim = 0.9 * strategy.rtol
    needed = 1.6 * (1 - aim / max(width, aim)) / strategy.tuning.theta
    return float(np.clip(needed, 0.15, 1.0))
