"""The verdict: the leak rate compared with a limit, and what an undecided verdict would need."""

from dataclasses import dataclass
from math import expm1, log, sinh, sqrt

from fem_seal.digits import bracket_digits, in_digits, rounded_down, rounded_up
from fem_seal.leak_rate import LeakRate, relative_width
from fem_seal.quantities.error_budget import (
    CONTACT_GRID,
    NOT_THE_SEAL,
    ONE_PATCH,
    SLIP_INTERVAL,
    ErrorBudget,
    Uncertainty,
    beside_flow,
    combined,
    factor_words,
    may_open,
)
from fem_seal.units import Rate

ZERO = "; zero holds only for what is covered"
LEAST_RTOL = 1e-6  # smallest tolerance that is advised; the estimate is not more precise


@dataclass(frozen=True)
class Verdict:
    """A decision and its reasons.

    Attributes
    ----------
    decision : str
        "sealed", "leaking" or "lifted off" where the scene has no limit; "within limit" if the
        highest leak rate that the error budget allows is <= limit; "above limit" if the lowest is
        > limit; else "undecided".
    sentence : str
        The decision in words, with the uncertainties that were counted and those that are not
        covered.
    headline : str
        The sentence without its uncertainties: the decision, what was compared with the limit, and
        what would decide. Empty in results of older versions.
    limit : str or None
        Limit of the leak rate as the scene states it; None without one.
    needed_rtol : float or None
        Estimate of the tolerance that would decide an undecided verdict, else None. It takes
        √(lower upper) for the true leak rate.
    needed_unknowns : int or None
        Estimate of the unknowns that reach this tolerance, if the width of the bracket falls as
        one over the unknowns; else None.
    """

    decision: str
    sentence: str
    limit: str | None = None
    needed_rtol: float | None = None
    needed_unknowns: int | None = None
    headline: str = ""

    @classmethod
    def of(cls, decision: str, headline: str, rest: str, limit: str | None = None) -> "Verdict":
        """Verdict with the sentence that begins with a headline."""
        return cls(decision, headline + rest, limit, headline=headline)


@dataclass(frozen=True)
class Shown:
    """Unit of leak rates in texts.

    Parameters
    ----------
    name : str
        Name of the unit.
    per_solved : float
        Number of this unit in 1 m³/s of the solved leak rate.
    conditions : str
        Conditions at which the volume of a gas is stated, "at 0 degC, 1.013 bar"; else empty.
    """

    name: str
    per_solved: float
    conditions: str = ""

    @property
    def unit(self) -> str:
        """The unit with the conditions."""
        return f"{self.name} {self.conditions}".strip()

    def text(self, solved: float) -> str:
        """A solved leak rate [m³/s] in the unit."""
        return f"{in_digits(solved * self.per_solved)} {self.name}"

    def at_least(self, solved: float) -> str:
        """A lower bound in the unit, rounded down."""
        return f"{rounded_down(solved * self.per_solved)} {self.unit}"

    def at_most(self, solved: float) -> str:
        """An upper bound in the unit, rounded up."""
        return f"{rounded_up(solved * self.per_solved)} {self.unit}"

    def between(self, leak: LeakRate) -> str:
        """Text of the bounds, or of the estimate where there are none."""
        if leak.lower is None:
            return f"about {in_digits(leak.value * self.per_solved)} {self.unit}, without bounds"
        bracket = (self.per_solved * rate for rate in (leak.value, *leak.bounds))
        _, low, high = bracket_digits(*bracket)
        return f"between {low} and {high} {self.unit}"


