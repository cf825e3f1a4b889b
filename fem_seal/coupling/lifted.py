"""The contact that the pressure of the leaking fluid lifts, and the flow through it.

With the compliance S of the solid, heights h of the counter-face, fluid pressure p_f and contact
pressure p_c:

    gap             g = S (p_c + p_f) - h + const >= 0,    p_c >= 0,    p_c g = 0
    flow            ∇·(g³/(12 η) ∇p_f) = 0
    load            mean(p_c + p_f) = P₀

A given p_f makes the first line a dry contact with the heights h - S p_f under the load
P₀ - mean(p_f); a given g makes the second line the flow through a film. A state is lifted if the
p_f of its flow is the p_f of its contact: the fixed point of one *pass* through contact and flow.
It is found by Anderson's acceleration (J. ACM 12, 547 (1965)) of depth two, since plain passes may
cycle. A fixed point is settled when one more pass changes the leak rate by little: that change is
an estimate of what the iteration leaves open, and no bound.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import log

import numpy as np

from fem_seal.contact.state import ContactState
from fem_seal.coupling.fluid_pressure import pressure_on_samples
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.progress import Report, silent

DEPTH = 2  # of Anderson's acceleration; depth four is no better
MOST_PASSES = 40
# Tolerances of the flow on the way: coarse until the leak rate changes by less than `NEAR`.
COARSE, FINE, NEAR = 0.3, 0.1, 0.1
SETTLED = 1 / 5  # change of ln Q over the tolerance of the flow, below which a pass has settled


@dataclass(frozen=True, eq=False)
class Problem:
    """What contact and flow are of, each as a function.

    Attributes
    ----------
    height : GridField
        Counter-face h [m].
    displacement : callable
        (nx, ny) pressure [Pa] -> displacement S p [m], up to a constant.
    press : callable
        (heights, load left to the solid [Pa] or None, start) -> ContactState. None where the load
        of the scene is an area or a mean gap, which the fluid does not change.
    film : callable
        gap -> GridFilm
    flow : callable
        (film, rtol) -> LeakRate with its field, pressures above ambient [Pa]
    inlet, outlet : float
        Fluid pressures above ambient [Pa].
    load : float or None
        P₀ [Pa], what solid and fluid carry together; None for a held area or mean gap.
    """

    height: GridField
    displacement: Callable[[np.ndarray], np.ndarray]
    press: Callable[[GridField, float | None, ContactState | None], ContactState]
    film: Callable[[GridField], GridFilm]
    flow: Callable[[GridFilm, float], LeakRate]
    inlet: float
    outlet: float
    load: float | None


@dataclass(frozen=True, eq=False)
class LiftedState:
    """Contact and flow in one equilibrium.

    Attributes
    ----------
    state : "leaking", "sealed" or "lifted off"
        Lifted off: the fluid carries the whole load, and no contact holds it.
    contact : ContactState or None
        Its pressure is the excess p_c over the fluid's; None if lifted off.
    fluid_pressure : GridField
        p_f on the contact's samples [Pa], above ambient.
    leak_rate : LeakRate or None
        Through the contact's gap, to the tolerance asked for; None if lifted off.
    passes : int
        Contacts and flows solved.
    change : float
        |Δ ln Q| of the last pass.
    converged : bool
        Whether the last pass changed the leak rate by less than a fifth of the tolerance.
    lowest, highest : float
        Least and largest leak rate of the second half of the passes [m³/s].
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


@dataclass(frozen=True, eq=False)
class _Pass:
    """One pass: the fluid pressure that it began with, and what came of it."""

    given: np.ndarray
    contact: ContactState
    film: GridFilm
    leak: LeakRate
    made: np.ndarray

    @property
    def residual(self) -> np.ndarray:
        """p_f of the flow less that of the contact [Pa]."""
        return self.made - self.given


