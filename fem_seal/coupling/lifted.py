"""The contact that the pressure of the leaking fluid lifts, and the flow through it.

Newton's method solves both together (`newton`), in stages: the network of the flow becomes finer,
and the gap ε that conducts under contact smaller. The flow at the beginning of a stage tells
how much its pressure changes the leak rate; the stages end when that is little. The leak rate of
the result is that of the gap without ε, with its own bounds (docs/theory/lift.md).
"""

from dataclasses import replace
from math import exp, inf, log
from sys import float_info
from time import perf_counter
from typing import TypeAlias

import numpy as np

from fem_seal import parallel
from fem_seal.contact.state import ContactState
from fem_seal.coupling.constants import INNER, MOST_FAILED, MOST_NODES, MOST_STEPS, SEALED
from fem_seal.coupling.newton import Steps, equilibrium
from fem_seal.coupling.point import LiftPoint
from fem_seal.coupling.problem import LiftProblem
from fem_seal.coupling.state import FIRST_ORDER, LiftedState, allowed_error, spread
from fem_seal.errors import present
from fem_seal.film import GridFilm

MOST_ERROR = log(float_info.max)  # of ln Q, whose exponential is finite
FINER = "compare a finer grid of the contact"


def lifted(
    problem: LiftProblem,
    rtol: float,
    *,
    dry: ContactState | None = None,
    start: np.ndarray | None = None,
) -> LiftedState:
    """Solve contact and flow together.

    Newton's method starts from the outlet's pressure everywhere. Where that contact is sealed, or
    the steps were difficult, there may be a sealed and a leaking equilibrium: a second start from
    the inlet's pressure must then lead to the same state, unless no pressure of the fluid opens the
    film (`LiftProblem.never_opens`).

    Parameters
    ----------
    rtol
        Relative tolerance of the leak rate; larger values are treated as 0.3, beyond which first
        orders say little. The state has settled if its ln Q errs by at most half of it.
    dry
        Contact under the outlet's pressure everywhere, if it is known.
    start : (nx, ny)
        Fluid pressure [Pa] from which Newton's method starts in place of both.
    """
    allowed = allowed_error(min(rtol, FIRST_ORDER))
    uniform = problem.uniform_pressure
    if problem.load is not None and problem.load <= uniform.mean():
        return LiftedState(problem.field(uniform))

    def search() -> list[_End]:
        if start is None:
            return _from_both_ends(problem, allowed, dry)
        return [_end(_further_stages(problem, allowed, _first_stage(problem, allowed, start)))]

    ends = parallel.on_root(search, problem.comm)
    states = [_completed(problem, allowed, *end) for end in ends]
    return states[0] if len(states) == 1 else _both(*states)


# What the first process sends to the others: a state without its leak rate, and the film that the
# most fluid pressure opens if the state is sealed.
_End: TypeAlias = tuple[LiftedState, GridFilm | None]


def _end(steps: Steps) -> _End:
    """Where the stages from one start have ended."""
    point = steps.point
    state = LiftedState(
        fluid_pressure=point.problem.field(point.pressure),
        contact=point.contact,
        steps=len(steps.residuals) - 1,
        change=steps.change,
        error=steps.error,
        residuals=steps.residuals,
        network=point.network,
        reason=steps.failure,
    )
    return state, point.opened if point.sealed else None


def _from_both_ends(problem: LiftProblem, allowed: float, dry: ContactState | None) -> list[_End]:
    """Where the stages end that start from the outlet's pressure, and from the inlet's if needed.

    If both have the same equilibrium in the first stage, the next stages are the same as well: the
    second start goes on only if the first one has not settled, or has lost its equilibrium on the
    way. Where the solid may float, a second start that comes to no equilibrium in its first stage
    is ignored. A film that no pressure can open needs no second start.
    """
    low, high = (
        np.full(problem.height.shape, end) for end in (problem.outlet, problem.largest_start)
    )
    dry = dry or problem.contact_under(low)
    first = _first_stage(problem, allowed, low, dry)
    steps = _further_stages(problem, allowed, first)
    end, sealed = _end(steps), steps.point.sealed
    stays_sealed = sealed and end[1] is None
    if stays_sealed and problem.never_opens:
        return [end]
    if not (sealed or steps.difficult or problem.film(dry.gap).sealed):
        return [end]
    second = _first_stage(problem, allowed, high)
    if (stays_sealed or steps.error <= allowed) and not steps.failure:
        # A pressure that leaves nothing to the solid, and lets it float nowhere, does not move.
        stuck = problem.may_float and bool(second.failure)
        lost = steps.lost + second.lost
        if stuck or (not lost and second.point.leaks_as(first.point, allowed)):
            return [end]
    return [end, _end(_further_stages(problem, allowed, second))]


