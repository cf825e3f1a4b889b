"""The verdict: the leak rate compared with a limit."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from fem_seal.digits import in_digits, rounded_down, rounded_up
from fem_seal.error_budget import (
    SLIP_INTERVAL,
    ErrorBudget,
    combined,
    ends_words,
    entry_words,
    may_close,
    may_open,
    outside_bounds,
)
from fem_seal.leak_rate import FlowState, LeakRate
from fem_seal.quantities.advice import DecidingRtol, deciding_setting, what_would_decide
from fem_seal.quantities.headline import Headline, ShownUnit, headline
from fem_seal.scene import Scene

DecisionName: TypeAlias = Literal[FlowState, "within limit", "above limit", "undecided"]
ZERO = "; zero holds only for what is covered"


@dataclass(frozen=True)
class Verdict:
    """A decision and its reasons.

    The decision is "sealed", "leaking" or "lifted off" where the scene has no limit; "within limit"
    if the highest leak rate that the error budget allows is <= limit; "above limit" if the lowest
    is > limit; else "undecided".
    """

    decision: DecisionName
    #: The decision, the headline, how it compares with the limit, and all uncertainties.
    sentence: str
    limit: str | None = None  #: limit of the leak rate as the scene states it
    #: Estimate of the tolerance that would decide an undecided verdict. It takes √(lower upper) for
    #: the true leak rate.
    needed_rtol: float | None = None
    #: Estimate of the unknowns that reach this tolerance, if the width of the bracket falls as one
    #: over the unknowns.
    needed_unknowns: int | None = None
    comparison: str = ""  #: the leak rate against the limit, and what would decide

    def __str__(self) -> str:
        return self.sentence


def verdict(
    scene: Scene, leak: LeakRate, budget: ErrorBudget = (), advice: str | None = None
) -> Verdict:
    """Compare the leak rate of a scene, with all counted errors, with the limit of the scene.

    With a limit the leak rate must have bounds; the entry "flow" of the budget gives them. The
    advice is for an undecided verdict; left out, it is that of `deciding_setting`.
    """
    shown = ShownUnit.of(scene)
    head, rest = headline(leak, budget, shown), outside_bounds(budget)
    names = [entry.name for entry in rest if entry.kind == "not covered"]
    open_points = f"; not covered: {', '.join(names)}" if names else ""
    if scene.limit is None:
        why = {"leaking": "; no limit was given", "sealed": ZERO}.get(leak.state, "")
        return Verdict(leak.state, f"{leak.state}: {head}{why}{open_points}")
    stated, limit = scene.limit.leak_rate, scene.limit.volume_rate(scene.drive)
    allowed = f"{shown.text(limit)} allowed"
    decision, comparison = _compared(leak.state, head, limit, allowed)
    needed = DecidingRtol()
    unsettling = {"sealed": may_open, "lifted off": may_close}.get(leak.state)
    doubts = [entry.sentence for entry in rest if unsettling is not None and unsettling(entry)]
    if leak.state == "lifted off" and doubts:
        decision = "undecided"
    if decision == "undecided" and doubts:
        comparison = "; ".join((*doubts, comparison if head.upper else allowed))
    elif decision == "undecided":
        if advice is None:
            others = (*(entry for entry in budget if entry.key == SLIP_INTERVAL), *rest)
            fixed = tuple(entry for entry in others if not entry.per_rtol)
            per_rtol = sum(entry.per_rtol for entry in others)
            needed = what_would_decide(leak, limit, combined(fixed), per_rtol)
            advice = deciding_setting(scene, leak, head, limit, needed, fixed)
        comparison = f"{comparison}; {advice}"
    both = [entry for entry in rest if entry.lower is not None and entry.upper is not None]
    counting = f", counting {entry_words(both)}" if both and leak.state == "leaking" else ""
    sentence = f"{decision}: {head}; {comparison}{counting}{open_points}"
    limit_text = f"{in_digits(stated.number, 6)} {stated.unit.name}"
    return Verdict(
        decision=decision,
        sentence=sentence,
        limit=limit_text,
        needed_rtol=needed.rtol,
        needed_unknowns=needed.unknowns,
        comparison=comparison,
    )


def _compared(
    state: FlowState, head: Headline, limit: float, allowed: str
) -> tuple[DecisionName, str]:
    """Decision, and how the ends of the headline compare with the limit [m³/s]."""
    low, high = head.lower, head.upper
    if state == "lifted off":
        return "above limit", allowed
    if high == 0:
        return "within limit", f"{allowed}{ZERO}"
    if high is not None and high <= limit:
        return "within limit", f"at most {rounded_up(100 * high / limit)} % of the {allowed}"
    if low is not None and low > limit:
        return "above limit", f"at least {rounded_down(low / limit)} times the {allowed}"
    share = ends_words(low, high, scale=100 / limit)
    return "undecided", f"{share} % of the {allowed}" if share else allowed
