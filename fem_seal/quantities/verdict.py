"""The verdict: what the bounds say about a limit, and what it would take if they say nothing."""

from dataclasses import dataclass
from math import log, sinh, sqrt

from fem_seal.digits import bracket_digits, rounded_down, rounded_up
from fem_seal.leak_rate import LeakRate
from fem_seal.units import Rate

# Below this no refinement is worth naming; the estimate is not known so well.
LEAST_RTOL = 1e-6


@dataclass(frozen=True)
class Verdict:
    """A decision and its reasons.

    decision : "sealed"; "leaking", where no limit is given; "within limit" (upper bound <= limit),
        "above limit" (lower bound > limit), "undecided"
    sentence : the decision in words
    limit : of the leak rate, as given; None without one
    needed_rtol, needed_unknowns : estimates of what would decide an undecided one, else None. The
        truth is taken to be √(lower upper), and brackets to narrow as one over the unknowns.
    """

    decision: str
    sentence: str
    limit: str | None = None
    needed_rtol: float | None = None
    needed_unknowns: int | None = None


@dataclass(frozen=True)
class Shown:
    """How leak rates are shown: a unit, and how many of it are 1 m³/s of the solved leak rate."""

    name: str
    per_solved: float

    def text(self, solved: float) -> str:
        """A solved leak rate [m³/s] in the unit."""
        return f"{solved * self.per_solved:.4g} {self.name}"

    def at_least(self, solved: float) -> str:
        """A lower bound in the unit, rounded down."""
        return f"{rounded_down(solved * self.per_solved)} {self.name}"

    def at_most(self, solved: float) -> str:
        """An upper bound in the unit, rounded up."""
        return f"{rounded_up(solved * self.per_solved)} {self.name}"

    def between(self, leak: LeakRate) -> str:
        """Text of the bounds, or of the estimate where there are none."""
        if leak.lower is None:
            return f"about {self.text(leak.value)}, without bounds"
        bracket = (self.per_solved * rate for rate in (leak.value, leak.lower, leak.upper))
        _, low, high = bracket_digits(*bracket)
        return f"between {low} and {high} {self.name}"


def verdict(
    leak: LeakRate, shown: Shown, limit: Rate | None, limit_solved: float | None
) -> Verdict:
    """Hold the bounds of a leak rate against a limit.

    Parameters
    ----------
    leak : with bounds if there is a limit
    shown : the unit for the sentence
    limit : as given, or None
    limit_solved : the same for the solved leak rate [m³/s]
    """
    given = None if limit is None else f"{limit.number:g} {limit.unit.name}"
    if leak.state == "sealed":
        return Verdict("sealed", "sealed: no open path joins inlet and outlet", given)
    if limit is None:
        return Verdict("leaking", f"leaking {shown.between(leak)}; no limit was given")
    allowed = f"{shown.text(limit_solved)} allowed"
    if leak.upper <= limit_solved:
        share = rounded_up(100 * leak.upper / limit_solved)
        most = f"at most {shown.at_most(leak.upper)}, {share} %"
        return Verdict("within limit", f"within limit: {most} of the {allowed}", given)
    if leak.lower > limit_solved:
        times = rounded_down(leak.lower / limit_solved)
        least = f"at least {shown.at_least(leak.lower)}, {times} times"
        return Verdict("above limit", f"above limit: {least} the {allowed}", given)
    rtol, unknowns = what_would_decide(leak, limit_solved)
    sentence = f"undecided: {shown.between(leak)}, {allowed}; {_wish(leak, rtol, unknowns)}"
    return Verdict("undecided", sentence, given, rtol, unknowns)


def what_would_decide(leak: LeakRate, limit: float) -> tuple[float | None, int | None]:
    """Tolerance, and unknowns, at which the bounds would part from the limit; None if unknown.

    With a leak rate of √(lower upper) a bracket as wide as twice ln(limit / leak rate), that is
    rtol = 2 sinh |ln(limit / leak rate)|, just touches the limit.
    """
    if leak.lower == 0:
        return None, None
    needed = 2 * sinh(abs(log(limit / sqrt(leak.lower * leak.upper))))
    if needed < LEAST_RTOL:
        return None, None
    reached = (leak.upper - leak.lower) / sqrt(leak.lower * leak.upper)
    # A wider bracket may decide as well if it lies on one side; it cannot lie on both.
    return needed, max(round(leak.unknowns * reached / needed), leak.unknowns)


def _wish(leak: LeakRate, rtol: float | None, unknowns: int | None) -> str:
    if leak.lower == 0:
        return "there is no lower bound yet, allow more unknowns, time or memory"
    if rtol is None:
        return "the best estimate is the limit itself"
    return f"flow.rtol = {rtol:.2g} might decide, with about {float(unknowns):.2g} unknowns"
