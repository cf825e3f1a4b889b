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

Passes share a mesh, since all that a pass needs is p_f. The first flow on a mesh is solved with its
bounds, the next ones for the pressure alone, until ln Q changes by less than those bounds allow.
Then a finer mesh follows, down to the tolerance of the result. The leak rates of two films on one
mesh are compared much more exactly than their bounds are known.

Samples that close or open change p_f around them by a finite amount, so p_f itself need not
converge. The leak rate Q decides: the passes have settled when ln Q has changed by less than a
tolerance over three passes on the last mesh, the last of them plain (an accelerated pass with a
small step changes little, settled or not). The change that remains estimates the error of the
iteration; it is no bound.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
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
# The start on fewer samples ends when ln Q changes by less than this, or after so many passes.
COARSE_CHANGE, COARSE_PASSES = 0.1, 8
# The first 12 accelerated passes take the whole step, the next 12 half of it, all others a quarter.
PASSES_OF_ONE_STEP, LEAST_STEP = 12, 0.25
# Tolerance of the first mesh: on fewer samples, on all, and on all after a start on fewer.
VERY_LOOSE, LOOSE, AFTER_COARSE = 0.6, 0.3, 0.05
# A mesh is left when ln Q changes by less than this part of its tolerance; that of the next one is
# this much smaller.
ENOUGH, NEXT = 1 / 3, 1 / 6
# A mesh is no longer fit if ln Q has changed by this much since it was made, or after so many
# passes that have not settled.
FAR, PASSES_OF_ONE_MESH = 0.7, 10
# Above this change of ln Q the last contact is no good start for the next.
COLD = 0.5
# Certificate of the contacts while ln Q changes by more than ROUGH, where it errs by about 3 %, and
# then, as a part of rtol. Near closing 1e-3 kept passes from settling.
ROUGH, ROUGHEST_CONTACT, ROUGH_CONTACT = 0.1, 1e-2, 2e-4
# Where nothing leaks, ln Q tells nothing: passes have settled if they change p_f by less than this
# part of the pressure drop (rms), or if nothing has leaked in so many of them.
STILL, SEALED_PASSES = 1e-3, 15
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
        (heights, load left to the solid [Pa] or None, start, tolerance) -> ContactState. The load
        is None where an area or a mean gap is held, which the fluid does not change; the tolerance
        counts where it is above that of the result.
    film : callable
        gap -> GridFilm
    flow : callable
        (film, tolerance, whether from a new mesh) -> LeakRate with its field. Without a new mesh
        it begins with that of the last film. The tolerance None stands for that of the result.
    again : callable or None
        film -> LeakRate with its field, by the pressure alone on the mesh of the last flow. None
        for a flow without a mesh, which is the same at every tolerance.
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
    press: Callable[
        [GridField, float | None, ContactState | np.ndarray | None, float], ContactState
    ]
    film: Callable[[GridField], GridFilm]
    flow: Callable[[GridFilm, float | None, bool], LeakRate]
    again: Callable[[GridFilm], LeakRate] | None
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
    rtol : float
        Tolerance of the flow.
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

        It is what may change from pass to pass unnoticed, and half the width of the flow's bounds:
        the pressure that lifts the solid is only as exact as the flow. Equilibria from different
        meshes differed by about that half-width, and those of a flow without bounds, whose samples
        open and close, by half of rtol.
        """
        leak = self.leak_rate
        if leak is None or leak.state == "sealed":
            half = 0.0
        else:
            half = (self.rtol if leak.lower is None else relative_part(leak)) / 2
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
        start = None if coarse is None else _coarse_start(coarse, report)
        if start is not None:
            passes = _Passes(problem, rtol, start, None, tolerance=max(rtol, AFTER_COARSE))
        else:
            passes = _Passes(problem, rtol, low, dry, known=True)
        return _settled(passes, most_passes, report)
    first = _settled(_Passes(problem, rtol, low, dry, known=True), most_passes, report)
    high = _carriable(problem, low, np.full_like(low, problem.inlet))
    top = _contact(problem, high, dry)
    if high.min() == problem.inlet and problem.film(top.gap).sealed and first.state == "sealed":
        # Sealed with the inlet's pressure everywhere: sealed at any pressure between the ends'.
        return first
    second = _settled(_Passes(problem, rtol, high, top, known=True), most_passes, report)
    return _both(first, second)


def lifted_from(
    problem: LiftProblem,
    rtol: float,
    pressure: np.ndarray,
    contact: ContactState | None = None,
    most_passes: int = MOST_PASSES,
    report: Report = silent,
) -> LiftedState:
    """Pass through contact and flow from a fluid pressure until the leak rate settles.

    Parameters
    ----------
    problem, rtol, most_passes, report : as of `lifted`
    pressure : (nx, ny) float
        Fluid pressure above ambient of the first pass [Pa]; its mean is below the load.
    contact : ContactState or None
        A contact to start from.

    Returns
    -------
    LiftedState
    """
    return _settled(_Passes(problem, rtol, pressure, contact), most_passes, report)


def _coarse_start(coarse: LiftProblem, report: Report) -> np.ndarray | None:
    """Fluid pressure (nx, ny) [Pa] of a roughly settled state on every second sample.

    None unless that state leaks. The solid keeps a load on the finer grid as well: the mean of the
    fluid pressure is the same there.
    """
    low = np.full(coarse.height.shape, coarse.outlet)
    falling = np.linspace(coarse.inlet, coarse.outlet, len(low))[:, None]
    start = _carriable(coarse, low, np.broadcast_to(falling, low.shape))
    passes = _Passes(coarse, VERY_LOOSE, start, None, tolerance=VERY_LOOSE)
    for _ in range(COARSE_PASSES):
        last = passes.advance(report)
        if passes.change < COARSE_CHANGE:
            break
    if last.leak.state == "sealed":
        return None
    return _on_finer(passes.next_pressure(), coarse.outlet)


def _on_finer(values: np.ndarray, beyond: float) -> np.ndarray:
    """Values on twice as many samples along each axis, linear between them.

    Parameters
    ----------
    values : (nx, ny) float
    beyond : float
        Value in the row that would follow the last.
    """
    nx, ny = values.shape
    after = np.vstack([values[1:], np.full((1, ny), beyond)])
    rows = np.stack([values, (values + after) / 2], axis=1).reshape(2 * nx, ny)
    after = np.hstack([rows[:, 1:], rows[:, -1:]])
    return np.stack([rows, (rows + after) / 2], axis=2).reshape(2 * nx, 2 * ny)


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
    lower, upper = leak.refined_bounds
    return log(upper / lower)


@dataclass(frozen=True, eq=False)
class _Pass:
    """One pass: the contact under a fluid pressure, its film, and the flow through it.

    `pressure` is the p_f under which the contact was solved [Pa], `tolerance` that of the mesh.
    `plain` says whether p_f was that of the flow of the pass before.
    """

    pressure: np.ndarray
    contact: ContactState
    film: GridFilm
    leak: LeakRate
    tolerance: float
    plain: bool


@dataclass(eq=False)
class _Passes:
    """A series of passes from a fluid pressure and a contact.

    Attributes
    ----------
    problem : LiftProblem
    rtol : float
        Tolerance of the flow of the result.
    pressure : (nx, ny) float
        p_f of the next pass [Pa].
    contact : ContactState, array or None
        To start the next contact from.
    known : bool
        Whether it is the contact under `pressure`, which the first pass then need not solve.
    tolerance : float
        Tolerance of the next mesh.
    count : int
        Passes so far.
    rates : list of float
        Leak rates on the present mesh; they are comparable with each other only.
    change : float
        Last change of ln Q from pass to pass on one mesh.
    values : list of float
        Leak rates of all passes [m³/s].
    """

    problem: LiftProblem
    rtol: float
    pressure: np.ndarray
    contact: ContactState | np.ndarray | None
    known: bool = False
    tolerance: float = LOOSE
    count: int = 0
    rates: list[float] = field(default_factory=list)
    change: float = inf
    values: list[float] = field(default_factory=list)
    _mesh: float = inf
    _made: LeakRate | None = None
    _plain: bool = False
    _mixture: "_Mixture" = field(default_factory=lambda: _Mixture())
    _response: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def spread(self) -> float:
        """Spread of ln Q over the last three passes on one mesh; infinite if there are fewer."""
        return _spread(self.rates[-3:]) if len(self.rates) >= 3 else inf

    @property
    def response(self) -> np.ndarray:
        """p_f of the last flow [Pa]."""
        return self._response

    @property
    def stays_sealed(self) -> bool:
        """Whether p_f has settled in a film that does not leak."""
        drop = self.problem.inlet - self.problem.outlet
        change = float(np.sqrt(np.mean((self._response - self.pressure) ** 2)))
        last = self.values[-SEALED_PASSES:]
        return change < STILL * drop or (len(last) == SEALED_PASSES and max(last) == 0)

    def advance(self, report: Report) -> _Pass:
        """Solve one more contact and flow."""
        if self.count:
            self.pressure = self.next_pressure()
        self.count += 1
        problem = self.problem
        fresh = self._mesh > self.tolerance or len(self.rates) >= PASSES_OF_ONE_MESH
        if self.known and self.count == 1 and isinstance(self.contact, ContactState):
            contact = self.contact
        else:
            moved = _spread(self.values[-2:]) if self.count > 2 else inf
            start = self.contact if self.count <= 2 or moved < COLD else None
            tolerance = ROUGH_CONTACT * self.rtol if moved < ROUGH else ROUGHEST_CONTACT
            contact = _contact(problem, self.pressure, start, tolerance)
        film = problem.film(contact.gap)
        leak = self._flow(film, fresh)
        self._response = _response(problem, film, leak)
        self._mixture.add(self.pressure, self._response)
        self.contact = contact
        self.values.append(self._value)
        report("lift", f"pass {self.count}, leak rate {self._value:.3g} m^3/s")
        this = _Pass(self.pressure, contact, film, leak, self._mesh, self._plain)
        if len(self.rates) > 1:
            self.change = _spread(self.rates[-2:])
        if self.change < ENOUGH * self._mesh and self._mesh < inf:
            self.tolerance = max(self.rtol, NEXT * self._mesh)
        self._plain = self.change < SETTLED * self.rtol
        return this

    def _flow(self, film: GridFilm, fresh: bool) -> LeakRate:
        """Flow on the present mesh, or on a new one."""
        problem, leak = self.problem, None
        if film.sealed:
            leak = problem.flow(film, self.tolerance, False)
        elif problem.again is not None and not fresh and _spread(self.values[-2:]) < FAR:
            leak = problem.again(film)
            if _spread([leak.inflow, *self.rates[:1]]) > FAR:
                leak = None
        if leak is None:
            # Begin with the last mesh where a finer one of a similar film is wanted.
            new = not fresh or self._mesh <= self.tolerance or self._mesh == inf
            leak = problem.flow(film, self.tolerance, new)
            self._mesh, self._made = self.tolerance, leak
            if problem.again is not None:
                # Rates and residuals of another mesh are not comparable.
                self.rates, self._mixture = [], _Mixture()
        self.rates.append(leak.inflow)
        return leak

    def next_pressure(self) -> np.ndarray:
        """p_f of the next pass [Pa]."""
        problem = self.problem
        step = max(0.5 ** (self.count // PASSES_OF_ONE_STEP), LEAST_STEP)
        target = self._response
        if not self._plain:
            target = np.clip(self._mixture.step(step), problem.outlet, problem.inlet)
        return _carriable(problem, self.pressure, target)

    @property
    def _value(self) -> float:
        """Leak rate of the last pass [m³/s], from the change since the mesh was made."""
        made = self._made
        return made.value * self.rates[-1] / made.inflow if made and self.rates[-1] else 0.0

    def go_on_from(self, leak: LeakRate) -> None:
        """Go on with the mesh of a flow to the tolerance of the result."""
        self._mesh = inf if leak.state == "sealed" else self.rtol
        self._made, self.rates, self._mixture = leak, [], _Mixture()


def _settled(passes: _Passes, most_passes: int, report: Report) -> LiftedState:
    """Pass through contact and flow until the leak rate settles."""
    problem, rtol = passes.problem, passes.rtol
    while True:
        this = passes.advance(report)
        load = problem.load
        carries = load is not None and _left(load, passes.response) <= 0
        exact = this.tolerance <= rtol if passes.rates[-1] > 0 else passes.stays_sealed
        if exact and this.plain and not carries and passes.spread < SETTLED * rtol:
            state = _finished(passes, this, passes.rates[-3:], True)
            if state is not None:
                return state
        if passes.count >= most_passes:
            seen = passes.values[passes.count // 2 :]
            return present(_finished(passes, this, seen, False), "state")
        # The solid carried hardly any load in this pass, and the fluid again carries all of it.
        if carries and load is not None and _left(load, this.pressure) < LEAST_LEFT * load:
            return _lifted_off(problem, passes.response, passes.count)


def _contact(
    problem: LiftProblem,
    pressure: np.ndarray,
    start: ContactState | np.ndarray | None,
    tolerance: float = 0.0,
) -> ContactState:
    """Contact with a fluid pressure: a dry one with heights h - S p_f."""
    height = problem.height
    load = None if problem.load is None else problem.load - float(pressure.mean())
    lowered = height.values - problem.displacement(pressure)
    heights = GridField(lowered, height.spacing, height.periodic)
    return problem.press(heights, load, start, tolerance)


def _response(problem: LiftProblem, film: GridFilm, leak: LeakRate) -> np.ndarray:
    """p_f (nx, ny) of the flow through a film [Pa]."""

    def read() -> np.ndarray:
        carried = None if leak.state == "sealed" else problem.carried(film, leak)
        return pressure_on_samples(film, problem.inlet, problem.outlet, carried)

    return parallel.on_root(read, problem.comm)


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
    low, high = min(rates, default=0.0), max(rates, default=0.0)
    if low == high:
        return 0.0
    return log(high / low) if low > 0 else inf


class _Mixture:
    """Anderson's acceleration: a mixture of the last passes, chosen for the least residual.

    The arrays are kept in single precision, to save memory; single samples flip by more.
    """

    def __init__(self) -> None:
        self._pressures: list[np.ndarray] = []
        self._residuals: list[np.ndarray] = []

    def add(self, pressure: np.ndarray, response: np.ndarray) -> None:
        """Add a pass: the p_f of its contact and that of its flow [Pa]."""
        self._pressures = [*self._pressures[-DEPTH:], pressure.astype(np.float32)]
        self._residuals = [*self._residuals[-DEPTH:], (response - pressure).astype(np.float32)]

    def step(self, part: float) -> np.ndarray:
        """Mixture of the pressures, and this part of a step along that of the residuals."""
        pressure, residual = self._pressures[-1], self._residuals[-1]
        differences = [residual - other for other in self._residuals[:-1]]
        if differences:
            gram = [[float(np.vdot(a, b)) for b in differences] for a in differences]
            sides = [float(np.vdot(a, residual)) for a in differences]
            weights = np.linalg.lstsq(np.array(gram), np.array(sides), rcond=None)[0]
            for weight, other, change in zip(
                weights, self._pressures[:-1], differences, strict=True
            ):
                pressure = pressure - np.float32(weight) * (self._pressures[-1] - other)
                residual = residual - np.float32(weight) * change
        return (pressure + np.float32(part) * residual).astype(float)


def _finished(passes: _Passes, last: _Pass, seen: list[float], settled: bool) -> LiftedState | None:
    """State of a pass, with contact and flow as exact as the result is to have them.

    None if that flow contradicts the flows on the last mesh; another mesh is needed then.
    """
    problem, rtol = passes.problem, passes.rtol
    contact = _contact(problem, last.pressure, last.contact)
    film = problem.film(contact.gap)
    leak = problem.flow(film, None, False)
    if settled and _spread([leak.value, passes.values[-1]]) > rtol:
        passes.go_on_from(leak)
        return None
    return LiftedState(
        state=leak.state,
        contact=contact,
        fluid_pressure=_field(problem, last.pressure),
        leak_rate=leak,
        passes=passes.count,
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
