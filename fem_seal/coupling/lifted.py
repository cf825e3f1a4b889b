"""The contact that the pressure of the leaking fluid lifts, and the flow through it.

With the compliance S of the solid, heights h of the counter-face, fluid pressure p_f and contact
pressure p_c:

    gap             g = S (p_c + p_f) - h + const >= 0,    p_c >= 0,    p_c g = 0
    flow            ∇·(g³/(12 η) ∇p_f) = 0
    load            mean(p_c + p_f) = P₀

With p_f fixed, the first line is a dry contact with the heights h - S p_f under the load
P₀ - mean(p_f). With g fixed, the second line is the flow through a film. One *pass* solves the
contact, then the flow, and turns one p_f into the next. At an equilibrium a pass changes nothing.
Plain passes, which begin with the p_f of the last flow, may cycle. Anderson's acceleration
therefore mixes the p_f of the last passes (`anderson`), and takes smaller steps as the number of
passes grows. The meshes of the flows get finer on the way (`passes`).

Samples that close or open change p_f around them by a finite amount, so p_f itself need not
converge. The leak rate Q decides: the passes have settled when ln Q has changed by less than a
tolerance over three passes on the last mesh, the last of them plain (an accelerated pass with a
small step changes little, settled or not). The change that remains estimates the error of the
iteration; it is no bound.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import inf

import numpy as np

from fem_seal.contact.state import ContactState
from fem_seal.coupling.passes import TUNING, Passes, PassTuning
from fem_seal.coupling.problem import LiftProblem, left_of
from fem_seal.coupling.state import LiftedState, relative_part, spread, width_of
from fem_seal.errors import present
from fem_seal.film import GridFilm
from fem_seal.progress import Report, silent


def lifted(
    problem: LiftProblem,
    rtol: float,
    *,
    dry: ContactState | None = None,
    coarse: LiftProblem | None = None,
    tuning: PassTuning = TUNING,
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
        Tolerance of the last flow. The passes have settled when ln Q changes by less than a fifth.
    dry : ContactState, optional
        Contact under the outlet's pressure everywhere, if it is known.
    coarse : LiftProblem, optional
        The problem on every second sample, for a start that saves passes.
    tuning : PassTuning
        Parameters of the passes. If they are given up, a state with `converged` False is returned.
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
        return _lifted_off(problem, low, [])
    if dry is None:
        dry = problem.contact_under(low)
    if not problem.film(dry.gap).sealed:
        start = None if coarse is None else _coarse_start(coarse, tuning, report)
        if start is None:
            passes = Passes(problem, rtol, low, dry, known=True, tuning=tuning)
        else:
            tolerance = max(rtol, tuning.tolerance_after_coarse)
            finer = replace(tuning, first_tolerance=tolerance)
            passes = Passes(problem, rtol, start, tuning=finer)
        return _settled(passes, report)
    first = _settled(Passes(problem, rtol, low, dry, known=True, tuning=tuning), report)
    if first.flipping and (problem.load is None or problem.load > problem.inlet):
        # A second start does not make this settled, and the fluid cannot carry the whole load.
        return first
    high = problem.carriable(low, np.full_like(low, problem.inlet), tuning.left_per_pass)
    top = problem.contact_under(high, dry)
    if high.min() == problem.inlet and problem.film(top.gap).sealed and first.state == "sealed":
        # Sealed with the inlet's pressure everywhere: sealed at any pressure between the ends'.
        return first
    second = _settled(Passes(problem, rtol, high, top, known=True, tuning=tuning), report)
    return _both(first, second)


def lifted_from(
    problem: LiftProblem,
    rtol: float,
    pressure: np.ndarray,
    contact: ContactState | None = None,
    tuning: PassTuning = TUNING,
    report: Report = silent,
) -> LiftedState:
    """Pass through contact and flow from a fluid pressure until the leak rate settles.

    Parameters
    ----------
    problem, rtol, tuning, report : as of `lifted`
    pressure : (nx, ny) float
        Fluid pressure above ambient of the first pass [Pa]; its mean is below the load.
    contact : ContactState or None
        A contact to start from.

    Returns
    -------
    LiftedState
    """
    return _settled(Passes(problem, rtol, pressure, contact, tuning=tuning), report)


def _settled(passes: Passes, report: Report) -> LiftedState:
    """Pass through contact and flow until the leak rate settles."""
    while True:
        contact = passes.solve_contact()
        passes.solve_flow(contact, report)
        if passes.settled:
            state = _finished(passes, contact, passes.rates[-3:], True)
            if state is not None:
                return state
        if passes.given_up:
            seen = passes.rates[passes.count // 2 :]
            return present(_finished(passes, contact, seen, False), "state")
        if passes.solids_separate:
            return _lifted_off(passes.problem, passes.response, passes.rates)
        passes.go_on()


def _coarse_start(coarse: LiftProblem, tuning: PassTuning, report: Report) -> np.ndarray | None:
    """Fluid pressure (nx, ny) [Pa] of a roughly settled state on every second sample.

    None unless that state leaks. The mean of this pressure on the finer grid is the same, so that
    the solid keeps a load there too.
    """
    low = np.full(coarse.height.shape, coarse.outlet)
    falling = np.linspace(coarse.inlet, coarse.outlet, len(low))[:, None]
    start = coarse.carriable(low, np.broadcast_to(falling, low.shape), tuning.left_per_pass)
    tolerance = tuning.coarse_tolerance
    passes = Passes(coarse, tolerance, start, tuning=replace(tuning, first_tolerance=tolerance))
    for _ in range(tuning.coarse_passes):
        contact = passes.solve_contact()
        leak = passes.solve_flow(contact, report)
        passes.go_on()
        if passes.change < tuning.coarse_change:
            break
    if leak.state == "sealed":
        return None
    return _on_finer(passes.pressure, coarse.outlet)


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
    """Compare the states of two starts.

    The second is returned, or the first if it leaks and has settled and the second has not.
    """
    passes, rates = first.passes + second.passes, first.rates + second.rates
    if "lifted off" in (first.state, second.state):
        agree = first.state == second.state
    else:
        one, other = present(first.leak_rate, "leak rate"), present(second.leak_rate, "leak rate")
        agree = (
            spread([one.value, other.value]) <= relative_part(other) + first.change + second.change
        )
    if agree and first.converged and second.converged:
        return replace(second, passes=passes, rates=rates)
    lowest, highest = min(first.lowest, second.lowest), max(first.highest, second.highest)
    contacts, flipping = [first.contact, second.contact], second.flipping
    two_states = first.converged and second.converged and None not in contacts
    if two_states:
        below, above = (present(contact, "contact").gap.values > 0 for contact in contacts)
        flipping = int(np.count_nonzero(below != above))
    shown = first if first.state == "leaking" and first.converged > second.converged else second
    return replace(
        shown,
        passes=passes,
        rates=rates,
        converged=False,
        change=spread([lowest, highest]),
        lowest=lowest,
        highest=highest,
        flipping=flipping,
        two_states=two_states,
    )


def _finished(
    passes: Passes, last: ContactState, seen: Sequence[float], settled: bool
) -> LiftedState | None:
    """State of the present pass, its contact and flow solved to the tolerance of the result.

    None if that flow contradicts the flows on the last mesh: the passes then go on with the mesh of
    that flow. A sealed film that a higher pressure under its contact would open has not settled.
    """
    problem, rtol = passes.problem, passes.rtol
    contact = problem.contact_under(passes.pressure, last)
    film = problem.film(contact.gap)
    leak = problem.flow(film, None, False)
    if settled and spread([leak.value, passes.rates[-1]]) > rtol:
        passes.go_on_from(leak)
        return None
    flipping = 0
    if not settled:
        seen, flipping = [*seen, leak.value], passes.flipping
    elif film.sealed:
        seen = [0.0, _most_through_sealed(passes, film, contact)]
        settled = seen[1] == 0
    return LiftedState(
        state=leak.state,
        contact=contact,
        fluid_pressure=problem.field(passes.pressure),
        leak_rate=leak,
        passes=passes.count,
        change=spread(seen),
        converged=settled,
        lowest=min(seen),
        highest=max(seen),
        rtol=rtol,
        rates=tuple(passes.rates),
        mesh_width=width_of(passes.flow_of_mesh),
        flipping=flipping,
    )


def _most_through_sealed(passes: Passes, film: GridFilm, contact: ContactState) -> float:
    """Leak rate [m³/s] with the inlet's pressure wherever open paths do not lead to the outlet.

    It is 0 if the film stays sealed under this pressure. On a half-space a higher p_f nowhere makes
    the gap smaller, so the film then stays sealed under any p_f. The continued p_f cannot decide
    that: where a few samples of contact hold the whole pressure drop, it is too low on them and
    keeps them closed.
    """
    problem, (nx, ny) = passes.problem, film.gap.shape
    joined = film.joined_to("outlet")[:nx, :ny]
    highest = np.where(joined, problem.outlet, problem.inlet)
    if problem.load is not None and left_of(problem.load, highest) <= 0:
        return inf
    opened = problem.film(problem.contact_under(highest, contact).gap)
    leak = problem.flow(opened, passes.tuning.first_tolerance, True)
    return leak.value if leak.upper is None else leak.upper


def _lifted_off(problem: LiftProblem, pressure: np.ndarray, rates: Sequence[float]) -> LiftedState:
    return LiftedState(
        state="lifted off",
        contact=None,
        fluid_pressure=problem.field(pressure),
        leak_rate=None,
        passes=len(rates),
        change=0.0,
        converged=True,
        lowest=inf,
        highest=inf,
        rates=tuple(rates),
    )
