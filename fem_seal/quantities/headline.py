"""The headline: the one number of a scene, its leak rate with all counted errors, in one sentence.

The factors of all counted entries of the error budget multiply. The bounds of the flow alone are
named behind them: guaranteed of a patch, estimated of a seal.
"""

from dataclasses import dataclass
from math import inf, isinf

from fem_seal.digits import bracket_digits, in_digits, per_cent, rounded_up
from fem_seal.error_budget import (
    FLOW,
    IN_BOUNDS,
    NOT_THE_SEAL,
    ONE_PATCH,
    USELESS_FACTOR,
    ErrorBudget,
    combined,
    ends_words,
    may_open,
    outside_bounds,
)
from fem_seal.fluid import GasDrive
from fem_seal.leak_rate import LeakRate, relative_half_width, require_enclosed
from fem_seal.scene import Scene

NO_PATH = "no open path joins inlet and outlet"
COUNTED = "with all counted errors"


@dataclass(frozen=True)
class ShownUnit:
    """Unit of leak rates in texts."""

    name: str = "m^3/s"
    per_solved: float = 1.0  #: number of this unit in 1 m³/s of the solved leak rate
    conditions: str = ""  #: of a volume of gas, "at 0 degC, 1.013 bar"

    @property
    def unit(self) -> str:
        """The unit with the conditions."""
        return f"{self.name} {self.conditions}".strip()

    @classmethod
    def of(cls, scene: Scene) -> "ShownUnit":
        """Unit of the output of a scene, else of its limit, else m³/s."""
        unit = scene.output.leak_rate_unit or (scene.limit and scene.limit.leak_rate.unit)
        volume = not unit or unit.kind == "volume"
        conditions = scene.drive.conditions if volume and isinstance(scene.drive, GasDrive) else ""
        if not unit:
            return cls(conditions=conditions)
        return cls(unit.name, scene.drive.rates[unit.kind] / unit.size, conditions)

    def text(self, solved: float) -> str:
        """A solved leak rate [m³/s] in the unit."""
        return f"{in_digits(solved * self.per_solved)} {self.name}"


SI = ShownUnit()


@dataclass(frozen=True)
class Headline:
    """The leak rate with all counted errors; `str(headline)` is the sentence."""

    value: float | None  #: None if lifted off, where nothing limits the leak rate
    lower: float | None  #: None where an error leaves this side open
    upper: float | None  #: the same
    sentence: str  #: the same in the unit that the scene asks for, and the bounds of the flow alone
    unit: str = "m^3/s"  #: of the three numbers

    def __post_init__(self) -> None:
        require_enclosed(self.lower, self.upper)

    def __str__(self) -> str:
        return self.sentence


def headline(leak: LeakRate, budget: ErrorBudget, shown: ShownUnit = SI) -> Headline:
    """Headline of a leak rate [m³/s] of a patch or a seal, in m³/s without another unit `shown`.

    The entry "flow" of the budget gives the bounds of the leak rate.
    """
    if leak.state == "lifted off":
        return Headline(None, None, None, "unlimited, the fluid presses harder than the load")
    if leak.state == "sealed":
        return _sealed(budget, shown)
    if leak.lower is None:
        words = f"{in_digits(leak.value * shown.per_solved)} {shown.unit}, without bounds"
        return Headline(leak.value, None, None, words)
    (lower, upper), others = leak.bounds, combined(outside_bounds(budget))
    low = others.lower * lower or None
    high = None if others.upper == inf else others.upper * upper
    words = (
        f"{_all_errors(leak.value, low, high, budget, shown)}; {_flow_alone(leak, budget, shown)}"
    )
    return Headline(leak.value, low, high, words)


def _sealed(budget: ErrorBudget, shown: ShownUnit) -> Headline:
    """Headline of a sealed film, whose upper end is what an entry says that it may leak."""
    opening = [entry for entry in budget if may_open(entry)]
    no_path = NO_PATH
    if any(entry.key == ONE_PATCH for entry in budget):
        no_path += f" of this patch ({NOT_THE_SEAL})"
    if not opening:
        return Headline(0.0, 0.0, 0.0, f"0 {shown.unit} as computed; {no_path}")
    rate = opening[0].upper_rate if len(opening) == 1 else None
    factor = combined(entry for entry in budget if entry not in opening).upper
    if rate is None or isinf(rate * factor):
        names = " and ".join(entry.name for entry in opening)
        words = f"0 {shown.unit} as computed; no upper bound is known ({names}); {no_path}"
        return Headline(0.0, 0.0, None, words)
    high = rounded_up(rate * factor * shown.per_solved)
    words = f"0 to {high} {shown.unit} {COUNTED}; as computed, {no_path}"
    return Headline(0.0, 0.0, rate * factor, words)


def _all_errors(
    value: float, low: float | None, high: float | None, budget: ErrorBudget, shown: ShownUnit
) -> str:
    """The value and its range with all counted errors, or the range alone; "at least" if open.

    With both sides open it names the entries that open them.
    """
    scale = shown.per_solved
    if high is not None and high > USELESS_FACTOR * value:
        high = None
    if low is not None and low * USELESS_FACTOR < value:
        low = None
    number = f"{in_digits(value * scale)} {shown.unit}, "
    if low is not None and high is not None:
        text, least, most = bracket_digits(value * scale, low * scale, high * scale)
        number, ends = f"{text} {shown.unit}, ", f"{least} to {most}"
    elif low is not None or high is not None:
        ends = ends_words(low, high, scale=scale)
    else:
        wide = [e.name for e in budget if e.counted and None in (e.lower, e.upper)]
        names = " and ".join(wide) or "the counted errors together"
        text = f"{in_digits(value * scale)} {shown.unit}"
        return f"{text} as computed, but {names} may change it by any factor"
    if any(entry.is_range for entry in budget):
        return f"{ends} {shown.unit} {COUNTED}"
    return f"{number}{ends} {COUNTED}"


def _flow_alone(leak: LeakRate, budget: ErrorBudget, shown: ShownUnit) -> str:
    """The part that the bounds of the flow cover, by its name in the budget."""
    flows = (entry for entry in budget if entry.key in IN_BOUNDS)
    name, kind = next(((entry.name, entry.kind) for entry in flows), (FLOW, "guaranteed"))
    lower, upper = (shown.per_solved * end for end in leak.bounds)
    width = f"±{per_cent(relative_half_width(lower, upper))}"
    if lower == 0 or any(entry.is_range for entry in budget):
        width = ends_words(lower or None, upper)
    return f"{name} alone {width}, {kind}"
