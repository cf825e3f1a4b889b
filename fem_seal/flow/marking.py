"""Marking: the choice of cells to refine, and the parameters of the refinement.

Four sets of cells are marked, the first three by Dörfler's rule:

* the cells with the largest error indicators e_T;
* the blocked cells with the largest flux: a channel that a few blocked cells close has small e_T,
  although all its flux is missing from the lower bound;
* where the residuals of the pressure exceed Σ e_T, the cells with the largest jumps of its flux;
* the equipotential cells that meet only at vertices of small gap (`joints.py`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fem_seal.arguments import require_count, require_positive
from fem_seal.errors import InvalidInput
from fem_seal.flow.indicators import blocked_fluxes, error_indicators, flux_residuals
from fem_seal.flow.joints import wrongly_joined_cells
from fem_seal.flow.level import LevelProblem
from fem_seal.flow.solution import FlowEstimate
from fem_seal.flow_settings import FlowSettings
from fem_seal.mesh.bisection import doerfler, times_halved

# Least size of a step by the error indicators, as a part of a full step, while flow through leaking
# vertices or wrongly joined cells falsifies them.
LEAST_STEP = 0.3
# Halving the cells that hold a part θ of the difference lowers it by about this times θ.
DECREASE = 0.625
LEAST_PART = 0.15  # least size of the last step: a smaller one would cost a level for little
LEAK_HALVINGS = 2  # of a cell from which the linear pressure leaks: half its size in x and y
JOINT_HALVINGS = 4  # of a wrongly joined cell: a quarter of its size
# Parameters that are parts of something, from 0 to 1.
FRACTIONS = "chi", "theta", "theta_blocked", "theta_residual", "cut", "floor"


@dataclass(frozen=True)
class Tuning:
    """Parameters of the bounds' cost, never of their validity (docs/theory/bounds.md)."""

    #: factor χ of the regularised dual: blocked cells conduct χ times as much as in the primal
    chi: float = 0.1
    #: part of the sum of the error indicators that the marked cells hold (Dörfler)
    theta: float = 0.9
    theta_blocked: float = 0.7  #: part of the flux through blocked cells that the marked ones carry
    #: least part of the pressure's flux residuals, beyond the sum of the error indicators, that the
    #: marked cells hold
    theta_residual: float = 0.5
    #: largest number of halvings ahead of a solve. More of them save levels and cost unknowns
    ahead: int = 2
    #: the dual treats gaps below this part of the critical constriction's gap as contact
    cut: float = 1e-2
    #: the primal raises positive gaps to this part of the critical constriction's gap
    floor: float = 1e-4
    #: cells whose mean gap exceeds this multiple of the critical constriction's gap are
    #: equipotential; none are in a periodic cell. `cut`, `floor` and `ceiling` keep the contrast
    #: within the range of double precision
    ceiling: float = 2e3
    #: relative error of the energy at which CG stops; that of the flux is its square root
    tolerance: float = 1e-8
    coarsest: int = 32  #: squares along the shorter side of the first mesh

    def __post_init__(self) -> None:
        require_positive(chi=self.chi, tolerance=self.tolerance)
        require_count(coarsest=self.coarsest)
        require_count(0, ahead=self.ahead)
        if not self.ceiling > 0:
            raise InvalidInput(f"ceiling = {self.ceiling!r} must be above 0; inf is allowed")
        for name in FRACTIONS:
            value = getattr(self, name)
            if not 0 <= value <= 1:
                raise InvalidInput(f"{name} = {value!r} must lie between 0 and 1")


@dataclass(frozen=True)
class Strategy:
    """How the mesh is refined."""

    marking: "Marking | None"  #: rule that marks cells; None halves all of them
    #: relative width (upper - lower) / √(lower upper) that the caller asks for. It decides when the
    #: true dual is solved and how large the last steps are
    rtol: float = FlowSettings.rtol
    #: solve the true dual on every level, so that both bounds can be watched
    every_dual: bool = False
    tuning: Tuning = Tuning()  #: parameters of the refinement

    @property
    def uniform(self) -> bool:
        """Whether all cells are halved."""
        return self.marking is None