def verdict(
    leak: LeakRate,
    shown: Shown,
    limit: Rate | None,
    limit_solved: float | None,
    budget: ErrorBudget = (),
    advice: str | None = None,
) -> Verdict:
    """Compare the bounds of a leak rate, widened by the error budget, with a limit.

    Parameters
    ----------
    leak : leak rate; it must have bounds if there is a limit
    shown : the unit for the sentence
    limit : the limit in the unit of the scene, or None
    limit_solved : the limit of the solved leak rate [m³/s]
    budget : uncertainties of the leak rate; its entry "flow" belongs to `leak`
    advice : advice for an undecided verdict; if left out, a tolerance of the flow
    """
    limit_text = None if limit is None else f"{in_digits(limit.number, 6)} {limit.unit.name}"
    rest = beside_flow(budget)
    open_points = _not_covered(rest)
    if leak.state == "lifted off":
        off = "lifted off: the fluid carries the whole load, and nothing limits the leak rate"
        if limit is None:
            return Verdict.of("lifted off", off, "")
        return Verdict.of(
            "above limit", f"above limit: {off}; {limit_text} allowed", "", limit_text
        )
    if leak.state == "sealed":
        return _of_sealed(shown, limit_text, limit_solved, rest)
    if limit_solved is None:
        headline = f"leaking {shown.between(leak)}"
        return Verdict.of("leaking", headline, f"; no limit was given{open_points}")
    allowed = f"{shown.text(limit_solved)} allowed"
    counting = _counting(rest)
    low, high = _range(leak, rest)
    if high is not None and high <= limit_solved:
        share = rounded_up(100 * high / limit_solved)
        most = f"at most {shown.at_most(high)}, {share} %"
        headline = f"within limit: {most} of the {allowed}"
        return Verdict.of("within limit", headline, counting + open_points, limit_text)
    if low is not None and low > limit_solved:
        times = rounded_down(low / limit_solved)
        least = f"at least {shown.at_least(low)}, {times} times"
        headline = f"above limit: {least} the {allowed}"
        return Verdict.of("above limit", headline, counting + open_points, limit_text)
    rtol, unknowns = None, None
    if advice is None:
        others = (*(entry for entry in budget if entry.name == SLIP_INTERVAL), *rest)
        fixed = tuple(entry for entry in others if not entry.per_rtol)
        per_rtol = sum(entry.per_rtol for entry in others)
        rtol, unknowns = what_would_decide(leak, limit_solved, *combined(fixed), per_rtol)
        advice = _advice(leak, rtol, unknowns, limit_solved, fixed)
    if low or high is not None:
        held = f"{_ends(low or None, high, shown, limit_solved)} the {allowed}"
    else:
        held = f"{shown.between(leak)} as computed, and anything with all errors; {allowed}"
    headline = f"undecided: {held}; {advice}"
    sentence = f"undecided: {held}{counting}; {advice}{open_points}"
    return Verdict("undecided", sentence, limit_text, rtol, unknowns, headline)


def _ends(low: float | None, high: float | None, shown: Shown, limit: float) -> str:
    """Text of the range of the leak rate, in its unit and in per cent of the limit."""
    least = "" if low is None else shown.at_least(low)
    most = "" if high is None else shown.at_most(high)
    percents = [
        f"{rounded(100 * rate / limit)} %"
        for rate, rounded in ((low, rounded_down), (high, rounded_up))
        if rate is not None
    ]
    if least and most:
        ends = f"between {least.removesuffix(shown.unit).strip()} and {most}"
    else:
        ends = f"at least {least}, no upper end" if least else f"at most {most}"
    return f"{ends}, {' to '.join(percents)} of"


