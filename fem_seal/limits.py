"""Limits on unknowns, time and memory at which a refinement stops before its tolerance."""

import time
from dataclasses import dataclass

from fem_seal.arguments import require_count, require_not_negative
from fem_seal.memory import available_memory, peak_memory

# Usual ratio of the unknowns of an adaptive mesh, and of the peak memory, to the level before.
USUAL_GROWTH = 2.0


@dataclass(frozen=True)
class Limits:
    """Limits at which a refinement stops although its criterion is not met."""

    #: largest number of unknowns of a mesh; the first mesh is solved in any case
    unknowns: int | None = None
    #: wall time. The next level is not begun if it is expected to end later, judged by the time of
    #: the last one
    seconds: float | None = None
    #: memory of one process. The next level is not begun if it is expected to need more. The
    #: available memory of the machine is a limit in any case
    memory_bytes: float | None = None

    def __post_init__(self) -> None:
        limits = vars(self)
        require_not_negative(**{name: most for name, most in limits.items() if most is not None})
        if self.unknowns is not None:
            require_count(unknowns=self.unknowns)

    def why_exceeded(
        self, started: float, growth: float = USUAL_GROWTH, last: float = 0.0, what: str = "mesh"
    ) -> str:
        """Message on the limit that the next level would exceed; empty if there is none.

        It was `started` at a perf_counter(), and the last level took some seconds. `growth` is the
        expected ratio of the unknowns, and thus of time and memory, to those of that level. `what`
        names a level in the message.
        """
        spent = time.perf_counter() - started
        if self.seconds is not None and spent >= self.seconds:
            return f"the limit max_seconds = {self.seconds:g} s is used up"
        if self.seconds is not None and spent + growth * last >= self.seconds:
            return f"the next {what} would take longer than max_seconds = {self.seconds:g} s allows"
        peak = peak_memory()
        if self.memory_bytes is not None and growth * peak >= self.memory_bytes:
            most = f"max_memory = {self.memory_bytes / 1e9:.2g} GB"
            return f"the next {what} would need more than {most}"
        if growth * peak >= (free := peak + available_memory()):
            needed = f"{growth * peak / 1e9:.2g} GB"
            return (
                f"the next {what} would need {needed}, more than the {free / 1e9:.2g} GB there are"
            )
        return ""
