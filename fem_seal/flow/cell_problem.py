"""Primal and dual problem of a cell that is periodic in both directions, as 2 × 2 matrices.

The tensor A* maps the jumps J of the pressure across the two seams to the fluxes through them.

    primal    J·A·J = ∫ K|∇p_J|²,    p_J minimises it among pressures with jumps J
    dual      G·B·G = ∫ |∇ψ_G|²/K,   ψ_G minimises it among stream functions with jumps G
              J·C·J = max_G 2 J×G - G·B·G,   J×G = J_x G_y - J_y G_x

Dirichlet's principle gives A* <= A for all J at once, since p_J is linear in J; Thomson's
principle in Legendre's form gives C <= A*. Hence C <= A* <= A as quadratic forms, from two solves
each.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.fenicsx import MPI
from fem_seal.flow.gap_on_mesh import ISOTROPIC, ConstantGap, LinearGap
from fem_seal.flow.gradients import shape_gradients
from fem_seal.flow.linear import CellSpace
from fem_seal.flow.numbering import Numbering
from fem_seal.flow.torus import (
    jumps_along,
    open_torus,
    pressure_numbering,
    stream_numbering,
)
from fem_seal.flow.traces import mean_gradient_values
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.seams import seams

_CROSS = np.array([[0.0, 1.0], [-1.0, 0.0]])  # J×G = J·_CROSS·G


@dataclass(frozen=True, eq=False)
class Family:
    """Minimisers for a basis of jumps.

    Attributes
    ----------
    jumps : (k, 2)
        The jumps across both seams.
    corner_values : (k, C, 3)
        Corner values of each minimiser.
    energies : (k, k)
        ∫ ∇v_a·T·∇v_b, raised by a bound of its rounding error.
    iterations : int
        CG iterations of all solves together.
    stalled : str
        Reason why CG stopped short of its tolerance in one of the solves, else "".
    """

    jumps: np.ndarray
    corner_values: np.ndarray
    energies: np.ndarray
    iterations: int
    stalled: str = ""

    def combined(self, weights: np.ndarray) -> np.ndarray:
        """Corner values (C, 3) of a combination with weights (k,)."""
        return np.tensordot(weights, self.corner_values, axes=1)


def upper_matrix(pressures: Family) -> np.ndarray:
    """A (2, 2): energies of pressures with jumps in the span of the family's dual basis."""
    # Along a single winding w a jump J has the effect of (J·w) times the basis; w = J/|J|².
    basis = np.linalg.pinv(pressures.jumps)
    return basis @ pressures.energies @ basis.T


def best_flux(streams: Family) -> np.ndarray:
    """Weights (k, 2) of the maximising G in the family, as a linear function of J."""
    crossing = streams.jumps @ _CROSS.T  # (k, 2): J×G_a = crossing[a]·J
    return np.linalg.solve(streams.energies, crossing) if len(streams.jumps) else crossing


def lower_matrix(streams: Family) -> np.ndarray:
    """C (2, 2), zero along jumps that no stream function of the family drives."""
    return (streams.jumps @ _CROSS.T).T @ best_flux(streams)