def part_of_a_step(width: float, strategy: Strategy) -> float:
    """Part of a full step that is still needed, so that the last step does not overshoot.

    A step that just fails costs another level, a slightly larger one only a few unknowns: aim a
    tenth below the tolerance. The width of the bounds is infinite if there is no lower one yet.
    """
    aim = 0.9 * strategy.rtol
    needed = (1 - aim / max(width, aim)) / (DECREASE * strategy.tuning.theta)
    return float(np.clip(needed, LEAST_PART, 1.0))


@dataclass(frozen=True, eq=False)
class Marks:
    """Marked cells of a mesh of C cells."""

    times: np.ndarray  #: (C,) int8, how often each cell is to be halved
    least_indicator: float  #: smallest error indicator of a marked cell; infinite if none is marked
    least_flux: float  #: smallest flux through a marked blocked cell; infinite if none is marked


def mark_all(problem: LevelProblem) -> Marks:
    """Halve all cells twice, which makes the uniform mesh with squares half as wide."""
    return Marks(np.full(len(problem.kept), 2, dtype=np.int8), np.inf, np.inf)


def mark(
    problem: LevelProblem,
    flows: Sequence[FlowEstimate],
    expected: float,
    reached: float,
    strategy: Strategy,
) -> Marks:
    """Mark cells of the whole mesh, and choose how often to halve each.

    Parameters
    ----------
    flows
        Flows on the mesh, with the stream functions of the regularised dual.
    expected
        (u - l)/l of the corrected bounds if all blocked cells were resolved.
    reached
        Relative width of the corrected bounds; infinite if the dual was not solved.
    """
    tuning = strategy.tuning
    indicators, blocked_flux = error_indicators(problem, flows), blocked_fluxes(problem, flows)
    # The flux that blocked cells withhold from the lower bound shows in `reached`, but neither in
    # the indicators nor in `expected`: take the size of its step from `reached`.
    part, part_reached = part_of_a_step(expected, strategy), part_of_a_step(reached, strategy)
    by_error = doerfler(indicators, part * tuning.theta)
    by_flux = doerfler(blocked_flux, part_reached * tuning.theta_blocked)
    # Where the linear pressure leaks (see `flux_residuals`), the leaking cells have small
    # indicators, and all cells along the false flow have large ones however small they become. So
    # the leaking cells are refined first. Elsewhere the residuals sum up to no more than the
    # indicators, which alone do better then.
    residuals = flux_residuals(problem, flows)
    unexplained = max(residuals.sum() - indicators.sum(), 0.0)
    required = part_reached * tuning.theta_residual * unexplained
    held = residuals[by_error | by_flux].sum()
    by_joint = wrongly_joined_cells(problem, max(flow.flux.conductance for flow in flows))
    step = LEAST_STEP if by_joint.any() else 1.0
    if held < required:
        step = min(step, max(held / required, LEAST_STEP))
    if step < 1:
        by_error = doerfler(indicators, step * part * tuning.theta)
    by_residual = completed(by_error | by_flux, residuals, required)
    halved = times_halved(indicators, by_error)
    times = np.zeros(len(problem.kept), dtype=np.int8)
    times[problem.kept] = np.max(
        [halved, by_flux, LEAK_HALVINGS * by_residual, JOINT_HALVINGS * by_joint], axis=0
    )
    # A step smaller than a full one (part < 1) is the last and has the size that is needed: do not
    # look ahead by indicators.
    least_indicator = indicators[halved > 0].min(initial=np.inf) if part == 1 else np.inf
    return Marks(times, float(least_indicator), float(blocked_flux[by_flux].min(initial=np.inf)))


Marking = Callable[[LevelProblem, Sequence[FlowEstimate], float, float, Strategy], Marks]
REFINEMENTS: dict[str, Marking | None] = {"adaptive": mark, "uniform": None}


def completed(marked: np.ndarray, indicators: np.ndarray, required: float) -> np.ndarray:
    """The fewest cells (C,) bool to add to `marked`, so that all hold the sum `required`."""
    rest = np.where(marked, 0.0, indicators)
    missing = required - (indicators.sum() - rest.sum())
    # Where nothing is left, what is missing is rounding.
    if missing <= 0 or not rest.any():
        return np.zeros(len(marked), dtype=bool)
    return doerfler(rest, missing / rest.sum())
