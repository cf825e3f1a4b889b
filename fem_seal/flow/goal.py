"""When the bounds are good enough: near to each other, or on one side of a limit."""

from dataclasses import dataclass

from fem_seal.flow.course import Course, out_of_reach
from fem_seal.leak_rate import relative_width


@dataclass(frozen=True)
class Tolerance:
    """Bounds that are near to each other: upper - lower ≤ rtol √(lower upper)."""

    rtol: float

    def reached(self, lower: float, upper: float) -> bool:
        """Whether bounds [m³/s] satisfy it."""
        return bool(relative_width(lower, upper) <= self.rtol)

    def missed(self, lower: float, upper: float) -> str:
        """Say how far bounds [m³/s] are from it."""
        width = relative_width(lower, upper)
        state = f"the bracket is {width:.2g} wide" if lower > 0 else "no lower bound yet"
        return f"{state}, {self.rtol:.2g} was asked for"

    def out_of_reach(self, course: Course) -> str:
        """Say so if bounds that go on as so far never satisfy it, "" if they may."""
        return out_of_reach(course, self.rtol)


@dataclass(frozen=True)
class Decision:
    """Bounds on one side of a limit [m³/s], however far from each other."""

    limit: float

    # The refinement slows down when a tolerance is near; this one may need any.
    rtol = 0.0

    def reached(self, lower: float, upper: float) -> bool:
        """Whether bounds [m³/s] satisfy it."""
        return upper <= self.limit or lower > self.limit

    def missed(self, lower: float, upper: float) -> str:
        """Say how far bounds [m³/s] are from it."""
        below, above = lower / self.limit, upper / self.limit
        return f"the leak rate is between {below:.4g} and {above:.4g} of the limit, undecided"

    def out_of_reach(self, course: Course) -> str:
        """Nothing: wide bounds may decide as well as narrow ones."""
        return ""
