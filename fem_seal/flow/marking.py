"""Marking: the choice of cells to refine.

Four sets of cells are marked, the first three by Dörfler's rule:

* the cells with the largest error indicators e_T;
* the blocked cells with the largest flux: a channel that a few blocked cells close has small e_T,
  although all its flux is missing from the lower bound;
* where the residuals of the pressure exceed Σ e_T, the cells with the largest jumps of its flux;
* the equipotential cells that meet only at vertices of small gap (`FilmOnMesh.joints`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_seal.flow.film_on_mesh import FilmOnMesh, FlowEstimate
from fem_seal.flow.strategy import Strategy, part_of_a_step

# Least size of a step by the error indicators, as a part of a full step, while flow through leaking
# vertices or wrongly joined cells falsifies them.
LEAST_STEP = 0.3


@dataclass(frozen=True, eq=False)
class Marks:
    """Marked cells of a mesh of C cells."""

    times: np.ndarray  #: (C,) int8, how often each cell is to be halved
    least_indicator: float  #: smallest error indicator of a marked cell; infinite if none is marked
    least_flux: float  #: smallest flux through a marked blocked cell; infinite if none is marked


def mark_all(problem: FilmOnMesh) -> Marks:
    """Halve all cells twice, which makes the uniform mesh with squares half as wide."""
    return Marks(np.full(len(problem.kept), 2, dtype=np.int8), np.inf, np.inf)


def mark(
    problem: FilmOnMesh,
    flows: Sequence[FlowEstimate],
    expected: float,
    reached: float,
    strategy: Strategy,
) -> Marks:
    """Mark cells of the whole mesh, and choose how often to halve each.

    Parameters
    ----------
    problem : the mesh
    flows : flows on it, with the stream functions of the regularised dual
    expected : relative width of the corrected bounds if all blocked cells were resolved
    reached : relative width of the corrected bounds; infinite if the dual was not solved
    strategy : tolerance and parameters
    """
    tuning = strategy.tuning
    indicators, blocked_flux = problem.indicators(flows), problem.blocked_flux(flows)
    # The flux that blocked cells withhold from the lower bound shows in `reached`, but neither in
    # the indicators nor in `expected`: take the size of its step from `reached`.
    part, part_reached = part_of_a_step(expected, strategy), part_of_a_step(reached, strategy)
    large = doerfler(indicators, part * tuning.theta)
    through = doerfler(blocked_flux, part_reached * tuning.theta_blocked)
    # Where the linear pressure leaks (see `residuals`), the indicators of the leaking cells are
    # small, but those of all cells along the false flow are large, whatever their size. Refine the
    # leaking cells first. Elsewhere the sum of the residuals is no more than that of the
    # indicators, which alone do better then.
    residuals = problem.residuals(flows)
    unexplained = max(residuals.sum() - indicators.sum(), 0.0)
    required = part_reached * tuning.theta_residual * unexplained
    held = residuals[large | through].sum()
    joints = problem.joints(max(flow.conductance for flow in flows))
    step = LEAST_STEP if joints.any() else 1.0
    if held < required:
        step = min(step, max(held / required, LEAST_STEP))
    if step < 1:
        large = doerfler(indicators, step * part * tuning.theta)
    leaks = completed(large | through, residuals, required)
    large = halvings(indicators, large)
    times = np.zeros(len(problem.kept), dtype=np.int8)
    times[problem.kept] = np.max([large, through, 2 * leaks, 4 * joints], axis=0)
    # A step smaller than a full one (part < 1) is the last and has the size that is needed: do not
    # look ahead by indicators.
    least_indicator = indicators[large > 0].min(initial=np.inf) if part == 1 else np.inf
    return Marks(times, float(least_indicator), float(blocked_flux[through].min(initial=np.inf)))


def doerfler(indicators: np.ndarray, theta: float) -> np.ndarray:
    """Mark the fewest cells that hold a part `theta` of the sum of the indicators (Dörfler 1996).

    At least one cell is marked if any indicator is positive.

    Parameters
    ----------
    indicators : (C,), error indicators, >= 0 up to rounding
    theta : part of the sum, between 0 and 1

    Returns
    -------
    (C,) bool
        Marked cells.
    """
    marked = np.zeros(len(indicators), dtype=bool)
    total = indicators.sum(where=indicators > 0)
    # Cells below 1 - θ of the mean hold less than 1 - θ of the sum, so only the others need
    # sorting.
    candidates = np.flatnonzero(indicators > (1 - theta) * total / max(len(indicators), 1))
    # A stable sort, so that all processes of a run mark the same cells.
    order = candidates[np.argsort(-indicators[candidates], kind="stable")]
    enough = np.searchsorted(np.cumsum(indicators[order]), theta * total)
    marked[order[: enough + 1]] = True
    return marked


def completed(marked: np.ndarray, indicators: np.ndarray, required: float) -> np.ndarray:
    """The fewest cells (C,) bool to add to `marked`, so that all hold the sum `required`."""
    rest = np.where(marked, 0.0, indicators)
    missing = required - (indicators.sum() - rest.sum())
    if missing <= 0:
        return np.zeros(len(marked), dtype=bool)
    return doerfler(rest, missing / rest.sum())


def halvings(indicators: np.ndarray, marked: np.ndarray, most: int = 4) -> np.ndarray:
    """How often to halve each cell (C,) before the next solve; 0 if it is not marked.

    Where the solution is smooth, half a cell has a quarter of its indicator. A cell with 4^k times
    the smallest marked indicator would be marked k more times, and is halved k times at once. This
    gains most at singular corners, where the indicators fall more slowly.
    """
    times = marked.astype(int)
    if marked.any():
        ratio = np.log(indicators[marked] / indicators[marked].min()) / np.log(4)
        times[marked] = np.clip(np.floor(ratio), 1, most)
    return times
