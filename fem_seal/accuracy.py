"""Control of the total error: coarse runs choose the contact grid and the flow tolerance.

The error of a leak rate has four sources, all measured as |ln| of a ratio of leak rates, so that
they add up:

    c + a + f + l <= ln(1 + total)

c: error of the contact grid, a: error of a prescribed contact area, f: half-width of the flow's
bracket, l: error of the lift, where the fluid lifts the solid.
"""

from dataclasses import dataclass, replace
from functools import partial
from math import expm1, inf, log, log1p, sinh
from typing import NamedTuple

from fem_seal import parallel
from fem_seal.area_error import area_error
from fem_seal.coupling import SETTLED
from fem_seal.digits import per_cent
from fem_seal.error_budget import CONTACT_GRID, MOST_LOG, Uncertainty, estimate
from fem_seal.errors import Inconsistent, present
from fem_seal.grid_series import (
    error_from_half,
    error_of_sealed,
    estimated_error,
    grids,
    rate_range,
)
from fem_seal.leak_rate import MEAN_ROUNDING, Estimate, LeakRate, require_enclosed
from fem_seal.patch import Given, Patch
from fem_seal.progress import Report, silent
from fem_seal.scene import Scene
from fem_seal.surface.resampling import resample

UNKNOWN = estimate(
    CONTACT_GRID, "no coarser grid of the contact says what a finer one would change"
)
# Part of the error budget for the contact grid: while a finer grid may follow, and on the finest.
SHARE, LAST_SHARE = 2 / 3, 0.9


@dataclass(frozen=True)
class Trial:
    """A contact grid that was tried, with its leak rate and bounds [m³/s]."""

    samples: tuple[int, int]
    leak_rate: float
    lower: float
    upper: float

    def __post_init__(self) -> None:
        require_enclosed(self.lower, self.upper, self.leak_rate)


@dataclass(frozen=True)
class Choice:
    """The contact grid and the flow tolerance that keep a total error, and its parts.

    An error that is not known is None.
    """

    total: float  #: relative error that the scene allows
    samples: tuple[int, int]
    rtol: float  #: of the flow
    contact_error: float | None  #: relative, estimated; None where sealed
    flow_error: float | None  #: relative half-width of the guaranteed bounds
    #: grids tried that the fluid does not lift off, from coarse to fine: the chosen one is the last
    trials: tuple[Trial, ...]
    #: relative, estimated; None where the fluid lifts nothing, or the lift has not settled
    lift_error: float | None = None
    area_error: float | None = None  #: the same; None unless a contact area is prescribed

    def __post_init__(self) -> None:
        tried = [trial.samples for trial in self.trials]
        errors = self.contact_error, self.flow_error, self.lift_error, self.area_error
        wrong = any(error is not None and not error >= -MEAN_ROUNDING for error in errors)
        if wrong or tried != sorted({*tried}) or tried[-1:] > [self.samples]:
            raise Inconsistent(f"{self.samples} samples chosen of {tried}, with errors {errors}")


class Chosen(NamedTuple):
    """The patch that answers a scene, and how its contact grid was chosen."""

    patch: Patch
    choice: Choice | None = None  #: None without `accuracy.total`
    #: why no allowed grid keeps the total; empty if that is kept, or not known because the flow has
    #: not converged
    missed: str = ""


def chosen_grid(first: Patch, total: float) -> Chosen:
    """Refine the contact grid until its error is small; flow and lift get the rest of the total.

    `first` is on the samples of the scene, the coarsest grid that is chosen. The total is the
    allowed relative error of the leak rate, against the limit of ever finer contact grids and an
    exact solution of the flow. A sealed grid has no error of its leak rate: it is refined until it
    surely stays sealed. A prescribed area counts samples: its error is that of each grid, like the
    grid's own.
    """
    allowed = log1p(total)
    # On every grid the flow is solved with rtol = total. On the chosen one it is solved again if
    # its error is more than the contact leaves of the total.
    first = first.with_(Given(flow_settings=replace(first.flow_settings, rtol=total)))
    patch, trials = _refined(first, allowed)
    lifts, left = patch.lifted is not None, allowed - _contact_part(patch)
    # No tolerance makes the error of a lift as small as one likes: single samples open or close.
    least = (1 - LAST_SHARE) * allowed if lifts else 0.0
    of_flow_and_lift = flow_log_error(patch.leak_rate) + _lift_part(patch)
    if patch.leak_rate.converged and of_flow_and_lift > left > least:
        patch = _solved_again(first, patch, left)
    leak, of_flow, of_lift = patch.leak_rate, flow_log_error(patch.leak_rate), _lift_part(patch)
    exceeds, reason = _contact_part(patch) + of_flow + of_lift > allowed, ""
    if leak.converged and leak.state == "leaking" and exceeds:
        reason = _missed_by_lift(total, of_lift) if left > least else _missed_by_grid(total, patch)
    grid, area = estimated_error(patch), area_error(patch)
    choice = Choice(
        total=total,
        samples=present(patch.surface, "surface").shape,
        rtol=patch.flow_settings.rtol,
        contact_error=None if leak.state == "sealed" else known_error(grid.log_error),
        flow_error=known_error(of_flow),
        trials=trials,
        lift_error=known_error(of_lift) if lifts else None,
        area_error=None if area is None else known_error(area.log_error),
    )
    return Chosen(patch, choice, reason)


