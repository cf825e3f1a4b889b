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
from fem_seal.coupling.constants import (
    FIRST_EPSILON,
    FIRST_ORDER,
    MOST_STAGES,
    MOST_STEPS,
    PART,
    ROUGH,
)
from fem_seal.coupling.newton import FloatingPoint, LiftPoint, Log, Stage, newton
from fem_seal.coupling.problem import LiftProblem
from fem_seal.coupling.state import SETTLED, LiftedState, most_claimed, spread
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
    rtol = min(rtol, FIRST_ORDER)
    low = np.full(problem.height.shape, problem.outlet)
    uniform = problem.uniform_pressure
    if problem.load is not None and problem.load <= uniform.mean():
        return _lifted_off(problem, uniform)
    if dry is None:
        dry = parallel.on_root(lambda: problem.contact_under(low), problem.comm)
    found = parallel.on_root(lambda: _from_both_ends(problem, rtol, low, dry, report), problem.comm)
    states = [_state_of(problem, rtol, one) for one in found]
    return states[0] if len(states) == 1 else _both(*states)


def lifted_from(
    problem: LiftProblem, rtol: float, pressure: np.ndarray, report: Report = silent
) -> LiftedState:
    """The state to which Newton's method leads from a fluid pressure (nx, ny) [Pa]."""
    rtol = min(rtol, FIRST_ORDER)
    found = parallel.on_root(
        lambda: _Stages(problem, rtol, pressure, None, report).end(), problem.comm
    )
    return _state_of(problem, rtol, found)


@dataclass(frozen=True, eq=False)
class _Found:
    """Where the stages from one start have ended."""

    pressure: np.ndarray  #: p_f (nx, ny) [Pa]
    contact: ContactState  #: under it
    certain: bool  #: whether no fluid pressure opens the film
    change: float  #: of ln Q in the last step
    error: float  #: of ln Q
    failure: str  #: why the last stage has not come to an equilibrium, else ""
    residuals: tuple[float, ...]  #: rms of F over the pressure drop, at each step's start
    network: PressureGrid  #: of the last stage


def _from_both_ends(
    problem: LiftProblem, rtol: float, low: np.ndarray, dry: ContactState, report: Report
) -> list[_Found]:
    """Where the stages end that start from the outlet's pressure, and from the inlet's if needed.

    If both have the same equilibrium in the first stage, the next stages are the same as well: the
    second start goes on only if the first one has not settled.
    """
    stages = _Stages(problem, rtol, low, dry, report)
    first, found = stages.first, [stages.end()]
    doubtful = problem.film(dry.gap).sealed or stages.difficult
    if found[0].certain or problem.may_float or not doubtful:
        return found
    stages = _Stages(problem, rtol, np.full_like(low, problem.inlet), None, report)
    settled = found[0].error <= SETTLED * rtol and not found[0].failure
    if settled and first and stages.first and stages.first.is_that_of(first, SETTLED * rtol):
        return found
    return [*found, stages.end()]