def lifted(
    problem: Problem,
    rtol: float,
    *,
    start: float = 0.5,
    dry: ContactState | None = None,
    most_passes: int = MOST_PASSES,
    report: Report = silent,
) -> LiftedState:
    """Solve contact and flow together.

    Parameters
    ----------
    problem : Problem
    rtol : float
        Tolerance of the last flow; a fifth of it is allowed to the last pass.
    start : float
        Fluid pressure to begin with, everywhere: 0 the outlet's, 1 the inlet's.
    dry : ContactState, optional
        A contact to start from.
    most_passes : int
        Passes after which a state that has not settled is returned with `converged` False.
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
    shape = problem.height.shape
    pressure = np.full(shape, problem.outlet + start * (problem.inlet - problem.outlet))
    passes: list[_Pass] = []
    rates: list[float] = []
    contact, change, plain = dry, np.inf, False
    while len(rates) < most_passes:
        if _carried(problem, pressure):
            return _lifted_off(problem, pressure, rates)
        way = max(rtol, FINE if change < NEAR else COARSE)
        this = _one_pass(problem, pressure, contact, way)
        contact = this.contact
        rates.append(this.leak.value)
        change = _change(rates)
        report("lift", f"pass {len(rates)}, leak rate {this.leak.value:.3g} m^3/s")
        settled = change < SETTLED * rtol
        if settled and plain:
            return _finished(problem, this, rates, change, rtol, True)
        passes = [*passes[-DEPTH:], this]
        # What seems settled has to stand one plain pass.
        plain = settled
        pressure = this.made if plain else _accelerated(passes, problem)
    return _finished(problem, this, rates, change, rtol, False)


def _carried(problem: Problem, pressure: np.ndarray) -> bool:
    """Whether the fluid carries the whole load."""
    return problem.load is not None and float(pressure.mean()) >= problem.load


def _one_pass(
    problem: Problem, pressure: np.ndarray, start: ContactState | None, rtol: float
) -> _Pass:
    height = problem.height
    lowered = height.values - problem.displacement(pressure)
    load = None if problem.load is None else problem.load - float(pressure.mean())
    heights = GridField(lowered, height.spacing, height.periodic)
    contact = problem.press(heights, load, start)
    film = problem.film(contact.gap)
    leak = problem.flow(film, rtol)
    ends = problem.inlet, problem.outlet
    return _Pass(pressure, contact, film, leak, pressure_on_samples(film, *ends, leak.field))


def _change(rates: list[float]) -> float:
    """|Δ ln Q| of the last pass; 0 if it was sealed twice, infinite if it began or ceased to be."""
    if len(rates) < 2:
        return np.inf
    before, after = rates[-2:]
    if before == after:
        return 0.0
    return abs(log(after / before)) if before > 0 and after > 0 else np.inf


def _accelerated(passes: list[_Pass], problem: Problem) -> np.ndarray:
    """Next fluid pressure: of the mixtures of the last passes that with the least residual."""
    last = passes[-1]
    if len(passes) == 1:
        return last.made
    residuals = np.stack([(last.residual - p.residual).ravel() for p in passes[:-1]], axis=1)
    made = np.stack([(last.made - p.made).ravel() for p in passes[:-1]], axis=1)
    weights = np.linalg.lstsq(residuals, last.residual.ravel(), rcond=None)[0]
    mixed = last.made - (made @ weights).reshape(last.made.shape)
    low, high = sorted((problem.inlet, problem.outlet))
    return np.clip(mixed, low, high)


def _finished(
    problem: Problem, last: _Pass, rates: list[float], change: float, rtol: float, converged: bool
) -> LiftedState:
    """Solve the last flow to its tolerance."""
    leak = problem.flow(last.film, rtol)
    later = rates[len(rates) // 2 :]
    return LiftedState(
        state=leak.state,
        contact=last.contact,
        fluid_pressure=_field(problem, last.given),
        leak_rate=leak,
        passes=len(rates),
        change=change,
        converged=converged,
        lowest=min(later),
        highest=max(later),
    )


def _lifted_off(problem: Problem, pressure: np.ndarray, rates: list[float]) -> LiftedState:
    return LiftedState(
        state="lifted off",
        contact=None,
        fluid_pressure=_field(problem, pressure),
        leak_rate=None,
        passes=len(rates),
        change=np.inf,
        converged=True,
        lowest=max(rates, default=0.0),
        highest=np.inf,
    )


def _field(problem: Problem, pressure: np.ndarray) -> GridField:
    return GridField(pressure, problem.height.spacing, problem.height.periodic)
