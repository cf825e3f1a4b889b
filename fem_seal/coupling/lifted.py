"""The contact that the pressure of the leaking fluid lifts, and the flow through it.

With the compliance S of the solid, heights h of the counter-face, fluid pressure p_f and contact
pressure p_c:

    gap             g = S (p_c + p_f) - h + const >= 0,    p_c >= 0,    p_c g = 0
    flow            ∇·(g³/(12 η) ∇p_f) = 0
    load            mean(p_c + p_f) = P₀

With p_f fixed, the first line is a dry contact with the heights h - S p_f under the load
P₀ - mean(p_f). With g fixed, the second line is the flow through a film. One *pass* solves the
contact, then the flow, and turns one p_f into the next. At an equilibrium a pass changes nothing.
Plain passes, which begin with the p_f of the last flow, may cycle. Anderson's acceleration of depth
two (J. ACM 12, 547 (1965)) therefore mixes the p_f of the last passes, and takes smaller steps as
the number of passes grows.

Samples that close or open change p_f around them by a finite amount, so p_f itself need not
converge. The leak rate Q decides: the passes have settled when ln Q has changed by less than a
tolerance over three passes, the last of them plain (an accelerated pass with a small step changes
little, settled or not). The change that remains estimates the error of the iteration; it is no
bound.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, log

import numpy as np

from fem_seal import parallel
from fem_seal.contact.state import ContactState
from fem_seal.coupling.fluid_pressure import pressure_on_samples
from fem_seal.errors import present
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.progress import Report, silent

DEPTH = 2  # of Anderson's acceleration; depth four is no better
MOST_PASSES = 40
# Tolerance of ln Q and largest number of passes for the start on every second sample.
COARSE_RTOL, COARSE_PASSES = 1.0, 6
# The first 12 accelerated passes take the whole step, the next 12 half of it, all others a quarter.
PASSES_OF_ONE_STEP, LEAST_STEP = 12, 0.25
# Tolerance of the flow in a pass: this part of the last change of ln Q, and COARSE at most.
COARSE, OF_CHANGE = 0.3, 0.25
SETTLED = 1 / 5  # passes have settled if ln Q changes by less than this part of the flow's rtol
# The solids separate if the fluid carries the whole load although the contact was solved with
# hardly any load on the solid: with less than this part of it.
LEAST_LEFT = 1e-3
LEFT_PER_PASS = 0.1  # least part of the solid's load in one pass that remains in the next


@dataclass(frozen=True, eq=False)
class LiftProblem:
    """The steps of one pass, each as a function.

    Attributes
    ----------
    height : GridField
        Counter-face h [m].
    displacement : callable
        (nx, ny) pressure [Pa] -> displacement S p [m], up to a constant.
    press : callable
        (heights, load left to the solid [Pa] or None, start) -> ContactState. None where the load
        is a held area or mean gap, which the fluid does not change.
    film : callable
        gap -> GridFilm
    flow : callable
        (film, tolerance) -> LeakRate with its field. None stands for the tolerance of the result.
    carried : callable
        (film, leak rate) -> pressure above ambient [Pa] on the film's samples, NaN where the flow
        has none (contact, pockets).
    inlet, outlet : float
        Fluid pressures above ambient [Pa], the higher one at the inlet.
    load : float or None
        P₀ [Pa], which solid and fluid carry together; None for a held area or mean gap.
    comm : MPI.Comm or None
        The processes that solve together; all of this run if None.
    decides : bool
        Whether the result's flow stops when a limit is decided, not at `rtol`.
    """

    height: GridField
    displacement: Callable[[np.ndarray], np.ndarray]
    press: Callable[[GridField, float | None, ContactState | None], ContactState]
    film: Callable[[GridField], GridFilm]
    flow: Callable[[GridFilm, float | None], LeakRate]
    carried: Callable[[GridFilm, LeakRate], np.ndarray]
    inlet: float
    outlet: float
    load: float | None
    comm: parallel.Comm = None
    decides: bool = False


@dataclass(frozen=True, eq=False)
class LiftedState:
    """Contact and flow in one equilibrium.

    Attributes
    ----------
    state : "leaking", "sealed" or "lifted off"
        Lifted off: the fluid carries the whole load, and no equilibrium keeps the solids together.
    contact : ContactState or None
        Its pressure is the excess p_c over the fluid's; None if lifted off.
    fluid_pressure : GridField
        p_f on the contact's samples [Pa], above ambient.
    leak_rate : LeakRate or None
        Through the contact's gap, to the tolerance of the result; None if lifted off.
    passes : int
        Contacts and flows solved.
    change : float
        Spread of ln Q over the last three passes or, if they have not settled, over the range.
    converged : bool
        Whether the passes have settled.
    lowest, highest : float
        Least and largest leak rate [m³/s]: of the last three passes if they have settled, else of
        the second half of all, and from both starts where there were two.
    """

    state: str
    contact: ContactState | None
    fluid_pressure: GridField
    leak_rate: LeakRate | None
    passes: int
    change: float
    converged: bool
    lowest: float
    highest: float
    rtol: float = 0.0

    @property
    def claimed(self) -> float:
        """Error of ln Q of a settled state, estimated.

        It is what may change without notice from pass to pass, and half the width of the flow's
        bounds: the fluid pressure, too, is only as exact as the flow.
        """
        half = relative_part(self.leak_rate) / 2 if self.leak_rate is not None else 0.0
        return max(self.change, SETTLED * self.rtol) + half

    @property
    def fluid_load(self) -> float:
        """Mean of p_f: the part of the load that the fluid carries [Pa]."""
        return float(self.fluid_pressure.values.mean())

    @property
    def reason(self) -> str:
        """Sentence that says why the state is not an equilibrium; empty if it has settled."""
        if self.converged:
            return ""
        seen = self.lowest, self.highest
        low, high = (f"{rate:.3g}" if rate else "0 (sealed)" for rate in seen)
        return (
            f"contact and flow have not settled after {self.passes} passes: the leak rate varies "
            f"from {low} to {high} m^3/s"
        )


@dataclass(frozen=True, eq=False)
class _Pass:
    """One pass: the contact under a fluid pressure, its film, and the flow through it.

    `pressure` is the p_f under which the contact was solved, `response` the p_f of the flow through
    its film, both (nx, ny) [Pa]; `tolerance` is that of the flow.
    """

    pressure: np.ndarray
    contact: ContactState
    film: GridFilm
    leak: LeakRate
    tolerance: float
    response: np.ndarray

    @property
    def residual(self) -> np.ndarray:
        """Change of p_f in this pass [Pa]; 0 at an equilibrium."""
        return self.response - self.pressure


def lifted(
    problem: LiftProblem,
    rtol: float,
    *,
    dry: ContactState | None = None,
    coarse: LiftProblem | None = None,
    most_passes: int = MOST_PASSES,
    report: Report = silent,
) -> LiftedState:
    """Solve contact and flow together.

    The passes begin with the outlet's pressure everywhere, or with the fluid pressure of a few
    passes on every second sample. If the film is sealed under the outlet's pressure, there may be a
    sealed and a leaking equilibrium. Then a second series of passes begins with the inlet's
    pressure, and its state is returned; it has settled only if both series agree.

    Parameters
    ----------
    problem : LiftProblem
    rtol : float
        Tolerance of the last flow; a fifth of it is allowed to the change of ln Q.
    dry : ContactState, optional
        Contact under the outlet's pressure everywhere, if it is known.
    coarse : LiftProblem, optional
        The problem on every second sample, for a start that saves passes.
    most_passes : int
        Largest number of passes; then a state that has not settled is returned with `converged`
        False.
    report : callable
        Called with each pass.

    Returns
    -------
    LiftedState

    Raises
    ------
    NotConverged
        If a contact or a flow fails.
    """
    low = np.full(problem.height.shape, problem.outlet)
    if problem.load is not None and problem.load <= problem.outlet:
        return _lifted_off(problem, low, 0)
    if dry is None:
        dry = _contact(problem, low, None)
    if not problem.film(dry.gap).sealed:
        start = None if coarse is None else _coarse_start(coarse, low, report)
        if start is not None:
            return lifted_from(problem, rtol, start, dry, most_passes, report)
        return lifted_from(problem, rtol, low, dry, most_passes, report, known=True)
    first = lifted_from(problem, rtol, low, dry, most_passes, report, known=True)
    high = _carriable(problem, low, np.full_like(low, problem.inlet))
    top = _contact(problem, high, dry)
    if high.min() == problem.inlet and problem.film(top.gap).sealed and first.state == "sealed":
        # Sealed with the inlet's pressure everywhere: sealed at any pressure between the ends'.
        return first
    return _both(first, lifted_from(problem, rtol, high, top, most_passes, report, known=True))


def _coarse_start(coarse: LiftProblem, low: np.ndarray, report: Report) -> np.ndarray | None:
    """Fluid pressure (nx, ny) [Pa] of a roughly settled state on every second sample.

    None unless that state leaks. The solid keeps a load on the finer grid as well: the mean of the
    fluid pressure is the same there.
    """
    state = lifted_from(coarse, COARSE_RTOL, low[::2, ::2], None, COARSE_PASSES, report)
    if state.state != "leaking":
        return None
    return state.fluid_pressure.values.repeat(2, axis=0).repeat(2, axis=1)


def _both(first: LiftedState, second: LiftedState) -> LiftedState:
    """Compare the states of two starts; the second is returned."""
    passes = first.passes + second.passes
    if "lifted off" in (first.state, second.state):
        agree = first.state == second.state
    else:
        one, other = present(first.leak_rate, "leak rate"), present(second.leak_rate, "leak rate")
        agree = (
            _spread([one.value, other.value]) <= relative_part(other) + first.change + second.change
        )
    if agree:
        return replace(second, passes=passes, converged=first.converged and second.converged)
    lowest, highest = min(first.lowest, second.lowest), max(first.highest, second.highest)
    return replace(
        second,
        passes=passes,
        converged=False,
        change=_spread([lowest, highest]),
        lowest=lowest,
        highest=highest,
    )


def relative_part(leak: LeakRate) -> float:
    """Width ln(upper/lower) of a bracket; 0 without bounds or if sealed."""
    if not leak.lower:
        return 0.0
    lower, upper = leak.bounds
    return log(upper / lower)


def lifted_from(
    problem: LiftProblem,
    rtol: float,
    pressure: np.ndarray,
    contact: ContactState | None,
    most_passes: int = MOST_PASSES,
    report: Report = silent,
    *,
    known: bool = False,
) -> LiftedState:
    """Pass through contact and flow from a fluid pressure until the leak rate settles.

    Parameters
    ----------
    problem, rtol, most_passes, report : as of `lifted`
    pressure : (nx, ny) float
        Fluid pressure above ambient of the first pass [Pa]; its mean is below the load.
    contact : ContactState or None
        A contact to start from.
    known : bool
        Whether `contact` is the contact under `pressure`, which the first pass then need not solve.

    Returns
    -------
    LiftedState
    """
    passes: list[_Pass] = []
    rates: list[float] = []
    change, plain = inf, False
    while True:
        if contact is None or not known or passes:
            contact = _contact(problem, pressure, contact)
        this = _one_pass(problem, pressure, contact, min(max(OF_CHANGE * change, rtol), COARSE))
        passes = [*passes[-DEPTH:], this]
        rates.append(this.leak.value)
        change = _spread(rates[-2:]) if len(rates) > 1 else inf
        report("lift", f"pass {len(rates)}, leak rate {this.leak.value:.3g} m^3/s")
        load = problem.load
        carries = load is not None and _left(load, this.response) <= 0
        if plain and not carries and _spread(rates[-3:]) < SETTLED * rtol:
            return _finished(problem, this, rates, rtol, rates[-3:], True)
        if len(rates) >= most_passes:
            return _finished(problem, this, rates, rtol, rates[len(rates) // 2 :], False)
        # The solid carried hardly any load in this pass, and the fluid again carries all of it.
        if carries and load is not None and _left(load, this.pressure) < LEAST_LEFT * load:
            return _lifted_off(problem, this.response, len(rates))
        plain = change < SETTLED * rtol
        step = max(0.5 ** (len(rates) // PASSES_OF_ONE_STEP), LEAST_STEP)
        target = this.response if plain else _accelerated(passes, problem, step)
        pressure = _carriable(problem, this.pressure, target)


def _contact(
    problem: LiftProblem, pressure: np.ndarray, start: ContactState | None
) -> ContactState:
    """Contact with a fluid pressure: a dry one with heights h - S p_f."""
    height = problem.height
    load = None if problem.load is None else problem.load - float(pressure.mean())
    lowered = height.values - problem.displacement(pressure)
    return problem.press(GridField(lowered, height.spacing, height.periodic), load, start)


def _one_pass(
    problem: LiftProblem, pressure: np.ndarray, contact: ContactState, tolerance: float
) -> _Pass:
    film = problem.film(contact.gap)
    leak = problem.flow(film, tolerance)

    def read() -> np.ndarray:
        carried = None if leak.state == "sealed" else problem.carried(film, leak)
        return pressure_on_samples(film, problem.inlet, problem.outlet, carried)

    return _Pass(pressure, contact, film, leak, tolerance, parallel.on_root(read, problem.comm))


def _left(load: float, pressure: np.ndarray) -> float:
    """Part of a load that a fluid pressure leaves to the solid [Pa]."""
    return load - float(pressure.mean())


def _carriable(problem: LiftProblem, pressure: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Target fluid pressure; shortened towards the present one if the solid would lose its load."""
    if problem.load is None:
        return target
    before, after = _left(problem.load, pressure), _left(problem.load, target)
    least = LEFT_PER_PASS * before
    if after >= least:
        return target
    return pressure + (before - least) / (before - after) * (target - pressure)


