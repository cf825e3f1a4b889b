"""The error budget: one list of all reasons that make a leak rate uncertain.

result.json, the verdict, the printed words and the report all show this list, which
`uncertainties.error_budget` makes.
"""

from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass
from math import inf, log, prod, sqrt
from typing import Literal, NamedTuple

from fem_seal.digits import rounded_down, rounded_up
from fem_seal.errors import Inconsistent
from fem_seal.leak_rate import Factors, LeakRate

MOST_LOG = 700.0  # exp(709) is the largest double
# Keys of entries that other modules look for.
FLOW, CONTACT_GRID, SLIP_INTERVAL = "flow", "contact_grid", "slip_interval"
CONTACT_AREA = "contact_area"
FLOW_AND_LOADS = "flow_and_load_table"
ONE_PATCH = "one_patch"
LIFT, INPUTS = "lift", "inputs"
# Caution in the texts about a patch that is sealed.
NOT_THE_SEAL = "others of the seal may leak: [seal] judges the seal"
# A factor above this one, or below its inverse, counts as unbounded in texts.
USELESS_FACTOR = 1e6
# Factors as near to 1 as SMALL_ERROR are written as 1 ± their distance, as near as NO_ERROR as 1.
SMALL_ERROR, NO_ERROR = 1e-3, 1e-12
# Entries that the bounds of a leak rate contain.
IN_BOUNDS = (FLOW, SLIP_INTERVAL, FLOW_AND_LOADS)

Kind = Literal["guaranteed", "estimated", "not covered"]


class LargestInput(NamedTuple):
    """The input of [tolerances] that matters most."""

    name: str
    part: float  #: its ± as a part of its value
    share: float  #: in the logarithms of the factors


@dataclass(frozen=True)
class Uncertainty:
    """One reason why the true leak rate may differ from the computed one.

    For this reason the true leak rate lies between `lower` times and `upper` times the computed
    one. Both None: the entry is named but not counted. One None: the leak rate is unbounded on that
    side, and no verdict may rely on it. "guaranteed": a theorem gives the factors. "not covered":
    nothing is known, or nothing on a side whose factor is None.
    """

    key: str  #: what other modules look for, such as "contact_grid"
    kind: Kind
    sentence: str  #: meaning of the entry in plain words
    lower: float | None = None
    upper: float | None = None
    _: KW_ONLY
    caution: bool = False  #: whether the user is warned of it
    #: Upper bound of the leak rate under this reason [m³/s], where it was computed. A sealed
    #: contact needs it, since no factor can raise its leak rate of 0.
    upper_rate: float | None = None
    #: The logarithms of the factors are at most this many times `flow.rtol`, so that a smaller one
    #: narrows the entry; 0 if it does not.
    per_rtol: float = 0.0
    #: Whether the leak rate may be anywhere between the factors, and its value is no best guess.
    is_range: bool = False
    #: Of the entry "inputs".
    largest: LargestInput | None = None
    name: str = ""  #: the key in words

    def __post_init__(self) -> None:
        try:
            without = self.factors == Factors(0.0, inf)
        except Inconsistent as error:  # Factors refuses an impossible pair, without the key
            raise Inconsistent(f"{self.key}: {error}") from None
        if without and self.kind == "guaranteed":
            raise Inconsistent(f"{self.key} is guaranteed without factors")
        if not self.name:
            object.__setattr__(self, "name", self.key.replace("_", " "))

    def __str__(self) -> str:
        return f"{self.name} ({self.kind}): {self.sentence}"

    @property
    def counted(self) -> bool:
        """Whether a verdict counts the entry."""
        return self.lower is not None or self.upper is not None

    @property
    def factors(self) -> Factors:
        """Both factors; a side without one is open."""
        return Factors(self.lower or 0.0, inf if self.upper is None else self.upper)

    @property
    def log_error(self) -> float:
        """Largest |ln| of true over computed leak rate; infinite if a side is open."""
        if not self.lower or self.upper is None:
            return inf
        return max(abs(log(self.lower)), log(self.upper))


