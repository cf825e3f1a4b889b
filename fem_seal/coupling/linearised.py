"""Contact and flow linearised about a point: the systems of Newton's step and of its adjoint.

With the change G' of the gap by the fluid's pressure, of the contact (`contact.tangent`), and the
change R' of the fluid's pressure by the gap, of the flow (`network.film_pressure`):

    Newton's step    (I - R' G') δ = F
    adjoint          (I - G'ᵀ R'ᵀ) λ = ∂ ln Q/∂p_f
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_seal.coupling.krylov import LinearSolution, gmres
from fem_seal.network.film_pressure import FilmPressure

# Part of a tolerance of GMRES to which contact and flow are solved within it.
INNER_TOLERANCE = 0.1
# Parts of a side of the patch, in each of which errors have a sign of their own.
PARTS = 4


def summed_by_parts(changes: np.ndarray) -> float:
    """Sum over parts of the patch of |sum of the changes (nx, ny) within a part|.

    A plain sum may be small because changes in distant places cancel by chance; in the next stage
    they may not.
    """
    rows, columns = (np.arange(min(PARTS, n)) * n // min(PARTS, n) for n in changes.shape)
    parts = np.add.reduceat(np.add.reduceat(changes, rows, axis=0), columns, axis=1)
    return float(np.abs(parts).sum())


@dataclass(frozen=True, eq=False)
class Linearised:
    """Contact and flow about a point; each solve leaves a part, its tolerance, of a right side."""

    #: G' of a change (nx, ny) of the fluid's pressure [Pa], to a tolerance; symmetric
    gap_change: Callable[[np.ndarray, float], np.ndarray]
    flow: FilmPressure
    pressure_by_u: np.ndarray  #: derivative (nx, ny) [Pa] of p_f by the solution u of the network
    #: derivative (nx, ny) [Pa/m] of p_f by the gap of the critical constriction; 0 without slip
    pressure_by_critical: np.ndarray
    #: (nx, ny), weights of the gaps in that one: of the samples that have it, all alike; 0 without
    #: slip and if the film is sealed
    critical: np.ndarray

    def response(self, gap: np.ndarray, tolerance: float) -> np.ndarray:
        """R' of a change of the gap."""
        by_flow = self.pressure_by_u * self.flow.change(gap, tolerance)
        return by_flow + self.pressure_by_critical * float(np.vdot(self.critical, gap))

    def response_transposed(self, weight: np.ndarray, tolerance: float) -> np.ndarray:
        """R'ᵀ of weights of the pressure."""
        by_flow = self.flow.transposed(self.pressure_by_u * weight, tolerance)
        return by_flow + self.critical * float(np.vdot(self.pressure_by_critical, weight))

    def solved(
        self, right_side: np.ndarray, tolerance: float, most: int, *, to_stable: bool = False
    ) -> tuple[LinearSolution, np.ndarray]:
        """Solution δ of (I - R' G') δ = right side, and G' δ; arguments as of `gmres`."""
        inner_tolerance, moved = INNER_TOLERANCE * tolerance, list[np.ndarray]()

        def applied(change: np.ndarray) -> np.ndarray:
            moved.append(self.gap_change(change, inner_tolerance))
            return change - self.response(moved[-1], inner_tolerance)

        solution = gmres(applied, right_side, tolerance, most, to_stable=to_stable)
        parts = zip(solution.coefficients, moved, strict=True)
        return solution, sum((part * gap for part, gap in parts), np.zeros_like(right_side))

    def adjoint(self, tolerance: float, most: int) -> LinearSolution:
        """λ by at most so many iterations.

        λ (nx, ny) [1/Pa] says what a wrong flow changes: one whose pressure differs by d changes
        ln Q by λ·d in the end.
        """
        inner_tolerance = INNER_TOLERANCE * tolerance

        def applied(weight: np.ndarray) -> np.ndarray:
            response = self.response_transposed(weight, inner_tolerance)
            return weight - self.gap_change(response, inner_tolerance)

        right_side = self.gap_change(self.flow.log_rate_by_gap, inner_tolerance)
        return gmres(applied, right_side, tolerance, most)

    def log_rate_change(self, gap: np.ndarray) -> float:
        """Size of the change of ln Q with a change of the gap."""
        return summed_by_parts(self.flow.log_rate_by_gap * gap)
