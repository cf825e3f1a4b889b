"""What might decide a verdict that the bounds and the error budget leave open."""

from collections.abc import Mapping
from math import expm1, log, sinh
from typing import NamedTuple

from fem_seal.digits import in_digits, rounded_down
from fem_seal.error_budget import (
    CONTACT_AREA,
    CONTACT_GRID,
    INPUTS,
    ErrorBudget,
    Uncertainty,
    combined,
)
from fem_seal.errors import present
from fem_seal.leak_rate import Factors, LeakRate, middle_of, relative_width
from fem_seal.quantities.headline import Headline
from fem_seal.scene import Scene


class DecidingRtol(NamedTuple):
    """Tolerance of the flow that would decide; None where it is not known."""

    rtol: float | None = None
    unknowns: int | None = None  #: that it takes


LEAST_RTOL = 1e-6  # smallest tolerance that is advised; the estimate is not more precise


def what_would_decide(
    leak: LeakRate, limit: float, others: Factors, per_rtol: float = 0.0
) -> DecidingRtol:
    """Tolerance and unknowns at which bounds exclude a limit L [m³/s]; None if unknown.

    With a leak rate of Q = √(lower upper) and the factors of the other uncertainties, a bracket of
    the flow with ln(upper / lower) = 2 w just touches the limit where Q e^w (upper factor) = L or
    Q e^-w (lower factor) = L; (upper - lower) / √(lower upper) is 2 sinh w then. Uncertainties that
    are at most `per_rtol` times this width, and proportional to it, make w (1 + 2 per_rtol) of w.
    """
    low, high = leak.bounds
    if low == 0:
        return DecidingRtol()
    distance = log(limit / middle_of(low, high))
    half_width = distance - log(others.upper)
    if others.lower:
        half_width = max(half_width, log(others.lower) - distance)
    needed = 2 * sinh(half_width / (1 + 2 * per_rtol))
    if needed < LEAST_RTOL:
        return DecidingRtol()
    reached = relative_width(*leak.refined_bounds)
    # This is sufficient. A wider bracket may decide too, if all of it lies on one side.
    return DecidingRtol(needed, max(round(leak.unknowns * reached / needed), leak.unknowns))


def deciding_setting(
    scene: Scene,
    leak: LeakRate,
    head: Headline,
    limit: float,
    needed: DecidingRtol,
    fixed: ErrorBudget,
) -> str:
    """A setting that might decide whether a leak rate keeps a limit [m³/s], or why none can.

    `needed` would decide by the flow alone; `fixed` are the entries that flow.rtol does not narrow.
    """
    if leak.bounds[0] == 0:
        return (
            "there is no lower bound yet, allow more unknowns, time or memory (flow.max_unknowns, "
            "max_seconds, max_memory)"
        )
    counted = [entry for entry in fixed if entry.counted]
    # How far the limit is from the leak rate that is taken for the true one.
    away = log(limit / middle_of(*leak.bounds))
    remedies = {CONTACT_GRID: finer_grid(scene)}
    inputs = next((entry for entry in counted if entry.key == INPUTS), None)
    if inputs is not None:
        remedies[INPUTS] = _by_inputs(head, limit, away > 0, inputs)
    return (
        _by_total_error(scene, away, counted)
        or _by_flow(scene, leak, needed)
        or of_widest(fixed, remedies)
        or "the best estimate is the limit itself"
    )


def of_widest(budget: ErrorBudget, remedies: Mapping[str, str]) -> str:
    """What narrows the widest entry of a budget, of remedies by key; empty if none has a width.

    No setting helps while an entry is unbounded on a side: its sentence is the advice then.
    """
    counted = [entry for entry in budget if entry.counted and entry.log_error > 0]
    if unbounded := [entry for entry in counted if None in (entry.lower, entry.upper)]:
        return "; ".join(entry.sentence for entry in unbounded)
    if not counted:
        return ""
    widest = max(counted, key=lambda entry: entry.log_error)
    return remedies.get(widest.key, f"no setting narrows {widest.name}, the widest of them")


def _by_total_error(scene: Scene, away: float, counted: list[Uncertainty]) -> str:
    """A total error chooses grid and flow.rtol itself; it covers neither inputs nor slip."""
    is_set = scene.total_error is not None
    others = [entry for entry in counted if entry.key not in (CONTACT_GRID, CONTACT_AREA)]
    by_grid = not others and CONTACT_GRID in {entry.key for entry in counted}
    factors = combined(others)
    factor = factors.upper if away > 0 else factors.lower
    if not ((is_set or by_grid) and factor):
        return ""
    total = expm1(abs(away) - abs(log(factor)))
    if not LEAST_RTOL < total < 1:
        return ""
    # A scene with limit.decide needs no flow.rtol until its flow has decided.
    other = "flow.rtol" if scene.deciding_rate is None else "limit.decide"
    instead = "" if is_set else f", in place of {other},"
    return f"accuracy.total = {total:.2g}{instead} might decide"


def _by_inputs(head: Headline, limit: float, below: bool, inputs: Uncertainty) -> str:
    """The input that matters most, and how well it must be known.

    The logarithms of the entry's factors are taken as proportional to the tolerances.
    """
    largest = present(inputs.largest, "input that matters most")
    # The end of the headline that is beyond the limit, and the factor that moves it there.
    end = head.upper if below else head.lower
    if end:
        side = inputs.upper if end > limit else inputs.lower
        own, excess = largest.share * abs(log(side or 1.0)), abs(log(end / limit))
        if 0 < excess < own:
            now = 100 * largest.part
            needed, shown = rounded_down(now * (1 - excess / own), 2), in_digits(now, 2)
            return f"{largest.name} to ±{needed} % in place of ±{shown} % might decide"
    return f"no smaller tolerance of {largest.name} alone decides, the input that matters most"


def _by_flow(scene: Scene, leak: LeakRate, needed: DecidingRtol) -> str:
    """A smaller flow.rtol, which a scene with a total error does not take."""
    rtol, unknowns = needed
    if rtol is None or unknowns is None or scene.total_error is not None:
        return ""
    about, decides = f"about {in_digits(unknowns, 2)} unknowns", scene.deciding_rate is not None
    if decides and not leak.converged:
        return f"{about} might decide (flow.max_unknowns, max_seconds, max_memory)"
    # A flow that has decided may have bounds too wide for the entries outside them.
    instead = " in place of limit.decide" if decides else ""
    return f"flow.rtol = {rtol:.2g}{instead} might decide, with {about}"


def finer_grid(scene: Scene) -> str:
    """Advice to narrow the entry of the contact's grid."""
    setting = "surface.shape" if scene.measured_map is None else "a map in smaller steps"
    return f"a finer grid of the contact ({setting}) might decide"