class _Stages:
    """Newton's method in stages, from one fluid pressure.

    On large grids the first stage takes every second or fourth sample of the contact. When a
    later one begins, its flow tells by how much the fluid's pressure of the stage before is wrong.
    Its triangles are smaller where that changes ln Q most. The stages end when all that further
    ones would change is little, or when no fluid pressure opens the film.
    """

    def __init__(
        self,
        problem: LiftProblem,
        rtol: float,
        pressure: np.ndarray,  # (nx, ny) [Pa] at the start
        contact: ContactState | None,  # under it, if known
        report: Report,
    ):
        self._problem, self._allowed, self._log = problem, SETTLED * rtol, Log(report)
        self._left = False  # whether plain passes have left a state
        self._sealed = 0  # stages in a row with a sealed film
        self._change = self._differs = self._error = inf  # of ln Q: last step, last stage, all
        thinned = problem.thinned
        stage = Stage(thinned.first_grid, FIRST_EPSILON * float(problem.height.values.std()))
        every = problem.height.shape[0] // thinned.height.shape[0]
        start = None if contact is None else contact.pressure.values[::every, ::every]
        self._point = LiftPoint.under(thinned, stage, pressure[::every, ::every], start)
        self._log.add(self._point)
        self._solve()
        #: equilibrium of the first stage, if it was found
        self.first = None if self._log.failure else self._point

    def end(self) -> _Found:
        """Go on to the last stage."""
        problem, certain = self._problem, False
        if self._point.problem is not problem:
            self._go_to(self._point.on(problem))
            self._solve()
        for _ in range(1, MOST_STAGES):
            if self._point.flow.conductance <= problem.negligible:
                self._error = inf
                break
            self._sealed = self._sealed + 1 if self._point.sealed else 0
            certain = bool(self._sealed) and _opened(problem, self._point.contact) is None
            if certain or self._sealed == MOST_STAGES // 2 or not self._refine() or self._settled:
                break
            self._solve()
        point, contact = self._point, self._point.contact
        if contact.contact.any():
            contact = problem.contact_under(point.pressure, contact)
        return _Found(
            pressure=point.pressure,
            contact=contact,
            certain=certain,
            change=self._change,
            error=max(self._error, PART * self._allowed),
            failure=self._log.failure,
            residuals=tuple(self._log.residuals),
            network=point.stage.grid,
        )

    @property
    def difficult(self) -> bool:
        """Whether steps were halved, or GMRES took many iterations."""
        return self._log.shortened or self._log.iterations > MOST_STEPS / 2

    def _go_to(self, point: LiftPoint) -> None:
        """Begin a stage."""
        self._point = point
        self._log.add(point)

    def _solve(self) -> None:
        """Find a stable equilibrium of a stage, in contact or floating."""
        log, allowed = self._log, self._allowed
        if self.difficult or self._left:
            # What the next step changes to first order is then no measure of what it changes.
            allowed *= PART
        point = newton(self._point, allowed, log)
        if log.failure and point.problem.may_float and point.contact.contact.any():
            failure, floating = log.failure, newton(_floating(point), allowed, log)
            # A film that rises for ever carries less than the load: the solid is in contact.
            point, log.failure = (point, failure) if log.failure else (floating, "")
        if point.step.negative is not None and not self._left:
            left = _leaving(point)
            self._left = left is not None
            if left is None:
                log.failure = "plain passes do not come away from a state that does not last"
            else:
                point = newton(left, allowed, log)
        self._point, self._change = point, point.step.log_rate
        self._error = self._change + point.by_epsilon + self._differs

    def _refine(self) -> bool:
        """Go to the first point of the next stage, if there is one; estimate its error."""
        point, log, before = self._point, self._log, self._differs
        adjoint, finer = point.adjoint, point.finer(self._allowed)
        if not point.linear_systems_solved:
            log.failure = log.failure or (
                f"{MOST_STEPS} iterations of GMRES have left more than {PART:g} of a right side"
            )
        if finer is None:
            return False
        if not log.failure:
            point = point.after(point.step) or point
        self._go_to(replace(point, stage=finer))
        self._change = self._differs = self._point.error(adjoint)
        to_come = self._differs * _all_to_come(self._differs, before)
        self._error = to_come + self._point.by_epsilon
        return True

    @property
    def _settled(self) -> bool:
        """Whether what is to come changes ln Q by little."""
        little = self._error <= self._allowed and self._point.keeps_load(self._allowed)
        return little and not self._sealed and not self._log.failure


def _all_to_come(change: float, before: float) -> float:
    """1 + r + r² + …, with the ratio r of this stage's change to the last one's; 1/2 if unknown."""
    return 1 / (1 - min(change / before, 1 - PART)) if 0 < before < inf else 2.0


def _floating(point: LiftPoint) -> LiftPoint:
    """The point at which the solid has just left the counter-face."""
    problem, height = point.problem, point.problem.height.values
    level = float((height - problem.displacement(point.pressure)).max()) + point.stage.epsilon
    return present(FloatingPoint.at(problem, point.stage, point.pressure, level), "level")


