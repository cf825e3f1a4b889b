"""When a refinement ends although its goal is not reached."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

from fem_seal.flow.goal import Decision, Tolerance
from fem_seal.leak_rate import Level, relative_width
from fem_seal.memory import available_memory, peak_memory

USUAL_GROWTH = 2.0  # of an adaptive mesh from level to level, and of the memory at its peak
# Of the largest gap. A line of narrower gaps across the flow may take more unknowns than can be
# numbered: at 1e-6 it takes some 1e8 for 5 %, at 1e-9 some 1e10 (sixteen pixels).
DOUBTFUL = 1e-6


@dataclass(frozen=True)
class Limits:
    """Where to stop although the tolerance is not reached.

    unknowns : no larger mesh is solved, except the first
    seconds : of wall time; the next level must be expected to end before, by the time of the last
    memory_bytes : of one process; the next level must be expected to fit. Without it, what the
        machine has is the limit
    """

    unknowns: int | None = None
    seconds: float | None = None
    memory_bytes: int | None = None

    def exceeded(self, started: float, growth: float = USUAL_GROWTH, last: float = 0.0) -> str:
        """Which limit the next level, `growth` times as large, would pass; "" if none.

        Parameters
        ----------
        started : perf_counter() at the start
        growth : of the unknowns, and of time and memory with them
        last : seconds of the last level
        """
        spent = time.perf_counter() - started
        if self.seconds is not None and spent >= self.seconds:
            return f"the limit of {self.seconds:g} s is used up"
        if self.seconds is not None and spent + growth * last >= self.seconds:
            return f"the next mesh would take longer than the limit of {self.seconds:g} s allows"
        peak = peak_memory()
        if self.memory_bytes is not None and growth * peak >= self.memory_bytes:
            return f"the next mesh would need more than {self.memory_bytes / 1e9:.2g} GB"
        if growth * peak >= peak + available_memory():
            return f"the next mesh would need some {growth * peak / 1e9:.2g} GB, more than there is"
        return ""


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
