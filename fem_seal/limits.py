"""Where a computation stops although its tolerance is not reached."""

import time
from dataclasses import dataclass

from fem_seal.memory import available_memory, peak_memory

USUAL_GROWTH = 2.0  # of an adaptive mesh from level to level, and of the memory at its peak


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
