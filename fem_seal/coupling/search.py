"""The contact that the pressure of the leaking fluid lifts, and the flow through it.

Newton's method solves both together (`newton`), in `stages`: the network of the flow becomes finer,
and the gap ε that conducts under contact smaller. The leak rate of the result is that of the gap
without ε, with its own bounds (docs/theory/lift.md).
"""

from dataclasses import replace
from math import exp, inf, log
from sys import float_info
from typing import NamedTuple

import numpy as np

from fem_seal import parallel
from fem_seal.contact.state import ContactState
from fem_seal.coupling.newton import Steps, newton
from fem_seal.coupling.point import FloatingPoint
from fem_seal.coupling.problem import LiftProblem
from fem_seal.coupling.stages import first_stage, further_stages
from fem_seal.coupling.state import LARGEST_CHANGE, SETTLED, LiftedState
from fem_seal.digits import number_of
from fem_seal.errors import InvalidInput, present
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.leak_rate import log_ratio
from fem_seal.network.network import Network

MOST_ERROR = log(float_info.max)  # of ln Q, whose exponential is finite
FINER = "compare a finer grid of the contact"


def lifted_state(
    problem: LiftProblem, *, dry: ContactState | None = None, start: np.ndarray | None = None
) -> LiftedState:
    """Solve contact and flow together, to the tolerance of the flow.

    Newton's method starts from the outlet's pressure everywhere. Where that contact is sealed, or
    the steps were difficult, there may be a sealed and a leaking equilibrium: a second start from
    the inlet's pressure must then lead to the same state, unless no pressure of the fluid opens the
    film (`LiftProblem.never_opens`).

    Parameters
    ----------
    dry
        Contact under the outlet's pressure everywhere, if it is known.
    start : (nx, ny)
        Fluid pressure [Pa] from which Newton's method starts in place of both.
    """
    if start is not None and problem.solid_load(start) <= 0:
        raise InvalidInput(
            f"start: a mean pressure of {start.mean():g} Pa carries the whole load of "
            f"{problem.load:g} Pa; begin with less"
        )
    uniform = problem.uniform_pressure
    # A uniform film carries as much however thick it is: such a load is lifted for ever.
    if problem.load is not None and problem.load <= uniform.mean():
        return LiftedState(problem.field(uniform))

    def search() -> list[_End]:
        if start is None:
            return _from_both_ends(problem, dry)
        return [_end_of(further_stages(problem, first_stage(problem, start)))]

    # One process searches with the threads of all; the flow is shared by all.
    ends = parallel.on_root(search, problem.comm)
    states = [_completed(problem, end) for end in ends]
    if len(states) == 1:
        return states[0]
    return _merged(*states, in_equilibrium=not any(end.failure for end in ends))


class _End(NamedTuple):
    """Where the stages from one start have ended, as the first process tells the others."""

    fluid_pressure: GridField
    contact: ContactState
    network: Network
    residuals: tuple[float, ...]  #: this and the next three fields are those of `Steps`
    change: float
    error: float
    failure: str
    opened: GridFilm | None  #: film that the most fluid pressure opens, if the contact is sealed


def _end_of(steps: Steps) -> _End:
    """The end of the stages from one start."""
    point = steps.point
    return _End(
        point.problem.field(point.pressure),
        point.contact,
        point.network,
        steps.residuals,
        steps.change,
        steps.error,
        steps.failure,
        point.opened if point.sealed else None,
    )


def _from_both_ends(problem: LiftProblem, dry: ContactState | None) -> list[_End]:
    """Where the stages end that start from the outlet's pressure, and from another one if needed.

    If the solid may float, it may do so above a contact: a start from high above leads there. Else
    the second start is from the inlet's pressure. If both have the same equilibrium in the first
    stage, the next stages are the same as well: the second start goes on only if the first one has
    not settled, or has lost its equilibrium on the way.
    """
    low, high = (
        np.full(problem.height.shape, end) for end in (problem.outlet, problem.largest_start)
    )
    dry = dry or problem.contact_under(low)
    first = first_stage(problem, low, dry)
    steps = further_stages(problem, first)
    if problem.may_float and not isinstance(steps.point, FloatingPoint):
        above = newton(FloatingPoint.high(first.point), problem.allowed)
        if not above.failure:
            return [_end_of(steps), _end_of(further_stages(problem, above))]
    if not _may_be_another(problem, steps, dry):
        return [_end_of(steps)]
    second = first_stage(problem, high)
    if not steps.failure and (steps.error <= problem.allowed or steps.point.stays_sealed):
        # Where the solid floats at no separation, a start that carries the whole load takes no
        # step: that it fails says nothing.
        stuck = problem.may_float and bool(second.failure)
        lost = steps.lost or second.lost
        if stuck or (not lost and second.point.leaks_like(first.point)):
            return [_end_of(steps)]
    return [_end_of(steps), _end_of(further_stages(problem, second))]


def _may_be_another(problem: LiftProblem, steps: Steps, dry: ContactState) -> bool:
    """Whether there may be another equilibrium than the one that steps have led to.

    There is none if that is sealed and no pressure of the fluid opens the film.
    """
    if steps.point.sealed:
        return not (steps.point.stays_sealed and problem.never_opens)
    return steps.difficult or problem.film(dry.gap).sealed


