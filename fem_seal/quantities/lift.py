"""Error budget: the effect of the fluid's pressure on the solid.

The fluid carries part of the load and opens the film. For an elastic half-space under the total
load P per area and any fluid pressure between p_out and p_in above ambient, the leak rate lies
between those of the dry contacts under P - p_out and P - p_in: a comparison principle orders the
gaps, and the flow grows with the gap. On a grid, and for a layer of finite thickness, some entries
of the stiffness have the wrong sign for the proof. So the factors are called estimates here.
"""

from collections.abc import Callable
from dataclasses import replace
from math import exp, inf, isfinite, isinf

from fem_seal.coupling import SETTLED
from fem_seal.digits import rounded_down, rounded_up, with_prefix
from fem_seal.error_budget import LIFT, Kind, Uncertainty
from fem_seal.errors import NotConverged, present
from fem_seal.grid_series import error_beyond
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Patch, once
from fem_seal.quantities.headline import ShownUnit

# Key of the entry if flow.lift is "none"; else it is `LIFT`.
NEGLECTED = "fluid_pressure"
# The fluid's pressure is neglected below this part of the load.
NEGLIGIBLE_PRESSURE = 1e-3
NOT_LIMITED = "a finer grid of the contact, or slip of the gas, may let any amount through"
REMEDY = "flow.lift = 'resolved' solves contact and flow together"


def lift_entry(patch: Patch) -> Uncertainty | None:
    """Entry of the error budget for the effect of the fluid's pressure on the solid.

    None without an elastic contact, or if the pressure is negligible. The entry depends on
    `flow.lift`:

    * "resolved": how far contact and flow have settled;
    * "range": the leak rates at both ends of the range;
    * "none": how large the pressure is against the load. With a limit that the dry contact keeps,
      the contact under the load that the fluid leaves to the solid is solved as well, with its
      flow: it may exceed the limit. An outlet below ambient presses the solids together; then the
      same is done for a limit that the dry contact exceeds.
    """
    contact = patch.scene.contact
    if contact is None or not contact.is_elastic:
        return None
    return LIFTS[patch.scene.lift](patch)


def _neglected(patch: Patch) -> Uncertainty | None:
    """Entry of a fluid pressure that is left out."""
    contact = present(patch.scene.contact, "[contact]")
    inlet, outlet = patch.scene.flow.gauge_pressures
    load = patch.elastic_state.mean_pressure if contact.pressure is None else contact.pressure
    lifts, presses = (pressure > NEGLIGIBLE_PRESSURE * load for pressure in (inlet, -outlet))
    if not lifts and not presses:
        return None
    if contact.pressure is None:
        return _of_other_loads(patch, max(inlet, -outlet), load)
    words, upper, upper_rate = _opened(patch, load, inlet) if lifts else ([], 1.0, None)
    closing, lower = _closed(patch, load, outlet) if presses else ([], 1.0)
    words += closing
    if patch.scene.shape is None and (lower, upper) != (1.0, 1.0):
        words.append(REMEDY)
    kind: Kind = "not covered" if None in (lower, upper) else "estimated"
    sentence = "; ".join(words)
    return Uncertainty(NEGLECTED, kind, sentence, lower, upper, caution=True, upper_rate=upper_rate)


def _opened(
    patch: Patch, load: float, inlet: float
) -> tuple[list[str], float | None, float | None]:
    """Words about the film that the inlet's pressure opens, upper factor and highest leak rate."""
    words = (
        f"the fluid's pressure, up to {_pressure(inlet)} above ambient, is {_ratio(inlet, load)} "
        "the load, carries that part of it and opens the film"
    )
    more = ": more leaks than through the dry contact"
    if load <= inlet:
        lifted_off = (
            "the seal would lift off, since the fluid's pressure is no less than the load of "
            f"{_pressure(load)}"
        )
        return [words + more, lifted_off], None, None
    opened, under = _at_the_end(patch, load - inlet, upper=True)
    if opened is None:
        return [words + more, *under], None, None
    stays = opened.state == "sealed"
    upper = _upper_factor(patch.leak_rate, opened)
    return [words if stays else words + more, *under], upper, opened.upper


