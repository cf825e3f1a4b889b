"""The verdict: the leak rate compared with a limit, and what an undecided verdict would need."""

from dataclasses import dataclass
from math import expm1, log, sinh, sqrt

from fem_seal.digits import in_digits, rounded_down, rounded_up
from fem_seal.error_budget import (
    CONTACT_AREA,
    CONTACT_GRID,
    INPUTS,
    SLIP_INTERVAL,
    ErrorBudget,
    Uncertainty,
    beside_flow,
    combined,
    ends_words,
    entry_words,
    may_open,
)
from fem_seal.errors import present
from fem_seal.leak_rate import FlowState, LeakRate, relative_width
from fem_seal.quantities.headline import Headline, Shown, headline
from fem_seal.scene import Scene

ZERO = "; zero holds only for what is covered"
Needed = tuple[float | None, int | None]  # tolerance and unknowns that would decide
LEAST_RTOL = 1e-6  # smallest tolerance that is advised; the estimate is not more precise


@dataclass(frozen=True)
class Verdict:
    """A decision and its reasons.

    The decision is "sealed", "leaking" or "lifted off" where the scene has no limit; "within limit"
    if the highest leak rate that the error budget allows is <= limit; "above limit" if the lowest
    is > limit; else "undecided".
    """

    decision: str
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
    advice is for an undecided verdict; left out, it is what `_advice` says.
    """
    shown = Shown.of(scene)
    head, rest = headline(leak, budget, shown), beside_flow(budget)
    names = [entry.name for entry in rest if entry.kind == "not covered"]
    open_points = f"; not covered: {', '.join(names)}" if names else ""
    if scene.limit is None:
        why = {"leaking": "; no limit was given", "sealed": ZERO}.get(leak.state, "")
        return Verdict(leak.state, f"{leak.state}: {head}{why}{open_points}")
    stated, limit = scene.limit.leak_rate, scene.limit.volume_rate(scene.drive)
    allowed = f"{shown.text(limit)} allowed"
    decision, comparison = _compared(leak.state, head, limit, allowed)
    needed: Needed = (None, None)
    if decision == "undecided" and leak.state == "sealed":
        opening = _sentences([entry for entry in rest if may_open(entry)])
        comparison = f"{opening}; {allowed}"
    elif decision == "undecided":
        if advice is None:
            others = (*(entry for entry in budget if entry.key == SLIP_INTERVAL), *rest)
            fixed = tuple(entry for entry in others if not entry.per_rtol)
            per_rtol = sum(entry.per_rtol for entry in others)
            needed = what_would_decide(leak, limit, *combined(fixed), per_rtol)
            advice = _advice(scene, leak, head, needed, limit, fixed)
        comparison = f"{comparison}; {advice}"
    both = [entry for entry in rest if entry.lower is not None and entry.upper is not None]
    counting = f", counting {entry_words(both, 3)}" if both and leak.state == "leaking" else ""
    sentence = f"{decision}: {head}; {comparison}{counting}{open_points}"
    limit_text = f"{in_digits(stated.number, 6)} {stated.unit.name}"
    return Verdict(decision, sentence, limit_text, *needed, comparison)


def _compared(state: FlowState, head: Headline, limit: float, allowed: str) -> tuple[str, str]:
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
    per_cent = 100 / limit
    share = ends_words(low and per_cent * low, high and per_cent * high)
    return "undecided", f"{share} % of the {allowed}" if share else allowed


def what_would_decide(
    leak: LeakRate,
    limit: float,
    lower: float | None = 1.0,
    upper: float | None = 1.0,
    per_rtol: float = 0.0,
) -> Needed:
    """Tolerance and unknowns at which bounds exclude a limit L [m³/s]; None if unknown.

    With a leak rate of Q = √(lower upper) and the factors of the other uncertainties, a bracket of
    the flow with ln(upper / lower) = 2 w just touches the limit where Q e^w (upper factor) = L or
    Q e^-w (lower factor) = L; (upper - lower) / √(lower upper) is 2 sinh w then. Uncertainties that
    are at most `per_rtol` times this width, and proportional to it, make w (1 + 2 per_rtol) of w. A
    factor of None is unbounded.
    """
    low, high = leak.bounds
    if low == 0:
        return None, None
    distance = log(limit / sqrt(low * high))
    half_widths = [distance - log(upper)] if upper is not None else []
    if lower:
        half_widths.append(log(lower) - distance)
    needed = 2 * sinh(max(half_widths, default=0.0) / (1 + 2 * per_rtol))
    if needed < LEAST_RTOL:
        return None, None
    reached = relative_width(*leak.refined_bounds)
    # This is sufficient. A wider bracket may decide too, if all of it lies on one side.
    return needed, max(round(leak.unknowns * reached / needed), leak.unknowns)


def _advice(
    scene: Scene,
    leak: LeakRate,
    head: Headline,
    needed: Needed,
    limit: float,
    rest: ErrorBudget,
) -> str:
    """Advice for an undecided verdict: a setting that might decide it, or why none can.

    `needed` is what would decide by the flow alone, `rest` are the entries that flow.rtol does not
    narrow. A scene with a total error takes no flow.rtol, and one with limit.decide needs none
    until its flow has decided.
    """
    by_total, decides = scene.total_error is not None, scene.deciding_rate is not None
    (low, high), (rtol, unknowns) = leak.bounds, needed
    if low == 0:
        return (
            "there is no lower bound yet, allow more unknowns, time or memory (flow.max_unknowns, "
            "max_seconds, max_memory)"
        )
    counted = [entry for entry in rest if entry.counted]
    value = sqrt(low * high)
    others = [entry for entry in counted if entry.key not in (CONTACT_GRID, CONTACT_AREA)]
    if by_total or (CONTACT_GRID in {entry.key for entry in counted} and not others):
        # A total error chooses flow.rtol itself; it covers neither inputs nor slip.
        factor = combined(others)[value < limit]
        total = expm1(abs(log(limit / value)) - abs(log(factor))) if factor else 0.0
        if LEAST_RTOL < total < 1:
            instead = "limit.decide" if decides else "flow.rtol"
            instead = "" if by_total else f", in place of {instead},"
            return f"accuracy.total = {total:.2g}{instead} might decide"
    inputs = next((entry for entry in counted if entry.key == INPUTS), None)
    sides = [(e.lower, e.upper)[value < limit] for e in counted if e is not inputs]
    if inputs is not None and None not in sides:
        return _narrower(inputs, limit, head.upper if value < limit else head.lower)
    if rtol is not None and unknowns is not None and not by_total:
        about = f"about {in_digits(unknowns, 2)} unknowns"
        if decides and not leak.converged:
            return f"{about} might decide (flow.max_unknowns, max_seconds, max_memory)"
        # A flow that has decided may have bounds too wide for the entries beside it.
        instead = " in place of limit.decide" if decides else ""
        return f"flow.rtol = {rtol:.2g}{instead} might decide, with {about}"
    if open_entries(rest):
        return _sentences(open_entries(rest))
    if counted:
        names = " and ".join(entry.name for entry in counted)
        return f"no flow.rtol decides it while {names} may change the leak rate so much"
    return "the best estimate is the limit itself"


def _narrower(inputs: Uncertainty, limit: float, end: float | None) -> str:
    """Advice on the input that matters most: how well it must be known to decide.

    `end` is that of the headline which is beyond the limit [m³/s]. The logarithms of the entry's
    factors are taken as proportional to the tolerances.
    """
    name, part, share = present(inputs.largest, "input that matters most")
    if end:
        side = inputs.upper if end > limit else inputs.lower
        own, excess = share * abs(log(side or 1.0)), abs(log(end / limit))
        if 0 < excess < own:
            needed = rounded_down(100 * part * (1 - excess / own), 2)
            return f"{name} to ±{needed} % in place of ±{in_digits(100 * part, 2)} % might decide"
    return f"no smaller tolerance of {name} alone decides, the input that matters most"


def open_entries(rest: ErrorBudget) -> list[Uncertainty]:
    """List the entries that leave a side unbounded."""
    return [entry for entry in rest if entry.counted and None in (entry.lower, entry.upper)]


def _sentences(entries: list[Uncertainty]) -> str:
    return "; ".join(entry.sentence for entry in entries)
