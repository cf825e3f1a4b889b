"""When a refinement ends: its bounds agree or decide against a limit, or it costs too much."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import exp
from typing import ClassVar

import numpy as np

from fem_seal.fenicsx import MPI
from fem_seal.flow.level import LevelSolution
from fem_seal.flow.solution import SolvedLevel
from fem_seal.leak_rate import Factors, LeakRate, relative_width
from fem_seal.limits import Limits

# Critical constriction over the largest gap, below which a tolerance may be out of reach. If a line
# of such small gaps lies across the flow, refinement may need more unknowns than PETSc can number:
# for 5 % about 1e8 at a ratio of 1e-6, about 1e11 at 1e-9 (eight pixels along the line).
DOUBTFUL = 1e-6
GROWTH_FOR_ORDER = 16  # growth of the unknowns over which the order of convergence is measured
MOST_UNKNOWNS = 2**31 - 1  # largest number of unknowns for the indices of PETSc

ConvergenceHistory = Sequence[tuple[int, float]]


def out_of_reach(history: ConvergenceHistory, rtol: float, growth: float) -> str:
    """Message if the bounds converge too slowly ever to reach a tolerance, "" if they may reach it.

    A line of tiny gaps across the flow must be resolved along its whole length, and the unknowns
    that this takes are inversely proportional to its width. The cost of a single narrow spot grows
    only as a logarithm. The measured order p of width ~ unknowns^-p over the last sixteenfold
    growth distinguishes the two.

    `history` holds the vertices of each mesh, nearly its unknowns, and the relative width of its
    bounds; `growth` is the usual growth from mesh to mesh. Where a mesh grows faster, it has been
    refined along lines before a solve could tell which of them matter: the order is measured over
    at least log(16)/log(growth) meshes.
    """
    unknowns, width = history[-1]
    meshes = round(np.log(GROWTH_FOR_ORDER) / np.log(growth))
    starts = [
        k
        for k, (before, _) in enumerate(history[:-meshes])
        if GROWTH_FOR_ORDER * before <= unknowns
    ]
    if not starts or width <= rtol:
        return ""
    judged = history[starts[-1] :]
    before, widest = judged[0]
    # If the width has risen meanwhile, a new channel has been resolved: no order can be measured.
    if not width < widest < np.inf or max(value for _, value in judged) > widest:
        return ""
    order = np.log(widest / width) / np.log(unknowns / before)
    if np.log(unknowns) + np.log(width / rtol) / order <= np.log(MOST_UNKNOWNS):
        return ""
    return (
        f"at the rate of the last meshes the tolerance needs more than {MOST_UNKNOWNS} unknowns, "
        "more than can be numbered"
    )


@dataclass(frozen=True)
class Tolerance:
    """Stopping criterion: bounds near to each other, upper - lower ≤ rtol √(lower upper)."""

    #: largest relative width of the bounds; for a gas that slips of those at the mean pressure,
    #: since no mesh closes the rest
    rtol: float

    def reached(self, solution: LevelSolution) -> bool:
        """Whether the bounds of a solution meet the criterion."""
        return bool(solution.level.bounds.width <= self.rtol)

    def why_undecidable(self, solution: LevelSolution) -> str:
        """Empty: finer meshes narrow any bounds."""
        return ""

    def missed(self, leak: LeakRate) -> str:
        """Message on the distance of bounds from the criterion."""
        lower, upper = leak.refined_bounds
        width = relative_width(lower, upper)
        state = f"relative width of the bounds {width:.2g}" if lower > 0 else "no lower bound yet"
        return f"{state}, and rtol = {self.rtol:.2g} was asked for"


@dataclass(frozen=True)
class Decision:
    """Stopping criterion: both bounds on one side of a limit, at any distance from each other."""

    limit: float  #: limit of the leak rate [m³/s]
    unit: float  #: leak rate [m³/s] in which the bounds are written
    #: error of ln Q outside the bounds, by which they are widened before they are compared
    margin: float = 0.0

    # Near a tolerance the steps of a refinement become smaller, and it may be out of reach. A
    # decision may need any width.
    rtol: ClassVar[float] = 0.0

    def reached(self, solution: LevelSolution) -> bool:
        """Whether both bounds, widened by slip and margin, lie on one side of the limit."""
        lower, upper = (solution.slip or solution.level.bounds).numbers
        unit, factor = self.unit, exp(self.margin)
        return upper * factor * unit <= self.limit or lower / factor * unit > self.limit

    def missed(self, leak: LeakRate) -> str:
        """Message on the distance of bounds from the criterion."""
        below, above = (bound / self.limit for bound in leak.bounds)
        return f"the flow alone puts it between {below:.4g} and {above:.4g} times the limit"

    def why_undecidable(self, solution: LevelSolution) -> str:
        """Message if no mesh can decide because of slip or the margin; else empty."""
        bounds = solution.level.bounds
        lower, upper = bounds.numbers
        if lower == 0 or (solution.slip is None and self.margin == 0):
            return ""
        error = Factors(exp(-self.margin), exp(self.margin))
        if solution.slip is not None:
            error *= solution.slip.slip_factors(bounds)
        if lower * error.upper * self.unit >= self.limit >= upper * error.lower * self.unit:
            if self.margin == 0:
                return "the limit lies within the uncertainty of the slip, which no mesh reduces"
            cause = "lift" if solution.slip is None else "slip and lift"
            return (
                f"the limit lies within the uncertainty of the {cause}, which no further mesh "
                "reduces; a smaller flow.rtol reduces that of the lift, if the verdict asks for "
                "nothing else"
            )
        return ""


def unchanged(solution: LevelSolution) -> LevelSolution:
    """Return the solution as it is: without slip there are no bounds to add."""
    return solution


@dataclass(eq=False)
class Stopping:
    """Ends a refinement whose criterion is met or out of reach, or at a limit."""

    criterion: Tolerance | Decision  #: condition on the bounds
    limits: Limits  #: limits on unknowns, time and memory
    growth: float  #: expected ratio of the unknowns of the next mesh to those of the last
    narrowest: float  #: gap of the critical constriction over the largest gap
    comm: MPI.Comm  #: the first of its ranks decides
    advice: str = ""  #: what to do if the tolerance is out of reach
    #: adds to a solution the bounds for a gas that slips, before it is judged
    with_slip_bounds: Callable[[LevelSolution], LevelSolution] = unchanged
    started: float = field(default_factory=time.perf_counter)  #: perf_counter() at the start
    #: history of the refinement
    levels: list[SolvedLevel] = field(default_factory=list, init=False)
    reached: bool = field(default=False, init=False)  #: whether the criterion is met
    #: reason to end although the criterion is not met; empty if none
    reason: str = field(default="", init=False)

    @property
    def doubtful(self) -> bool:
        """Whether the criterion may be out of reach; both bounds are then solved on every mesh."""
        return self.narrowest < DOUBTFUL

    @property
    def ended(self) -> bool:
        """Whether the last level judged is the last of the refinement."""
        return self.reached or bool(self.reason)

    def stop(self, reason: str) -> None:
        """End the refinement between two meshes."""
        self.reason = reason

    def judged(self, solution: LevelSolution) -> LevelSolution:
        """Decide whether the refinement ends with this solution; certify it if it does."""
        solution = self.with_slip_bounds(solution)
        self.levels.append(solution.level)
        self.reached = self.criterion.reached(solution)
        if not self.reached:
            self.reason = self._reason_to_stop(solution)
        if self.reason and solution.stream is None:
            solution = self.with_slip_bounds(solution.certified())
            self.levels[-1] = solution.level
            self.reached = self.criterion.reached(solution)
            self.reason = "" if self.reached else self.reason
        return solution

    def _reason_to_stop(self, solution: LevelSolution) -> str:
        """Reason to end with this solution, "" to go on."""
        last = sum(solution.level.seconds.values())
        limit = self.limits.why_exceeded(self.started, self.growth, last)
        if not limit and self.doubtful and self.criterion.rtol > 0:
            # A mesh has half as many vertices as cells. Unknowns would not do as a measure: where
            # the pressure is constant there are fewer.
            history = [(level.cells // 2, level.bounds.width) for level in self.levels]
            words = out_of_reach(history, self.criterion.rtol, self.growth)
            limit = words + self.advice if words else ""
        # Time and memory differ from rank to rank.
        limit = self.comm.bcast(limit)
        stalled = solution.stalled if self._no_closer() else ""
        return limit or stalled or self.criterion.why_undecidable(solution)

    def _no_closer(self) -> bool:
        """Whether the last two meshes have hardly improved the bounds."""
        if len(self.levels) < 3:
            return False
        before, last = self.levels[-3], self.levels[-1]
        return last.bounds.hardly_better(before.bounds)
