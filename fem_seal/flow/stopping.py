"""When a refinement ends: bounds near to each other or on one side of a limit; limits."""

from collections.abc import Sequence
from dataclasses import dataclass

from fem_seal.flow.convergence import ConvergenceHistory, out_of_reach
from fem_seal.leak_rate import Level, relative_width
from fem_seal.limits import Limits

# Part of the largest gap. If the critical constriction is a line of narrower gaps across the flow,
# refinement may need more unknowns than PETSc can number: for 5 % about 1e8 at a gap of 1e-6 of the
# largest, about 1e10 at 1e-9 (sixteen pixels).
DOUBTFUL = 1e-6


@dataclass(frozen=True)
class Tolerance:
    """Stopping criterion: bounds near to each other, upper - lower ≤ rtol √(lower upper).

    Parameters
    ----------
    rtol : float
        Largest relative width of the bracket.
    """

    rtol: float

    def reached(self, lower: float, upper: float) -> bool:
        """Whether bounds [m³/s] meet the criterion."""
        return bool(relative_width(lower, upper) <= self.rtol)

    def missed(self, lower: float, upper: float) -> str:
        """Message on the distance of bounds [m³/s] from the criterion."""
        width = relative_width(lower, upper)
        state = f"the bracket is {width:.2g} wide" if lower > 0 else "no lower bound yet"
        return f"{state}, {self.rtol:.2g} was asked for"

    def out_of_reach(self, history: ConvergenceHistory, growth: float) -> str:
        """Message if bounds that converge as in `history` never meet the criterion, else ""."""
        return out_of_reach(history, self.rtol, growth)


@dataclass(frozen=True)
class Decision:
    """Stopping criterion: both bounds on one side of a limit, at any distance from each other.

    Parameters
    ----------
    limit : float
        Limit of the leak rate [m³/s].
    """

    limit: float

    # The last steps of a refinement are smaller near a tolerance; a decision may need any width.
    rtol = 0.0

    def reached(self, lower: float, upper: float) -> bool:
        """Whether bounds [m³/s] meet the criterion."""
        return upper <= self.limit or lower > self.limit

    def missed(self, lower: float, upper: float) -> str:
        """Message on the distance of bounds [m³/s] from the criterion."""
        below, above = lower / self.limit, upper / self.limit
        return f"the leak rate is between {below:.4g} and {above:.4g} of the limit, undecided"

    def out_of_reach(self, history: ConvergenceHistory, growth: float) -> str:
        """Always "": wide bounds may decide as well as narrow ones."""
        return ""


@dataclass(frozen=True, eq=False)
class Stopping:
    """When a refinement ends before its criterion is met: at a limit, or out of reach.

    Parameters
    ----------
    criterion : Tolerance or Decision
        Condition on the bounds.
    limits : Limits
        Limits on unknowns, time and memory.
    growth : float
        Expected ratio of the unknowns of the next mesh to those of the last.
    narrowest : float
        Gap of the critical constriction over the largest gap.
    started : float
        perf_counter() at the start.
    """

    criterion: Tolerance | Decision
    limits: Limits
    growth: float
    narrowest: float
    started: float

    @property
    def doubtful(self) -> bool:
        """Whether the criterion may be out of reach, so that both bounds have to be watched."""
        return self.narrowest < DOUBTFUL

    def reason(self, levels: Sequence[Level]) -> str:
        """Reason to stop after these levels, "" to go on."""
        last = sum(levels[-1].seconds.values())
        limit = self.limits.exceeded(self.started, self.growth, last)
        if limit or not self.doubtful:
            return limit
        # A mesh has half as many vertices as cells. Unknowns would not do as a measure: where the
        # pressure is constant there are fewer.
        history = [(level.cells // 2, relative_width(level.lower, level.upper)) for level in levels]
        words = self.criterion.out_of_reach(history, self.growth)
        return words and (
            f"{words} (the critical constriction is {self.narrowest:.0e} of the largest gap: set "
            "such gaps to 0 if they are contact)"
        )