def _leaving(point: LiftPoint) -> LiftPoint | None:
    """The point to which plain passes lead from an equilibrium that they leave.

    Where R' G' has a real eigenvalue above 1, a pass through contact and flow grows every deviation
    along its eigenvector: no such state lasts. None if F still grows after many passes.
    """
    away = present(point.step.negative, "direction")
    away = away * (PART * point.problem.drop / np.abs(away).max())
    step = replace(point.step, pressure=away if away.mean() >= 0 else -away, gap=None)
    for _ in range(2 * MOST_STEPS):  # an eigenvalue of 1.1 takes 24 from a tenth to all of the drop
        other = point.after(step)
        if other is None or other.size <= point.size:
            return point
        point, step = other, replace(step, pressure=other.residual)
    return None


def _opened(problem: LiftProblem, contact: ContactState) -> GridFilm | None:
    """The film that the most fluid pressure opens; None if it stays sealed."""
    pressure = _most(problem, contact)
    if problem.left_of(pressure) <= 0:
        return problem.film(problem.touching_gap)
    film = problem.film(problem.contact_under(pressure, contact, ROUGH).gap)
    return None if film.sealed else film


def _most(problem: LiftProblem, contact: ContactState) -> np.ndarray:
    """The inlet's pressure wherever no open path leads to the outlet.

    On a half-space a higher p_f nowhere makes the gap smaller, so that no p_f opens a film that is
    sealed under this one.
    """
    nx, ny = problem.height.shape
    joined = problem.film(contact.gap).joined_to("outlet")[:nx, :ny]
    return np.where(joined, problem.outlet, problem.inlet)


def _state_of(problem: LiftProblem, rtol: float, found: _Found) -> LiftedState:
    """The state at the end of the steps, with its leak rate to the tolerance of the result."""
    leak = problem.flow(problem.film(found.contact.gap), min(found.error, most_claimed(rtol)))
    error, reason, steps = found.error, "", len(found.residuals) - 1
    known = leak.state == "sealed" or (leak.value > 0 and error <= MOST_ERROR)
    lowest = leak.value * exp(-error)
    highest = leak.value * exp(min(error, MOST_ERROR)) if known else inf
    if leak.state == "sealed":
        opened = None
        if not found.certain:
            opened = parallel.on_root(lambda: _opened(problem, found.contact), problem.comm)
        if opened is not None:
            highest = inf
            if problem.left_of(_most(problem, found.contact)) > 0:
                most = problem.flow(opened, 0.0)
                highest = most.value if most.upper is None else most.upper
            reason = (
                f"the film is sealed after {steps} of Newton's steps, but more fluid pressure "
                "under the contact would open it"
            )
        error = 0.0
    elif found.failure:
        reason = f"contact and flow have not settled: {found.failure}"
    elif not known:
        reason = leak.reason or "the error of the fluid's pressure is not known"
    elif error > SETTLED * rtol:
        reason = (
            f"the fluid's pressure leaves an error of {error:.2g} in the logarithm of the leak "
            f"rate, more than the {SETTLED * rtol:.2g} that flow.rtol allows"
        )
    if reason:
        low = "0 (sealed)" if leak.state == "sealed" else f"{lowest:.3g}"
        high = f"{highest:.3g} m^3/s" if highest < inf else "that of a film lifted off"
        rates = f"the leak rate is between {low} and {high}" if known else "it may be any leak rate"
        reason += f": {rates}; {FINER}"
    return LiftedState(
        state=leak.state,
        contact=found.contact,
        fluid_pressure=problem.field(found.pressure),
        leak_rate=leak,
        steps=steps,
        change=0.0 if leak.state == "sealed" else found.change,
        claimed=error,
        converged=not reason,
        lowest=lowest,
        highest=highest,
        residuals=found.residuals,
        network=found.network,
        reason=reason,
    )


def _both(first: LiftedState, second: LiftedState) -> LiftedState:
    """The second of two states, or the first alone if only that has settled."""
    leaks = [present(state.leak_rate, "leak rate") for state in (first, second)]
    apart = spread(*(leak.value for leak in leaks))
    widths = [spread(*leak.bounds) for leak in leaks if leak.lower]
    shown = first if first.converged and not second.converged else second
    both = replace(shown, steps=first.steps + second.steps)
    if apart <= first.claimed + second.claimed + max(widths, default=0.0):
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
        claimed=0.0,
        converged=True,
        lowest=inf,
        highest=inf,
    )
