"""Control of the total error: coarse runs choose the contact grid and the flow tolerance.

The error of a leak rate has three parts, all measured as |ln| of a ratio of leak rates, so that
they add up:

    c + f + l <= ln(1 + total)

c: error of the contact grid, f: half-width of the flow's bracket, l: error of the lift, where the
fluid lifts the solid.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import expm1, inf, log, log1p, sinh
from typing import Protocol

from fem_seal import parallel
from fem_seal.contact.state import GapState
from fem_seal.coupling import LiftedState, most_claimed
from fem_seal.digits import per_cent
from fem_seal.errors import present
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Patch
from fem_seal.progress import Report, silent
from fem_seal.scene import Accuracy, Scene
from fem_seal.surface.resampling import resample

# Factors of the grids coarser than the surface; they serve the error estimate only.
COARSER = (0.25, 0.5)
LEAST_SAMPLES = 8
# Factors of the last change of the leak rate and of the change before it: see `contact_part`.
SAFETY, BEFORE = 1.5, 0.5
# Part of the error budget for the contact grid: while a finer grid may follow, and on the finest.
SHARE, LAST_SHARE = 2 / 3, 0.9


class Solved(Protocol):
    """A dry contact, its equilibrium with the fluid if that is resolved, and the leak rate."""

    @property
    def contact(self) -> GapState | None:
        """The dry contact."""

    @property
    def lifted(self) -> LiftedState | None:
        """Its equilibrium with the fluid, if that is resolved."""

    @property
    def leak_rate(self) -> LeakRate:
        """Leak rate through the gap."""


# (surface, rtol, contact of that surface or None) -> contact and leak rate
OnGrid = Callable[[GridField, float, GapState | None], Solved]


@dataclass(frozen=True)
class Trial:
    """A contact grid that was tried.

    Attributes
    ----------
    samples : (nx, ny)
        Samples of the grid.
    leak_rate, lower, upper : float
        Leak rate and its bounds [m³/s].
    """

    samples: tuple[int, int]
    leak_rate: float
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class Choice:
    """The contact grid and the flow tolerance that keep a total error.

    Attributes
    ----------
    total : float
        Total relative error that the scene allows.
    max_refinement : int
        Finest grid allowed, in multiples of the samples of the surface.
    surface, contact, lifted, leak_rate : GridField, GapState, LiftedState or None, LeakRate
        Results on the chosen grid. The leak rate has `converged` False if no allowed grid keeps
        the total error.
    rtol : float
        Tolerance of the flow.
    contact_error : float
        Estimated relative error of the contact grid.
    flow_error : float
        Relative half-width of the guaranteed bounds.
    lift_error : float or None
        Estimated relative error of the lift; None where the fluid lifts nothing.
    trials : tuple[Trial, ...]
        All grids tried, from coarse to fine; the last one was chosen.
    """

    total: float
    max_refinement: int
    surface: GridField
    contact: GapState
    lifted: LiftedState | None
    leak_rate: LeakRate
    rtol: float
    contact_error: float
    flow_error: float
    lift_error: float | None
    trials: tuple[Trial, ...]

    def asked(self, scene: Scene) -> Scene:
        """Scene with [accuracy], as the user wrote it, from the scene of the chosen patch."""
        accuracy = Accuracy(total=self.total, max_refinement=self.max_refinement)
        return scene.model_copy(update={"accuracy": accuracy})


def chosen_grid(
    total: float,
    surface: GridField,
    on_grid: OnGrid,
    max_refinement: int = 4,
    report: Report = silent,
) -> Choice:
    """Refine the contact grid until its error is small; flow and lift get the rest of the budget.

    Parameters
    ----------
    total : allowed relative error of the leak rate, against the limit of ever finer contact grids
        and an exact solution of the flow
    surface : periodic heights; no grid coarser than theirs is chosen
    on_grid : solves contact and flow of a resampled surface
    max_refinement : finest contact grid, in multiples of the samples of the surface
    report : called with each grid

    Returns
    -------
    Choice

    Raises
    ------
    NotConverged
        If a contact or the linear solver fails.
    """
    budget = log1p(total)
    shapes = grids(surface.shape, max_refinement)
    trials: list[Trial] = []
    for shape in shapes:
        report("accuracy", f"contact on {shape[0]} x {shape[1]}")
        resampled = resample(surface, shape)
        solved = on_grid(resampled, total, None)
        leak = solved.leak_rate
        if leak.state == "lifted off":
            # The fluid carries the whole load on every grid.
            part = inf
            break
        trials.append(Trial(shape, leak.value, *leak.bounds))
        part = contact_part([trial.leak_rate for trial in trials])
        share = LAST_SHARE if shape == shapes[-1] else SHARE
        if shape[0] >= surface.shape[0] and part <= share * budget:
            break
    rtol = total
    lifts, left = solved.lifted is not None, budget - part
    # Passes through contact and flow do not settle to any tolerance: samples open and close.
    least = (1 - LAST_SHARE) * budget if lifts else 0.0
    if leak.converged and left > least and flow_part(leak) + lift_part(solved.lifted) > left:
        # The lift claims a multiple of rtol, which is up to twice the flow's part.
        rtol = 2 * left / (1 + 2 * most_claimed(1.0)) if lifts else 2 * sinh(left)
        solved = on_grid(resampled, rtol, solved.contact)
        leak = solved.leak_rate
    lift = lift_part(solved.lifted)
    missed = part + flow_part(leak) + lift > budget
    if leak.converged and missed and leak.state != "lifted off":
        words = _missed(total, part, shapes[-1]) if left <= least else _missed_by_lift(total, lift)
        leak = replace(leak, converged=False, reason=words)
    return Choice(
        total=total,
        max_refinement=max_refinement,
        surface=resampled,
        contact=present(solved.contact, "contact"),
        lifted=solved.lifted,
        leak_rate=leak,
        rtol=rtol,
        contact_error=relative_error(part),
        flow_error=relative_error(flow_part(leak)),
        lift_error=relative_error(lift) if lifts else None,
        trials=tuple(trials),
    )


def solved(
    scene: Scene,
    report: Report = silent,
    *,
    trust: bool = False,
    comm: parallel.Comm = None,
) -> tuple[Patch, Choice | None]:
    """Patch of a scene, on the contact grid that keeps its total error if it asks for one.

    Parameters
    ----------
    scene : Scene
    report, trust, comm : as of `Patch`

    Returns
    -------
    patch : Patch
    choice : Choice or None
        Contact grid and tolerance for accuracy.total; None if the scene has no [accuracy].

    Raises
    ------
    InvalidInput
        As of `Patch`.
    NotConverged
        If a contact or the linear solver fails while grids are tried.
    """
    accuracy = scene.accuracy
    if accuracy is None:
        return Patch(scene, report, trust=trust, comm=comm), None
    first = Patch(scene.with_tolerance(accuracy.total), report, trust=trust, comm=comm)

    def on_grid(surface: GridField, rtol: float, contact: GapState | None) -> Patch:
        return first.on_grid(surface, rtol, contact=contact)

    with first.timed("accuracy"):
        surface = present(first.surface, "surface of a scene with [accuracy]")
        choice = chosen_grid(accuracy.total, surface, on_grid, accuracy.max_refinement, report)
    patch = first.on_grid(
        choice.surface,
        choice.rtol,
        contact=choice.contact,
        leak_rate=choice.leak_rate,
        lifted=choice.lifted,
        contact_error=choice.contact_error,
    )
    patch.seconds.update(first.seconds)
    return patch, choice


def grids(samples: tuple[int, int], max_refinement: int) -> list[tuple[int, int]]:
    """Contact grids to try, each about twice as fine as the one before."""
    nx, ny = samples
    coarse = [(round(nx * factor), round(ny * factor)) for factor in COARSER]
    finer = [1]
    while 2 * finer[-1] <= max_refinement:
        finer.append(2 * finer[-1])
    return [shape for shape in coarse if min(shape) >= LEAST_SAMPLES] + [
        (nx * factor, ny * factor) for factor in finer
    ]


def contact_part(leak_rates: Sequence[float]) -> float:
    """Estimate |ln| of the last leak rate over the limit on ever finer contact grids.

    Parameters
    ----------
    leak_rates : leak rates on contact grids, each twice as fine as the one before; 0 where sealed

    Returns
    -------
    float; inf with fewer than three grids, which do not allow an estimate.

    Notes
    -----
    The estimate is 1.5 times the last change. The changes still to come add up to less than that if
    each is at most 0.6 of the one before it. One change may be small by chance: the estimate is at
    least half the change before the last. It is no bound; docs/measurements/price.md shows how well
    it held.
    """
    if len(leak_rates) < 3:
        return inf
    first, middle, last = leak_rates[-3:]
    return max(SAFETY * _change(middle, last), BEFORE * _change(first, middle))


def flow_part(leak: LeakRate) -> float:
    """Largest |ln| of √(lower upper) over the exact leak rate: half of ln(upper / lower)."""
    if leak.state in ("sealed", "lifted off"):
        return 0.0
    lower, upper = leak.refined_bounds
    return 0.5 * log(upper / lower) if lower > 0 else inf


def lift_part(lifted: LiftedState | None) -> float:
    """Estimated |ln| of the leak rate over that of the equilibrium; 0 if it has not settled."""
    return lifted.claimed if lifted is not None and lifted.converged else 0.0


def _change(before: float, after: float) -> float:
    if before == after:
        return 0.0
    return abs(log(after / before)) if before > 0 and after > 0 else inf


def relative_error(part: float) -> float:
    """Relative error of |ln| of a ratio of leak rates; infinite beyond double precision."""
    return expm1(part) if part < 700 else inf


def _missed(total: float, part: float, finest: tuple[int, int]) -> str:
    size = f"about {per_cent(relative_error(part))}" if part < inf else "not known"
    return (
        f"the contact grid's part of the error is {size} on {finest[0]} x {finest[1]}, the finest "
        f"that accuracy.max_refinement allows; accuracy.total = {total:g} was asked for"
    )


def _missed_by_lift(total: float, part: float) -> str:
    return (
        f"the lift's part of the error is about {per_cent(relative_error(part))}; accuracy.total = "
        f"{total:g} was asked for, of which contact grid and flow take the rest"
    )
