"""How a mesh is refined: the parameters of all steps, and the size of the last ones."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Tuning:
    """Parameters that change the cost of the bounds, never their validity (docs/theory/bounds.md).

    Parameters
    ----------
    epsilon : float
        Factor ε of the regularised dual: blocked cells conduct ε times as much as in the
        primal.
    theta : float
        Part of the sum of the error indicators that the marked cells hold (Dörfler).
    theta_blocked : float
        Part of the flux through blocked cells that the marked ones carry.
    theta_residual : float
        Least part of the pressure's flux residuals, beyond the sum of the error indicators, that
        the marked cells hold.
    ahead : int
        Largest number of halvings ahead of a solve. More of them save levels and cost unknowns.
    cut : float
        The dual treats gaps below this part of the critical constriction's gap as contact.
    floor : float
        The primal raises positive gaps to this part of the critical constriction's gap.
    ceiling : float
        Cells whose mean gap exceeds this multiple of the critical constriction's gap are
        equipotential; none are in a periodic cell. `cut`, `floor` and `ceiling` keep the contrast
        within the range of double precision.
    tolerance : float
        Relative error of the energy at which CG stops; that of the flux is its square root.
    coarsest : int
        Squares along the shorter side of the first mesh.
    """

    epsilon: float = 0.1
    theta: float = 0.9
    theta_blocked: float = 0.7
    theta_residual: float = 0.5
    ahead: int = 2
    cut: float = 1e-2
    floor: float = 1e-4
    ceiling: float = 2e3
    tolerance: float = 1e-8
    coarsest: int = 32


@dataclass(frozen=True)
class Strategy:
    """How the mesh is refined.

    Parameters
    ----------
    uniform : bool
        Halve all cells instead of the marked ones.
    rtol : float
        Relative width (upper - lower) / √(lower upper) that the caller asks for. It decides
        when the true dual is solved and how large the last steps are.
    every_dual : bool
        Solve the true dual on every level, so that both bounds can be watched.
    max_unknowns : int or None
        Largest number of pressure unknowns of a mesh; the first mesh is solved in any case.
    tuning : Tuning
        Parameters of the refinement.
    """

    uniform: bool = False
    rtol: float = 0.05
    every_dual: bool = False
    max_unknowns: int | None = None
    tuning: Tuning = Tuning()


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