def _first_stage(
    problem: LiftProblem,
    allowed: float,
    pressure: np.ndarray,
    contact: ContactState | None = None,
) -> Steps:
    """The equilibrium of a coarse network, and of few samples on large grids.

    It starts from a fluid pressure (nx, ny) [Pa] and the contact under it, if that is known.
    """
    thinned = problem.chain[0]
    # A gap of the rms height that ε makes wider has a larger ln g³, by what is allowed.
    epsilon = allowed / 3 * problem.roughness
    every = problem.every(thinned.height.values)
    start = None if contact is None else contact.pressure.values[::every, ::every]
    pressure = pressure[::every, ::every]
    pressed = thinned.contact_under(pressure, start)
    point = LiftPoint(thinned, thinned.first_network, epsilon, pressure, pressed)
    return equilibrium(point, allowed)


def _further_stages(problem: LiftProblem, allowed: float, steps: Steps) -> Steps:
    """Go on from the equilibrium of the first stage.

    When a stage begins, its flow tells by how much the fluid's pressure of the stage before is
    wrong. The stages end when all that further ones would change is little, or when there is none.
    """
    change, error, moved, over = inf, inf, 0.0, ""
    for _ in range(MOST_STEPS // 2):
        began = perf_counter()
        start = None if over else _next_stage(problem, allowed, steps)
        if start is None:
            break
        before, change = change, steps.point.error_of(start)
        to_come = _sum_to_come(change, before)
        error = (max(to_come, moved) if steps.difficult else to_come) + start.by_epsilon
        little = error <= allowed and start.keeps_load(allowed)
        if little and not (steps.point.sealed or start.sealed or steps.failure):
            steps = Steps(start, (start.size,), False, "").after(steps)
            if start.problem is problem:
                break
            change = inf  # the change of the next stage contains that of this one
            continue
        exact = steps.difficult or start.problem is not problem
        found = equilibrium(start, INNER * allowed if exact else allowed)
        if found.failure and found.point.sealed and _stays_sealed(steps.point, problem):
            break  # the sealed equilibrium stands: this stage looked for one that leaks
        steps = found.after(steps)
        moved = spread(steps.point.flow.conductance, start.flow.conductance)
        # No state has fewer samples than all.
        if start.problem is problem:
            if steps.lost >= MOST_FAILED:
                break
            # The next network has four times the nodes.
            over = problem.limits.exceeded(problem.began, 1.0, 4 * (perf_counter() - began))
    if _leaks_nothing(steps.point, problem):
        error = inf  # the stages to come were not solved
    if steps.failure:
        error = max(error, steps.point.step.log_rate)
    error = max(error, INNER * allowed)  # the contacts are no more exact
    return replace(steps, change=change, error=error, failure=steps.failure or over)


def _sum_to_come(change: float, before: float) -> float:
    """Sum of the changes of a stage and of all after it, from that of the stage before.

    They fall by a ratio r: the sum is 1/(1 - r) times the first.
    """
    ratio = min(change / before, 0.9) if 0 < before < inf else 0.5
    return change / (1 - ratio)


def _leaks_nothing(point: LiftPoint, problem: LiftProblem) -> bool:
    """Whether a film on all samples leaks so little that it counts as sealed."""
    return point.problem is problem and point.flow.conductance <= problem.negligible


def _stays_sealed(point: LiftPoint, problem: LiftProblem) -> bool:
    """Whether a film on all samples is sealed, and stays so under the most fluid pressure."""
    return point.problem is problem and point.sealed and point.opened is None


def _next_stage(problem: LiftProblem, allowed: float, steps: Steps) -> LiftPoint | None:
    """The first point of the next stage, None if it has none.

    It has none where the film stays sealed with a small ε or leaks next to nothing, and where its
    network would be too large.
    """
    point, chain = steps.point, problem.chain
    if _leaks_nothing(point, problem):
        return None
    following = chain[min(chain.index(point.problem) + 1, len(chain) - 1)]
    sealed, least = point.sealed and point.problem is problem, SEALED * problem.roughness
    stays_sealed = _stays_sealed(point, problem)
    if stays_sealed and (point.epsilon <= least or problem.never_opens):
        return None
    network, epsilon = point.finer(allowed, following)
    if stays_sealed:
        epsilon = least
    # ε³ below this is lost in the rounding of g³, and so are the changes by a sealed film's steps.
    lost = epsilon**3 < float_info.epsilon * problem.roughness**3
    if (sealed and lost) or len(network.free) > MOST_NODES:
        return None
    if following is point.problem:
        return replace(point, network=network, epsilon=epsilon)
    pressure = following.interpolated(point.pressure)
    return LiftPoint(following, network, epsilon, pressure, following.contact_under(pressure))


def _completed(
    problem: LiftProblem, allowed: float, state: LiftedState, opened: GridFilm | None
) -> LiftedState:
    """A state with its leak rate to the tolerance of the result, and the range of leak rates."""
    contact, error = present(state.contact, "contact"), state.error
    leak = problem.flow(problem.film(contact.gap), min(error, allowed))
    known = leak.state == "sealed" or (leak.value > 0 and error <= MOST_ERROR)
    lowest = leak.value * exp(-error)
    highest = leak.value * exp(min(error, MOST_ERROR)) if known else inf
    reason = ""
    if leak.state == "sealed":
        if opened is not None:
            highest = inf
            if problem.solid_load(problem.highest_pressure(contact)) > 0:
                most = problem.flow(opened, 0.0)
                highest = most.value if most.upper is None else most.upper
            reason = (
                f"the film is sealed after {state.steps} of Newton's steps, but more fluid "
                "pressure under the contact would open it"
            )
        error = 0.0
    elif state.reason:
        reason = f"contact and flow have not settled: {state.reason}"
    elif not known:
        reason = leak.reason or "the error of the fluid's pressure is not known"
    elif error > allowed:
        reason = (
            f"the fluid's pressure leaves an error of {error:.2g} in the logarithm of the leak "
            f"rate, more than the {allowed:.2g} that flow.rtol allows"
        )
    if reason:
        low = "0 (sealed)" if leak.state == "sealed" else f"{lowest:.3g}"
        high = f"{highest:.3g} m^3/s" if highest < inf else "that of a film lifted off"
        rates = f"the leak rate is between {low} and {high}" if known else "it may be any leak rate"
        reason += f": {rates}; {FINER}"
    return replace(
        state,
        leak_rate=leak,
        change=0.0 if leak.state == "sealed" else state.change,
        error=error,
        lowest=lowest,
        highest=highest,
        reason=reason,
    )


def _both(first: LiftedState, second: LiftedState) -> LiftedState:
    """The second of two states, or the first alone if only that has settled."""
    leaks = [present(state.leak_rate, "leak rate") for state in (first, second)]
    apart = spread(*(leak.value for leak in leaks))
    widths = [spread(*leak.bounds) for leak in leaks if leak.lower]
    shown = first if first.converged and not second.converged else second
    both = replace(shown, steps=first.steps + second.steps)
    if apart <= first.error + second.error + max(widths, default=0.0):
        return both
    settled = all(state.converged or state.state == "sealed" for state in (first, second))
    what = "have two equilibria" if settled else "come to two states, not both of them settled"
    names = [f"{leak.value:.3g} m^3/s" if leak.value else "0 (sealed)" for leak in leaks]
    opened = [present(state.contact, "contact").gap.values > 0 for state in (first, second)]
    differ = np.count_nonzero(opened[0] != opened[1])
    reason = (
        f"contact and flow {what}, from the pressure of the outlet and of the inlet: "
        f"{differ} samples are open in one and closed in the other, and the leak rate is "
        f"{names[0]} or {names[1]}; {FINER}"
    )
    return replace(
        both,
        lowest=min(first.lowest, second.lowest),
        highest=max(first.highest, second.highest),
        reason=reason,
    )