def what_would_decide(
    leak: LeakRate,
    limit: float,
    lower: float | None = 1.0,
    upper: float | None = 1.0,
    per_rtol: float = 0.0,
) -> tuple[float | None, int | None]:
    """Tolerance and unknowns at which the bounds would exclude the limit; None if unknown.

    With a leak rate of Q = √(lower upper) and the factors of the other uncertainties, a bracket of
    the flow with ln(upper / lower) = 2 w just touches the limit L where Q e^w (upper factor) = L or
    Q e^-w (lower factor) = L; (upper - lower) / √(lower upper) is 2 sinh w then. Uncertainties that
    are at most `per_rtol` times this width make w (1 + 2 per_rtol) of w.

    Parameters
    ----------
    leak : LeakRate
        Leak rate with bounds.
    limit : float
        Limit L [m³/s].
    lower, upper : float or None
        Factors of the uncertainties beside the flow; None on an unbounded side.
    per_rtol : float
        Errors of ln Q that are proportional to the tolerance of the flow, over this tolerance.
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


def _range(leak: LeakRate, rest: ErrorBudget) -> tuple[float | None, float | None]:
    """Lowest and highest leak rate [m³/s] by all counted entries; None where unbounded."""
    (low, high), (lower, upper) = leak.bounds, combined(rest)
    return None if lower is None else low * lower, None if upper is None else high * upper


def _of_sealed(
    shown: Shown, limit_text: str | None, limit: float | None, rest: ErrorBudget
) -> Verdict:
    """Verdict on a sealed gap; an entry of the budget may still open a path."""
    opened = [entry for entry in rest if may_open(entry)]
    no_path = "no open path joins inlet and outlet"
    if any(entry.name == ONE_PATCH for entry in rest):
        no_path += f" of this patch ({NOT_THE_SEAL})"
    if limit is None:
        headline = f"sealed as computed: {no_path}"
        return Verdict.of("sealed", headline, ZERO + _not_covered(rest))
    allowed = f"{shown.text(limit)} allowed"
    if not opened:
        held = f"{in_digits(limit * shown.per_solved)} {shown.unit} allowed"
        headline = f"within limit: sealed as computed, {held}: {no_path}"
        return Verdict.of("within limit", headline, ZERO + _not_covered(rest), limit_text)
    rate = opened[0].upper_rate if len(opened) == 1 else None
    _, upper = combined(entry for entry in rest if entry not in opened)
    if rate is not None and upper is not None and rate * upper <= limit:
        most = f"sealed as computed, and at most {shown.at_most(rate * upper)}"
        headline = f"within limit: {most} with {_names(opened)}, {allowed}"
        return Verdict.of("within limit", headline, _not_covered(rest), limit_text)
    headline = f"undecided: {no_path} as computed, but {_sentences(opened)}; {allowed}"
    return Verdict.of("undecided", headline, _not_covered(rest), limit_text)


def _advice(
    leak: LeakRate,
    rtol: float | None,
    unknowns: int | None,
    limit: float,
    rest: ErrorBudget,
) -> str:
    """Advice for an undecided verdict: a setting that might decide it, or why none can.

    `rest` are the entries that flow.rtol does not narrow.
    """
    low, high = leak.bounds
    if low == 0:
        return (
            "there is no lower bound yet, allow more unknowns, time or memory (flow.max_unknowns, "
            "max_seconds, max_memory)"
        )
    counted = [entry for entry in rest if entry.counted]
    if [entry.name for entry in counted] == [CONTACT_GRID]:
        # A total error chooses flow.rtol itself.
        total = expm1(abs(log(limit / sqrt(low * high))))
        if total > LEAST_RTOL:
            return f"accuracy.total = {total:.2g} might decide"
    if rtol is not None and unknowns is not None:
        return f"flow.rtol = {rtol:.2g} might decide, with about {in_digits(unknowns, 2)} unknowns"
    if open_entries(rest):
        return _sentences(open_entries(rest))
    if counted:
        return f"no flow.rtol decides it while {_names(counted)} may change the leak rate so much"
    return "the best estimate is the limit itself"


def open_entries(rest: ErrorBudget) -> list[Uncertainty]:
    """List the entries that leave a side unbounded.

    Parameters
    ----------
    rest : entries beside the flow
    """
    return [entry for entry in rest if entry.counted and None in (entry.lower, entry.upper)]


def _counting(rest: ErrorBudget) -> str:
    """Names and factors of the entries that the verdict counts beside the bounds of the flow."""
    both = [entry for entry in rest if entry.lower is not None and entry.upper is not None]
    if not both:
        return ""
    words = (
        f"{entry.name} ({entry.kind}, {factor_words(entry.lower, entry.upper, 3)} times)"
        for entry in both
    )
    return f", counting {' and '.join(words)}"


def _not_covered(rest: ErrorBudget) -> str:
    names = [entry.name for entry in rest if entry.kind == "not covered"]
    return f"; not covered: {', '.join(names)}" if names else ""


def _names(entries: list[Uncertainty]) -> str:
    return " and ".join(entry.name for entry in entries)


def _sentences(entries: list[Uncertainty]) -> str:
    return "; ".join(entry.sentence for entry in entries)