def _completed(problem: LiftProblem, end: _End) -> LiftedState:
    """The state of an end, its leak rate to the result's tolerance, and the range of leak rates."""
    # The error of a lift that has not settled may be infinite, and no flow decides beside it: its
    # flow is that of a settled one. The verdict counts the whole error all the same.
    leak = problem.flow(problem.film(end.contact.gap), min(end.error, problem.allowed))
    state = LiftedState(
        fluid_pressure=end.fluid_pressure,
        contact=end.contact,
        leak_rate=leak,
        steps=len(end.residuals) - 1,
        lowest=leak.value,
        highest=leak.value,
        residuals=end.residuals,
        network=end.network,
    )
    if leak.state == "sealed":
        return _of_sealed(problem, end, state)
    return _of_leaking(end, state, leak.value, problem.allowed)


def _of_leaking(end: _End, state: LiftedState, rate: float, allowed: float) -> LiftedState:
    """The state of an end that leaks at a rate [m³/s]: its range is what the error leaves."""
    known = rate > 0 and end.error <= MOST_ERROR
    lowest, highest = rate * exp(-end.error), rate * exp(end.error) if known else inf
    reason = _why_not_settled(end, allowed, known=known)
    if reason:
        reason = _with_range(reason, f"{lowest:.3g}", highest, known=known)
    return replace(
        state, change=end.change, error=end.error, lowest=lowest, highest=highest, reason=reason
    )


def _of_sealed(problem: LiftProblem, end: _End, state: LiftedState) -> LiftedState:
    """The state of a sealed end: its range ends at what the most fluid pressure would open."""
    failure = end.failure and f"contact and flow have not settled: {end.failure}"
    if end.opened is None:
        if not failure or problem.never_opens:
            return state
        # Newton's steps may have missed an equilibrium that leaks, and nothing tells how much.
        reason = _with_range(failure, "0 (sealed)", inf, known=False)
        return replace(state, highest=inf, reason=reason)
    if problem.solid_load(problem.highest_pressure(end.contact)) > 0:
        highest = problem.flow(end.opened, 0.0).range[1]
        opened_gap = present(end.opened.constriction, "constriction").gap
        reason = failure if highest else ""
    else:
        highest, opened_gap = inf, 0.0
        reason = failure or (
            f"the film is sealed after {state.steps} of Newton's steps, but more fluid pressure "
            "under the contact would lift it off"
        )
    if reason:
        reason = _with_range(reason, "0 (sealed)", highest)
    return replace(state, highest=highest, opened_gap=opened_gap, reason=reason)


def _with_range(reason: str, lowest: str, highest: float, *, known: bool = True) -> str:
    """Why a state has not settled, with the leak rates [m³/s] that this leaves."""
    most = f"{highest:.3g} m^3/s" if highest < inf else "that of a film lifted off"
    rates = f"with this error alone the leak rate lies between {lowest} and {most}"
    return f"{reason}: {rates if known else 'the leak rate may have any value'}; {FINER}"


def _why_not_settled(end: _End, allowed: float, *, known: bool) -> str:
    if end.failure:
        return f"contact and flow have not settled: {end.failure}"
    if not known:
        if end.error <= MOST_ERROR:
            return "the flow through the lifted gap has no value"
        return "the error of the fluid's pressure is not known"
    if end.error > allowed:
        return (
            f"the fluid's pressure leaves an error of {end.error:.2g} in the logarithm of the "
            f"leak rate, more than the {allowed:.2g} allowed "
            f"({SETTLED:g} of flow.rtol, {SETTLED * LARGEST_CHANGE:g} at most)"
        )
    return ""


def _merged(first: LiftedState, second: LiftedState, *, in_equilibrium: bool) -> LiftedState:
    """The state of two starts: the second one, or the first if that alone has settled.

    `in_equilibrium` says whether Newton's steps have brought both there.
    """
    leaks = [present(state.leak_rate, "leak rate") for state in (first, second)]
    apart = log_ratio(*(leak.value for leak in leaks))
    # What the states claim of ln Q is beside the bounds of their flows.
    widths = [log_ratio(*leak.bounds) for leak in leaks if leak.lower]
    shown = first if first.converged and not second.converged else second
    both = replace(shown, steps=first.steps + second.steps)
    if first.converged and second.converged and not any(leak.value for leak in leaks):
        # Both are sealed: the pressure that opens one film may open the other as well.
        most = max((first, second), key=lambda state: state.highest)
        both = replace(both, highest=most.highest, opened_gap=most.opened_gap)
    if apart <= first.error + second.error + max(widths, default=0.0):
        return both
    settled = in_equilibrium and all(s.converged or s.state == "sealed" for s in (first, second))
    what = "have two equilibria" if settled else "come to two states, not both of them settled"
    starts = "from the pressure of the outlet and of the inlet"
    if second.floats and not first.floats:
        starts = "one in contact and one floating above it"
    names = [f"{leak.value:.3g} m^3/s" if leak.value else "0 (sealed)" for leak in leaks]
    opened = [present(state.contact, "contact").gap.values > 0 for state in (first, second)]
    differ = np.count_nonzero(opened[0] != opened[1])
    reason = (
        f"contact and flow {what}, {starts}: "
        f"{number_of(differ, 'sample')} open in one and closed in the other, and the leak rate is "
        f"{names[0]} or {names[1]}; {FINER}"
    )
    return replace(
        both,
        lowest=min(first.lowest, second.lowest),
        highest=max(first.highest, second.highest),
        reason=reason,
    )
