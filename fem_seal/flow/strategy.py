"""How a mesh is refined: the parameters of all steps, and the size of the last ones."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Tuning:
    """Parameters of the bounds' cost, never of their validity (docs/theory/bounds.md)."""

    #: factor ε of the regularised dual: blocked cells conduct ε times as much as in the primal
    epsilon: float = 0.1
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


@dataclass(frozen=True)
class Strategy:
    """How the mesh is refined."""

    uniform: bool = False  #: halve all cells instead of the marked ones
    #: relative width (upper - lower) / √(lower upper) that the caller asks for. It decides when the
    #: true dual is solved and how large the last steps are
    rtol: float = 0.05
    #: solve the true dual on every level, so that both bounds can be watched
    every_dual: bool = False
    #: largest number of pressure unknowns of a mesh; the first mesh is solved in any case
    max_unknowns: int | None = None
    tuning: Tuning = Tuning()  #: parameters of the refinement


def part_of_a_step(width: float, strategy: Strategy) -> float:
    """Part of a full step that is still needed, so that the last step does not overshoot.

    Halving the cells that hold a part θ of the difference lowers it by about 0.63 θ. A step that
    just fails costs another level, a slightly larger one only a few unknowns: aim a tenth below
    the tolerance.

    Parameters
    ----------
    width : relative width of the bounds; infinite if there is no lower bound yet
    strategy : tolerance and parameters
    """
    aim = 0.9 * strategy.rtol
    needed = 1.6 * (1 - aim / max(width, aim)) / strategy.tuning.theta
    return float(np.clip(needed, 0.15, 1.0))