class CellProblem:
    """The periodic cell on one mesh, K = g³ (gap in units of its maximum).

    Parameters
    ----------
    gap : the gap as represented
    mesh : with matching seams
    values : gap at its vertices
    comm : MPI communicator
    tolerance : relative energy error at which CG stops
    """

    def __init__(
        self,
        gap: LinearGap | ConstantGap,
        mesh: NestedMesh,
        values: np.ndarray,
        comm: MPI.Comm,
        tolerance: float,
    ):
        self.mesh, self.tolerance, self._gap = mesh, tolerance, gap
        self._whole = gap.cell_data(mesh, values)
        self._seams = seams(mesh)
        cells = open_torus(mesh, self._whole)
        self.kept = cells.kept
        self.data = self._whole.part(cells.kept)
        self._numbering = pressure_numbering(mesh, self._seams, self._whole, cells)
        self._driving = jumps_along(cells.windings)
        corners = mesh.corners(gap.aspect, mesh.cells[cells.kept])
        sides = mesh.edges[1][cells.kept]
        self._space = CellSpace(len(corners), corners.__getitem__, lambda: sides, comm, mesh.blur)
        self._slopes, self._areas = shape_gradients(corners)

    @property
    def unknowns(self) -> int:
        """Number of pressure unknowns for one direction."""
        return self._numbering.count

    def pressures(self, guess: np.ndarray) -> Family:
        """Minimise ∫K|∇p|² for each jump that can drive a flow.

        Parameters
        ----------
        guess : (2, C, 3) corner values for unit jumps across x and across y
        """
        crossed = self._seams.copy[self.mesh.cells[self.kept]]
        tensor = self.data.K[:, None] * ISOTROPIC
        return self._family(self._numbering, crossed, self._driving, tensor, guess)

    def streams(self, guess: np.ndarray) -> Family:
        """Minimise ∫|∇ψ|²/K for each jump that contact and blocked cells allow."""
        return self._stream_family(self.data.resistivity, guess, merge_blocked=True)

    def regularised_streams(self, guess: np.ndarray, epsilon: float) -> Family:
        """Regularised dual: blocked cells conduct `epsilon` times as much as in the primal."""
        return self._stream_family(self._regularised(epsilon), guess, merge_blocked=False)

    def _stream_family(
        self, tensor: np.ndarray, guess: np.ndarray, *, merge_blocked: bool
    ) -> Family:
        stream = stream_numbering(self.mesh, self._seams, self._whole, self.kept, merge_blocked)
        return self._family(stream.numbering, stream.seams_crossed, stream.jumps, tensor, guess)

    def _regularised(self, epsilon: float) -> np.ndarray:
        return self.data.regularised(epsilon, self._gap.cut)

    def _family(
        self,
        periodic: Numbering,
        crossed: np.ndarray,
        jumps: np.ndarray,
        tensor: np.ndarray,
        guess: np.ndarray,
    ) -> Family:
        values, iterations = np.empty((len(jumps), *periodic.of_corner.shape)), 0
        rounding, stalled = 0.0, ""
        for k, jump in enumerate(jumps):
            lift = crossed @ jump
            numbering = Numbering(periodic.of_corner, lift, periodic.count)
            start = numbering.from_corners(np.tensordot(jump, guess, axes=1))
            minimum = self._space.minimise(tensor.__getitem__, numbering, start, self.tolerance)
            values[k], iterations = minimum.corner_values, iterations + minimum.iterations
            rounding = max(rounding, minimum.total.error / minimum.total.value)
            stalled = stalled or minimum.stalled
        slopes = [self.gradients(v) for v in values]
        fluxes = [_applied(tensor, slope) for slope in slopes]
        products = [[(self._areas * (a * b).sum(axis=1)).sum() for b in fluxes] for a in slopes]
        energies = np.array(products).reshape(2 * (len(jumps),))
        # The rounding error of entry (a, b) is at most `rounding` √(E_aa E_bb), so that of any
        # combination of the functions is at most twice `rounding` times the diagonal part.
        energies += 2 * rounding * np.diag(np.diag(energies))
        return Family(jumps, values, energies, iterations, stalled)

    def gradients(self, corner_values: np.ndarray) -> np.ndarray:
        """Gradient (C, 2) of the function with given corner values (C, 3)."""
        return np.einsum("cid,ci->cd", self._slopes, corner_values)

    def indicators(self, pressures: Family, streams: Family, epsilon: float) -> np.ndarray:
        """Error indicators e_T (C,): the part of each cell in the relative difference of A and C.

        e_T = ∫_T K|∇p|² + j·R·j - 2 ∇p·j with the best flux j for the jump of p, summed over an
        orthonormal basis of pressures. Thus the direction of smallest flow counts as much as the
        others: Σ e_T = tr(A⁻¹(A - C)).
        """
        tensor, total = self._regularised(epsilon), np.zeros(len(self._areas))
        for weights in _orthonormal(pressures):
            psi = streams.combined(best_flux(streams) @ (weights @ pressures.jumps))
            p, s = self.gradients(pressures.combined(weights)), self.gradients(psi)
            mean = self.gradients(mean_gradient_values(psi, self.data.contact_vertex))
            cell = self.data.K * (p * p).sum(axis=1) + (s * _applied(tensor, s)).sum(axis=1)
            cell -= 2 * (p[:, 0] * mean[:, 1] - p[:, 1] * mean[:, 0])
            total += self._areas * cell
        return total

    def blocked_flux(self, pressures: Family, streams: Family) -> np.ndarray:
        """Flux |j| × width through each blocked cell (C,), relative to the whole flux."""
        width, total = np.sqrt(2 * self._areas), np.zeros(len(self._areas))
        for weights in _orthonormal(pressures):
            jump = weights @ pressures.jumps
            slope = self.gradients(streams.combined(best_flux(streams) @ jump))
            total += np.linalg.norm(slope, axis=1) * width * np.linalg.norm(jump)
        return np.where(self.data.blocked, total, 0.0)


def _orthonormal(pressures: Family) -> np.ndarray:
    """Weights (k, k): each row combines the family into a pressure, orthonormal in energy."""
    scale = 1 / np.sqrt(pressures.energies.diagonal())
    values, vectors = np.linalg.eigh(scale[:, None] * pressures.energies * scale)
    return (scale[:, None] * vectors / np.sqrt(values)).T


def _applied(tensor: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """T·v of symmetric tensors (C, 3) as xx, xy, yy and vectors (C, 2)."""
    xx, xy, yy = tensor.T
    x, y = vectors.T
    return np.stack([xx * x + xy * y, xy * x + yy * y], axis=1)