def _contact_part(patch: Patch) -> float:
    """Error of the contact grid and of a prescribed area, c + a."""
    area = area_error(patch)
    return estimated_error(patch).log_error + (0.0 if area is None else area.log_error)


def _lift_part(patch: Patch) -> float:
    """Error of the lift, l; infinite if it has not settled."""
    if patch.lifted is None:
        return 0.0
    return patch.lifted.error if patch.lifted.converged else inf


def _solved_again(first: Patch, patch: Patch, left: float) -> Patch:
    """The same contact with a flow and a lift whose errors keep what is left of the allowed one."""
    # The flow claims rtol/2, the lift up to SETTLED of rtol.
    rtol = 2 * sinh(left) if patch.lifted is None else 2 * left / (1 + 2 * SETTLED)
    settings, error = replace(first.flow_settings, rtol=rtol), estimated_error(patch)
    # Two grids are compared by flows of one tolerance: a sharper one on one grid says no more.
    given = Given(patch.surface, patch.contact, flow_settings=settings, grid_error=lambda _: error)
    return first.with_(given)


def _refined(first: Patch, allowed: float) -> tuple[Patch, tuple[Trial, ...]]:
    """Refine the contact grid until its errors leave flow and lift a part of the allowed one.

    Returns the last grid, and all from coarse to fine. Grids coarser than that of the scene are not
    chosen; they only serve `_grid_error`.
    """
    own = present(first.surface, "surface of a scene with [accuracy]")
    shapes = grids(own.shape, present(first.scene.accuracy, "[accuracy]").max_refinement)
    trials: list[Trial] = []
    coarser: Estimate | None = None
    for shape in shapes:
        first.report("accuracy", f"contact on {shape[0]} x {shape[1]}")
        by_coarser = partial(_grid_error, coarser)
        solved = first.with_(Given(resample(own, shape), grid_error=by_coarser))
        coarse, leak = shape[0] < own.shape[0], solved.leak_rate
        if leak.state == "lifted off":
            if coarse:
                # A uniform film carries more on fewer samples, here more than the load.
                continue
            break
        coarser = rate_range(solved)
        trials.append(Trial(shape, leak.value, *leak.bounds))
        if coarse:
            continue
        share = LAST_SHARE if shape == shapes[-1] else SHARE
        if _contact_part(solved) <= share * allowed:
            break
    return solved, tuple(trials)


def _grid_error(coarser: Estimate | None, patch: Patch) -> Uncertainty:
    """What a finer grid would change, from the leak rate on a coarser one [m³/s]."""
    if patch.state == "sealed":
        return error_of_sealed(patch)
    if patch.state == "lifted off" or coarser is None:
        return UNKNOWN
    return error_from_half(patch, coarser)


def known_error(log_error: float) -> float | None:
    """Relative error of |ln| of a ratio of leak rates; None if not known or beyond doubles."""
    return expm1(log_error) if log_error < MOST_LOG else None


def chosen_patch(
    scene: Scene,
    report: Report = silent,
    *,
    trust: bool = False,
    comm: parallel.Comm = None,
) -> Chosen:
    """Patch of a scene, on the contact grid that keeps its total error if it asks for one."""
    first = Patch(scene, report, trust=trust, comm=comm)
    if scene.total_error is None:
        return Chosen(first)
    with first.timed("accuracy"):
        chosen = chosen_grid(first, scene.total_error)
    chosen.patch.seconds = first.seconds  # its own stages are parts of "accuracy"
    return chosen


def flow_log_error(leak: LeakRate) -> float:
    """Largest |ln| of √(lower upper) over the exact leak rate: half of ln(upper / lower)."""
    if leak.state in ("sealed", "lifted off"):
        return 0.0
    lower, upper = leak.refined_bounds
    return 0.5 * log(upper / lower) if lower > 0 else inf


def error_words(error: float | None) -> str:
    """An estimate of a relative error; one of 100 % or more as the factor 1 + error."""
    if error is None:
        return "not known"
    return f"about {per_cent(error)}" if error < 1 else f"about a factor of {1 + error:.2g}"


def _missed_by_grid(total: float, patch: Patch) -> str:
    size = error_words(known_error(_contact_part(patch)))
    also = "" if area_error(patch) is None else " and the area's"
    nx, ny = present(patch.surface, "surface").shape
    return (
        f"the contact grid's{also} part of the error is {size} on {nx} x {ny}, "
        f"the finest that accuracy.max_refinement allows; accuracy.total = {total:g} was asked for"
    )


def _missed_by_lift(total: float, log_error: float) -> str:
    return (
        f"the lift's part of the error is {error_words(known_error(log_error))}; together "
        f"with those of contact grid and flow it is above accuracy.total = {total:g}"
    )
