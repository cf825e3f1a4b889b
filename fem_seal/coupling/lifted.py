"""The contact that the pressure of the leaking fluid lifts, and the flow through it.

With the compliance S of the solid, heights h of the counter-face, fluid pressure p_f and contact
pressure p_c:

    gap             g = S (p_c + p_f) - h + const >= 0,    p_c >= 0,    p_c g = 0
    flow            ∇·((g³ + ε³)/(12 η) ∇p_f) = 0 on the whole patch
    load            mean(p_c + p_f) = P₀

The small gap ε makes p_f a continuous function of the gap, under contact and in pockets as well.
Newton's method solves both together (`newton`), in stages: the network of the flow becomes finer
and ε smaller. At the end of each stage the flow of the next one tells how much its pressure would
change the leak rate; the stages end when that is little. The leak rate of the result is that of
the gap without ε, with its own bounds.
"""

from dataclasses import dataclass, replace
from math import exp, inf, log
from sys import float_info

import numpy as np

from fem_seal import parallel
from fem_seal.contact.state import ContactState
from fem_seal.coupling.constants import FIRST_EPSILON, FORCING, LEAST, MOST_STAGES, MOST_STEPS
from fem_seal.coupling.newton import Steps, equilibrium
from fem_seal.coupling.point import LiftPoint, Stage
from fem_seal.coupling.problem import LiftProblem
from fem_seal.coupling.state import FIRST_ORDER, LiftedState, allowed_error, spread
from fem_seal.errors import present
from fem_seal.film import GridFilm
from fem_seal.network.pressure_grid import PressureGrid
from fem_seal.progress import Report, silent

MOST_ERROR = log(float_info.max)  # of ln Q, whose exponential is finite
FINER = "compare a finer grid (surface.shape)"


def lifted(
    problem: LiftProblem,
    rtol: float,
    *,
    dry: ContactState | None = None,
    report: Report = silent,
) -> LiftedState:
    """Solve contact and flow together.

    Newton's method starts from the outlet's pressure everywhere. Where that contact is sealed, or
    the steps were difficult, there may be a sealed and a leaking equilibrium: a second start from
    the inlet's pressure must then lead to the same state.

    Parameters
    ----------
    rtol
        Tolerance of the flow; above 0.3 it counts as that. The state has settled if its ln Q errs
        by at most half of it.
    dry
        Contact under the outlet's pressure everywhere, if it is known.
    report
        Called with each step.

    Raises
    ------
    NotConverged
        If a contact or a flow fails.
    """
    allowed = allowed_error(min(rtol, FIRST_ORDER))
    uniform = problem.uniform_pressure
    if problem.load is not None and problem.load <= uniform.mean():
        return _lifted_off(problem, uniform)
    if dry is None:
        low = np.full(problem.height.shape, problem.outlet)
        dry = parallel.on_root(lambda: problem.contact_under(low), problem.comm)
    ends = parallel.on_root(lambda: _from_both_ends(problem, allowed, dry, report), problem.comm)
    states = [_state_of(problem, allowed, end) for end in ends]
    return states[0] if len(states) == 1 else _both(*states)


def lifted_from(
    problem: LiftProblem, rtol: float, pressure: np.ndarray, report: Report = silent
) -> LiftedState:
    """The state to which Newton's method leads from a fluid pressure (nx, ny) [Pa]."""
    allowed = allowed_error(min(rtol, FIRST_ORDER))

    def search() -> _End:
        first = _first_stage(problem, allowed, pressure, None, report)
        return _further_stages(problem, allowed, first, report)

    return _state_of(problem, allowed, parallel.on_root(search, problem.comm))


@dataclass(frozen=True, eq=False)
class _End:
    """Where the stages from one start have ended."""

    pressure: np.ndarray  #: p_f (nx, ny) [Pa]
    contact: ContactState  #: under it
    network: PressureGrid  #: of the last stage
    stays_sealed: bool  #: whether the film is sealed, and no fluid pressure opens it
    opened: GridFilm | None  #: a sealed film as the most fluid pressure opens it
    change: float  #: of ln Q by the last stage
    error: float  #: of ln Q, estimated
    failure: str  #: why the last stage has not come to an equilibrium, else ""
    difficult: bool  #: as of `Steps`
    residuals: tuple[float, ...]  #: rms of F over the pressure drop, at each step's start


def _from_both_ends(
    problem: LiftProblem, allowed: float, dry: ContactState, report: Report
) -> list[_End]:
    """Where the stages end that start from the outlet's pressure, and from the inlet's if needed.

    If both have the same equilibrium in the first stage, the next stages are the same as well: the
    second start goes on only if the first one has not settled.
    """
    low, high = (np.full(dry.gap.shape, end) for end in (problem.outlet, problem.inlet))
    first = _first_stage(problem, allowed, low, dry, report)
    end = _further_stages(problem, allowed, first, report)
    doubtful = problem.film(dry.gap).sealed or end.difficult
    if end.stays_sealed or problem.may_float or not doubtful:
        return [end]
    second = _first_stage(problem, allowed, high, None, report)
    settled = end.error <= allowed and not (end.failure or first.failure or second.failure)
    if settled and second.point.is_that_of(first.point, allowed):
        return [end]
    return [end, _further_stages(problem, allowed, second, report)]