def _spread(rates: list[float]) -> float:
    """Spread of ln Q; 0 if all are sealed, infinite if only some are."""
    low, high = min(rates), max(rates)
    if low == high:
        return 0.0
    return log(high / low) if low > 0 else inf


def _accelerated(passes: list[_Pass], problem: LiftProblem, step: float) -> np.ndarray:
    """Next fluid pressure: the mixture of the last passes with the least residual, plus a step."""
    last = passes[-1]
    pressure, residual = last.pressure, last.residual
    if len(passes) > 1:
        residuals = np.stack([(residual - p.residual).ravel() for p in passes[:-1]], axis=1)
        weights = np.linalg.lstsq(residuals, residual.ravel(), rcond=None)[0]
        for weight, before in zip(weights, passes[:-1], strict=True):
            pressure = pressure - weight * (last.pressure - before.pressure)
            residual = residual - weight * (last.residual - before.residual)
    return np.clip(pressure + step * residual, problem.outlet, problem.inlet)


def _finished(
    problem: LiftProblem,
    last: _Pass,
    rates: list[float],
    rtol: float,
    seen: list[float],
    settled: bool,
) -> LiftedState:
    """State of the last pass, with its flow solved to the tolerance of the result."""
    exact = last.tolerance <= rtol and last.leak.converged and not problem.decides
    leak = last.leak if exact else problem.flow(last.film, None)
    return LiftedState(
        state=leak.state,
        contact=last.contact,
        fluid_pressure=_field(problem, last.pressure),
        leak_rate=leak,
        passes=len(rates),
        change=_spread(seen),
        converged=settled,
        lowest=min(seen),
        highest=max(seen),
        rtol=rtol,
    )


def _lifted_off(problem: LiftProblem, pressure: np.ndarray, passes: int) -> LiftedState:
    return LiftedState(
        state="lifted off",
        contact=None,
        fluid_pressure=_field(problem, pressure),
        leak_rate=None,
        passes=passes,
        change=0.0,
        converged=True,
        lowest=inf,
        highest=inf,
    )


def _field(problem: LiftProblem, pressure: np.ndarray) -> GridField:
    return GridField(pressure, problem.height.spacing, problem.height.periodic)