def estimate(
    key: str,
    sentence: str,
    lower: float | None = None,
    upper: float | None = None,
    upper_rate: float | None = None,
) -> Uncertainty:
    """Entry of an estimate; not covered if nothing is known, a caution if no upper factor is."""
    if not (lower is None or 0 <= lower <= 1) or not (upper is None or upper >= 1):
        raise Inconsistent(f"factors of an estimated error: {lower} and {upper}")
    known = lower is not None or upper is not None
    kind: Kind = "estimated" if known else "not covered"
    caution = known and upper is None
    return Uncertainty(key, kind, sentence, lower, upper, caution=caution, upper_rate=upper_rate)


def may_open(entry: Uncertainty) -> bool:
    """Whether an entry may let a sealed contact leak."""
    return entry.counted and entry.upper is None


def may_close(entry: Uncertainty) -> bool:
    """Whether an entry may put a solid that is lifted off back into a finite leak rate."""
    return entry.counted and entry.lower == 0


ErrorBudget = tuple[Uncertainty, ...]


def combined(budget: Iterable[Uncertainty]) -> Factors:
    """Multiply the factors of all counted entries.

    The errors multiply: true over computed leak rate is the product of one ratio for each entry.
    If each ratio keeps its own bounds, the product keeps the product of the bounds, whether or not
    the errors have a common cause. (A root of summed squares would be narrower, but requires
    independent errors.)
    """
    return prod((entry.factors for entry in budget if entry.counted), start=Factors())


def ends_words(low: float | None, high: float | None, scale: float = 1.0) -> str:
    """Text of a range, scaled and rounded outwards; None is an open end, two give no text."""
    least = "" if low is None else rounded_down(low * scale)
    most = "" if high is None else rounded_up(high * scale)
    if least and most:
        return f"{least} to {most}"
    if least:
        return f"at least {least}"
    return f"at most {most}" if most else ""


def factor_words(factors: Factors) -> str:
    """Text of two factors, rounded outwards; `USELESS_FACTOR` ones are unbounded.

    Of factors that differ from 1 by less than four digits show well, the difference: "1 ± 0.00013".
    """
    lower, upper = factors.lower, factors.upper
    error = max(1 - lower, upper - 1)
    if error < SMALL_ERROR:
        return f"1 ± {rounded_up(error, 2)}" if error > NO_ERROR else "1"
    low = None if lower < 1 / USELESS_FACTOR else lower
    high = None if upper > USELESS_FACTOR else upper
    return ends_words(low, high) or "any factor"


def entry_words(entries: Iterable[Uncertainty]) -> str:
    """Names, factors and kinds of entries, "contact grid 0.8 to 1.25 (estimated)"."""
    return ", ".join(f"{e.name} {factor_words(e.factors)} ({e.kind})" for e in entries)


def outside_bounds(budget: Iterable[Uncertainty]) -> ErrorBudget:
    """List the entries that the bounds of the leak rate do not contain."""
    return tuple(entry for entry in budget if entry.key not in IN_BOUNDS)


def parts_of_bounds(leak: LeakRate) -> tuple[Factors, Factors]:
    """Factors whose product is the bounds over the value.

    The first are the part that refinement narrows, the second the slip interval. The value is the
    geometric middle of each.
    """
    if leak.slip_interval is None or not leak.lower:
        lower, upper = leak.bounds
        return Factors(lower / leak.value, upper / leak.value), Factors()
    lower, upper = leak.refined_bounds
    slip = leak.slip_interval
    refined, interval = sqrt(upper / lower), sqrt(slip.upper / slip.lower)
    return Factors(1 / refined, refined), Factors(1 / interval, interval)


def flow_entry(leak: LeakRate) -> Uncertainty:
    """Entry of the bounds of the flow through the gap as it is represented."""
    if leak.state != "leaking":
        sentence = "nothing limits the flow of a seal that is lifted off"
        if leak.state == "sealed":
            sentence = "no open path joins inlet and outlet of the gap as it is represented"
        return Uncertainty(FLOW, "guaranteed", sentence, 1.0, 1.0)
    if leak.lower is None:
        sentence = "finite differences give no bounds; finite elements do"
        return Uncertainty(FLOW, "not covered", sentence)
    sentence = "bounds of the flow through the gap as it is represented"
    refined, _ = parts_of_bounds(leak)
    return Uncertainty(FLOW, "guaranteed", sentence, refined.lower, refined.upper)
