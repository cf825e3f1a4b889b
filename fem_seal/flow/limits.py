"""When a refinement ends although its goal is not reached."""

from collections.abc import Sequence
from dataclasses import dataclass

from fem_seal.flow.goal import Decision, Tolerance
from fem_seal.leak_rate import Level, relative_width
from fem_seal.limits import Limits

# Of the largest gap. A line of narrower gaps across the flow may take more unknowns than can be
# numbered: at 1e-6 it takes some 1e8 for 5 %, at 1e-9 some 1e10 (sixteen pixels).
DOUBTFUL = 1e-6


@dataclass(frozen=True, eq=False)
class End:
    """When a refinement ends before its goal: at a limit, or where the goal is out of reach.

    growth : of the unknowns to the next mesh
    narrowest : gap of the critical constriction over the largest one
    started : perf_counter() then
    """

    goal: Tolerance | Decision
    limits: Limits
    growth: float
    narrowest: float
    started: float

    @property
    def doubtful(self) -> bool:
        """Whether the goal may be out of reach, so that both bounds have to be watched."""
        return self.narrowest < DOUBTFUL

    def reason(self, levels: Sequence[Level]) -> str:
        """Say why no finer mesh than these is worth while, "" if one is."""
        last = sum(levels[-1].seconds.values())
        limit = self.limits.exceeded(self.started, self.growth, last)
        if limit or not self.doubtful:
            return limit
        # Half as many vertices as cells; unknowns may be fewer, where the pressure is constant.
        course = [(level.cells // 2, relative_width(level.lower, level.upper)) for level in levels]
        words = self.goal.out_of_reach(course)
        return words and (
            f"{words} (the critical constriction is {self.narrowest:.0e} of the largest gap: set "
            "such gaps to 0 if they are contact)"
        )