def _closed(patch: Patch, load: float, outlet: float) -> tuple[list[str], float | None]:
    """Words about the film that an outlet below ambient closes, and the lower factor."""
    words = [
        f"an outlet {_pressure(-outlet)} below ambient adds {_ratio(-outlet, load)} the load "
        "and closes the film: less leaks than through the dry contact"
    ]
    if patch.leak_rate.state == "sealed":
        return words, 1.0
    closed, under = _at_the_end(patch, load - outlet, upper=False)
    return [*words, *under], None if closed is None else _lower_factor(patch.leak_rate, closed)


def _resolved(patch: Patch) -> Uncertainty:
    """Entry of the equilibrium of contact and flow."""
    state, value = present(patch.lifted, "lifted state"), patch.leak_rate.value
    inlet = _pressure(patch.scene.flow.gauge_pressures.inlet)
    if state.state == "lifted off":
        load = _pressure(present(patch.carried_load, "load"))
        why = (
            f"the fluid presses harder than the load of {load}: no equilibrium keeps the solids "
            "together"
        )
        if patch.carried_load == 0:
            why = "no load presses the solids together, and the fluid lifts them off"
        sentence = f"{why}; under any load above the inlet's pressure, {inlet}, they touch"
        return Uncertainty(LIFT, "estimated", sentence, 1.0, 1.0, caution=True)
    if state.is_range:
        lower = state.lowest / value if value else 1.0
        upper = state.highest / value if value and isfinite(state.highest) else None
        rate = None if value else state.highest
        shown = ShownUnit.of(patch.scene)
        sentence = state.reason or (
            "the search ends sealed, started from the outlet's pressure and from the inlet's; but "
            f"{inlet} on every part that no open path joins to the outlet, contact included, would "
            f"open a path, and up to {rounded_up(state.highest * shown.per_solved)} {shown.name} "
            "would leak"
        )
        caution = state.converged  # else the sentence is the reason of the result already
        entry = Uncertainty(LIFT, "estimated", sentence, lower, upper, caution=caution)
        return replace(entry, upper_rate=rate, is_range=True)
    if state.state == "sealed":
        sentence = (
            f"stays sealed with the inlet's pressure, {inlet} above ambient, on every part that no "
            f"open path joins to the outlet; with {inlet} everywhere no path opens, or the search "
            "found no equilibrium that leaks"
        )
        return Uncertainty(LIFT, "estimated", sentence, 1.0, 1.0)
    finer = "finer networks for the fluid's pressure and "
    if patch.flow_settings.method == "finite-difference":
        finer = ""  # its network is that of the samples
    sentence = (
        f"the fluid carries {with_prefix(state.fluid_load, 'Pa')} of the load; the factors "
        f"estimate what {finer}a smaller gap ε, with which the model lets contact conduct, would "
        "still change"
    )
    error = state.error
    return Uncertainty(LIFT, "estimated", sentence, exp(-error), exp(error), per_rtol=SETTLED)


def _range(patch: Patch) -> Uncertainty:
    """Entry of the dry contacts at both ends of the fluid's pressure."""
    dry = patch.leak_rate
    closed, opened = (wider for _, wider in _range_ends(patch))
    lower, upper, rate = _lower_factor(dry, closed), _upper_factor(dry, opened), opened.range[1]
    shown, least = ShownUnit.of(patch.scene), closed.range[0]
    sentence = (
        "any fluid pressure between those of inlet and outlet is covered: between "
        f"{rounded_down(least * shown.per_solved)} and {rounded_up(rate * shown.per_solved)} "
        f"{shown.name}"
    )
    if isinf(rate):
        sentence = f"under the load less the inlet's pressure {NOT_LIMITED}"
        if lift_range(patch)[1].state == "lifted off":
            sentence = (
                "the inlet's pressure is no less than the load, so that the seal may lift off"
            )
        if isinf(least):
            sentence = "the outlet's pressure is no less than the load: the seal lifts off"
        elif least > 0:
            sentence += f"; at least {rounded_down(least * shown.per_solved)} {shown.name}"
        return Uncertainty(LIFT, "not covered", sentence, lower, None, caution=True, is_range=True)
    return Uncertainty(LIFT, "estimated", sentence, lower, upper, upper_rate=rate, is_range=True)


def lift_range(patch: Patch) -> tuple[LeakRate, LeakRate]:
    """Leak rates of the contact if the outlet's or the inlet's pressure acts everywhere.

    They are those of the dry contact under the load less that pressure. The leak rate with any
    fluid pressure between the two lies between them (for a half-space under a mean pressure). The
    second is "lifted off" if the inlet's pressure is not below the load.
    """
    (closed, _), (opened, _) = _range_ends(patch)
    return closed, opened