def _first_stage(
    problem: LiftProblem,
    allowed: float,
    pressure: np.ndarray,
    contact: ContactState | None,
    report: Report,
) -> Steps:
    """The equilibrium of a coarse network, of every second or fourth sample on large grids.

    Parameters
    ----------
    pressure : (nx, ny)
        Fluid pressure [Pa] at the start.
    contact
        Contact under it, if known.
    """
    thinned = problem.thinned
    every = problem.height.shape[0] // thinned.height.shape[0]
    stage = Stage(thinned.first_grid, FIRST_EPSILON * float(problem.height.values.std()))
    start = None if contact is None else contact.pressure.values[::every, ::every]
    point = LiftPoint.under(thinned, stage, pressure[::every, ::every], start)
    return equilibrium(point, allowed, report, leaves=True)


def _further_stages(problem: LiftProblem, allowed: float, steps: Steps, report: Report) -> _End:
    """Go on from the equilibrium of the first stage.

    When a stage begins, its flow tells by how much the fluid's pressure of the stage before is
    wrong. Its triangles are smaller where that changes ln Q most. The stages end when all that
    further ones would change is little, or when no fluid pressure opens the film.
    """
    if steps.point.problem is not problem:
        steps = _solved(steps.point.on(problem, allowed), steps, allowed, report)
    change = error = inf
    moved, sealed_stages = 0.0, 0
    for _ in range(1, MOST_STAGES):
        point = steps.point
        sealed_stages = sealed_stages + 1 if point.sealed else 0
        # Where Newton's steps have failed, the film is sealed in no equilibrium.
        stays = sealed_stages >= MOST_STAGES // 2 and not steps.failure
        if stays or (point.sealed and point.opened is None):
            break
        if point.flow.conductance <= problem.negligible:
            error = inf
            break
        stage = point.finer(allowed)
        if stage is None:
            break
        start, steps = _begun(steps, stage)
        before, change = change, start.error(point.adjoint)
        to_come = change * _all_to_come(change, before)
        error = (max(to_come, moved) if steps.difficult else to_come) + start.by_epsilon
        little = error <= allowed and start.keeps_load(allowed)
        if little and not point.sealed and not steps.failure:
            steps = replace(steps, point=start, residuals=(*steps.residuals, start.size))
            break
        steps = _solved(start, steps, allowed, report)
        moved = abs(log(steps.point.flow.conductance / start.flow.conductance))
    point = steps.point
    opened = point.opened if point.sealed else None
    return _End(
        pressure=point.pressure,
        contact=point.contact,
        network=point.stage.grid,
        stays_sealed=point.sealed and opened is None,
        opened=opened,
        change=change,
        error=max(error, LEAST * allowed),
        failure=steps.failure,
        difficult=steps.difficult,
        residuals=steps.residuals,
    )


def _begun(steps: Steps, stage: Stage) -> tuple[LiftPoint, Steps]:
    """The first point of a stage, a step of the one before further on; and what has failed so far.

    If the stage before has no equilibrium, it begins where that one has ended.
    """
    point = steps.point
    if not point.linear_systems_solved:
        failure = (
            f"GMRES has not reached a relative residual of {FORCING:g} (adjoint: {FORCING**2:g}) "
            f"in {MOST_STEPS} iterations"
        )
        steps = replace(steps, failure=steps.failure or failure)
    if not steps.failure:
        point = point.after(point.step) or point
    return replace(point, stage=stage), steps


def _solved(point: LiftPoint, before: Steps, allowed: float, report: Report) -> Steps:
    """The equilibrium of a stage, with the steps of the stages before."""
    tolerance = LEAST * allowed if before.difficult else allowed
    return equilibrium(point, tolerance, report, leaves=not before.left).after(before)


def _all_to_come(change: float, before: float) -> float:
    """1 + r + r² + …, with the ratio r of this stage's change to the last one's; 1/2 if unknown.

    At most 10: changes that hardly fall are those of rounding, or do not become small enough.
    """
    return 1 / (1 - min(change / before, 0.9)) if 0 < before < inf else 2.0


def _state_of(problem: LiftProblem, allowed: float, end: _End) -> LiftedState:
    """The state at the end of the steps, with its leak rate to the tolerance of the result."""
    leak = problem.flow(problem.film(end.contact.gap), min(end.error, allowed))
    error, reason, steps = end.error, "", len(end.residuals) - 1
    known = leak.state == "sealed" or (leak.value > 0 and error <= MOST_ERROR)
    lowest = leak.value * exp(-error)
    highest = leak.value * exp(min(error, MOST_ERROR)) if known else inf
    if leak.state == "sealed":
        if not end.stays_sealed:
            highest = inf
            if (
                end.opened is not None
                and problem.solid_load(problem.highest_pressure(end.contact)) > 0
            ):
                most = problem.flow(end.opened, 0.0)
                highest = most.value if most.upper is None else most.upper
            reason = (
                f"the film is sealed after {steps} of Newton's steps, but more fluid pressure "
                "under the contact would open it"
            )
        error = 0.0
    elif end.failure:
        reason = f"contact and flow have not settled: {end.failure}"
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
    return LiftedState(
        state=leak.state,
        contact=end.contact,
        fluid_pressure=problem.field(end.pressure),
        leak_rate=leak,
        steps=steps,
        change=0.0 if leak.state == "sealed" else end.change,
        error=error,
        converged=not reason,
        lowest=lowest,
        highest=highest,
        residuals=end.residuals,
        network=end.network,
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
        converged=False,
        lowest=min(first.lowest, second.lowest),
        highest=max(first.highest, second.highest),
        reason=reason,
    )


def _lifted_off(problem: LiftProblem, pressure: np.ndarray) -> LiftedState:
    return LiftedState(
        state="lifted off",
        contact=None,
        fluid_pressure=problem.field(pressure),
        leak_rate=None,
        steps=0,
        change=0.0,
        error=0.0,
        converged=True,
        lowest=inf,
        highest=inf,
    )