@once
def _range_ends(patch: Patch) -> list[tuple[LeakRate, LeakRate]]:
    """Both leak rates of `lift_range`, each also widened by `error_beyond`."""
    ends = list[tuple[LeakRate, LeakRate]]()
    inlet, outlet = patch.scene.flow.gauge_pressures
    for pressure in (outlet, inlet):
        left = patch.load.value - pressure
        if left <= 0:
            ends.append((LeakRate.lifted_off(patch.scene.flow.method),) * 2)
            continue
        end = patch if pressure == 0 else patch.pressed_by(left)
        with patch.timed("lift"):
            ends.append((end.leak_rate, end.leak_rate.widened(error_beyond(patch, end))))
    return ends


def _at_the_end(patch: Patch, pressure: float, *, upper: bool) -> tuple[LeakRate | None, list[str]]:
    """Leak rate of the dry contact under another pressure [Pa], and words about it.

    None if it cannot change the verdict, by its upper or its lower end: without a limit, or where
    the dry contact may be beyond it on that side already. None with [tolerances] as well:
    the fluid changes the leak rate at their ends by another factor, and may lift the solid off.
    """
    limit = patch.scene.limit
    if limit is None or patch.scene.tolerances is not None:
        return None, []
    allowed = limit.volume_rate(patch.scene.drive)
    shown, (low, high) = ShownUnit.of(patch.scene), patch.leak_rate.bounds
    if (high > allowed) if upper else (low <= allowed):
        return None, []
    with patch.timed("fluid pressure"):
        try:
            other = patch.pressed_by(pressure)
            leak = other.leak_rate.widened(error_beyond(patch, other))
        except NotConverged:
            return None, [f"the contact under {_pressure(pressure)} did not converge"]
    low, high = (shown.per_solved * end for end in leak.bounds)
    if upper:
        under = f"under the {_pressure(pressure)} that are left for the solid"
        sealed, end = "the contact is sealed all the same", f"at most {rounded_up(high)}"
    else:
        under = f"under the {_pressure(pressure)} that press the solid then"
        sealed, end = "the contact is sealed", f"at least {rounded_down(low)}"
    if upper and high == inf:
        return None, [f"{under} no upper bound is known: {NOT_LIMITED}"]
    return leak, [f"{under} {sealed}" if leak.state == "sealed" else f"{under}, {end} {shown.name}"]


def _lower_factor(dry: LeakRate, closed: LeakRate) -> float:
    """Lower factor of the entry: lower bound of the closed contact over that of the dry one."""
    return 1.0 if dry.range[0] == 0 else min(1.0, closed.range[0] / dry.range[0])


def _upper_factor(dry: LeakRate, opened: LeakRate) -> float | None:
    """Upper factor of the entry: upper bound of the opened contact over that of the dry one.

    The verdict multiplies it with the flow's factor, which gives the opened contact's upper bound.
    None if the opened contact leaks where the dry one is sealed.
    """
    if dry.state == "sealed":
        return 1.0 if opened.state == "sealed" else None
    return max(1.0, opened.range[1] / dry.range[1])


def _of_other_loads(patch: Patch, pressure: float, load: float) -> Uncertainty:
    """Entry of a contact whose area or mean gap is prescribed instead of its load."""
    by_area = present(patch.scene.contact, "[contact]").mean_gap is None
    kept = "contact area" if by_area else "mean gap"
    sentence = (
        f"the fluid's pressure, up to {_pressure(pressure)} from ambient, is "
        f"{_ratio(pressure, load)} the load and bends the solids; the film is that of a dry "
        f"contact with the {kept} of the scene"
    )
    if patch.scene.shape is None:
        sentence += f"; {REMEDY}"
    return Uncertainty(NEGLECTED, "not covered", sentence, caution=True)


def _ratio(pressure: float, load: float) -> str:
    return f"{pressure / load:.2g} times" if load > 0 else "infinitely many times"


def _pressure(pressure: float) -> str:
    return with_prefix(pressure, "Pa")


LIFTS: dict[str, Callable[[Patch], Uncertainty | None]] = {
    "none": _neglected,
    "range": _range,
    "resolved": _resolved,
}
