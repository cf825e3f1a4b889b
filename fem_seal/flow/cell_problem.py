"""Both problems on one mesh of a cell that is periodic in both directions, as 2 × 2 matrices.

A* takes the jumps of the pressure across the two seams to the fluxes through them. With p_J the
minimiser for the jumps J, J·A·J = ∫ K|∇p_J|² ≥ J·A*·J for all J at once, p_J being linear in J. The
same for stream functions of jumps G, G·B·G = ∫|∇ψ_G|²/K: by Thomson's principle (in Legendre's
form) J·A*·J ≥ max_G 2 J×G - G·B·G =: J·C·J, J×G = J_x G_y - J_y G_x. Hence C ≤ A* ≤ A as
quadratic forms, exactly, from two solves each.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.fenicsx import MPI
from fem_seal.flow.gap_on_mesh import ISOTROPIC, ConstantGap, LinearGap
from fem_seal.flow.gradients import shape_gradients
from fem_seal.flow.linear import CellSpace
from fem_seal.flow.numbering import Unknowns
from fem_seal.flow.torus import (
    jumps_along,
    open_torus,
    pressure_unknowns,
    stream_unknowns,
)
from fem_seal.flow.traces import mean_gradient_values
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.seams import seams

_CROSS = np.array([[0.0, 1.0], [-1.0, 0.0]])  # J×G = J·_CROSS·G


@dataclass(frozen=True, eq=False)
class Family:
    """Minimisers for a basis of jumps.

    jumps : (k, 2); corner_values : (k, C, 3)
    energies : (k, k), ∫ ∇v_a·T·∇v_b, raised by what rounding may have taken away
    iterations : of CG, of all of them
    stalled : why CG stopped short of its tolerance for one of them, "" if it did not
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
    # Along one winding w a jump J does what (J·w) times the basis does, and w = J/|J|².
    basis = np.linalg.pinv(pressures.jumps)
    return basis @ pressures.energies @ basis.T


def best_flux(streams: Family) -> np.ndarray:
    """(k, 2): weights of the family of the flux that bounds best, as a linear function of J."""
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
        self._numbering = pressure_unknowns(mesh, self._seams, self._whole, cells)
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
        """Minimise ∫|∇ψ|²/K for each jump that contact and closed cells allow."""
        found = stream_unknowns(self.mesh, self._seams, self._whole, self.kept, merge_closed=True)
        return self._family(
            found.unknowns, found.seams_crossed, found.jumps, self.data.resistivity, guess
        )

    def regularised_streams(self, guess: np.ndarray, leak: float) -> Family:
        """The same with closed cells conducting `leak` times what they do in the primal."""
        found = stream_unknowns(self.mesh, self._seams, self._whole, self.kept, merge_closed=False)
        return self._family(
            found.unknowns, found.seams_crossed, found.jumps, self._regularised(leak), guess
        )

    def _regularised(self, leak: float) -> np.ndarray:
        return self.data.regularised(leak, self._gap.cut)

    def _family(
        self,
        periodic: Unknowns,
        crossed: np.ndarray,
        jumps: np.ndarray,
        tensor: np.ndarray,
        guess: np.ndarray,
    ) -> Family:
        values, iterations = np.empty((len(jumps), *periodic.of_corner.shape)), 0
        rounding, stalled = 0.0, ""
        for k, jump in enumerate(jumps):
            lift = crossed @ jump
            numbering = Unknowns(periodic.of_corner, lift, periodic.count)
            start = numbering.from_corners(np.tensordot(jump, guess, axes=1))
            found = self._space.minimise(tensor.__getitem__, numbering, start, self.tolerance)
            values[k], iterations = found.corner_values, iterations + found.iterations
            rounding = max(rounding, found.total.error / found.total.value)
            stalled = stalled or found.stalled
        slopes = [self.gradients(v) for v in values]
        fluxes = [_applied(tensor, slope) for slope in slopes]
        energies = [[(self._areas * (a * b).sum(axis=1)).sum() for b in fluxes] for a in slopes]
        energies = np.array(energies).reshape(2 * (len(jumps),))
        # Rounding moves an entry by that part of the root of the two diagonal ones at most, and so
        # any combination of the functions by twice that part of the diagonal.
        energies += 2 * rounding * np.diag(np.diag(energies))
        return Family(jumps, values, energies, iterations, stalled)

    def gradients(self, corner_values: np.ndarray) -> np.ndarray:
        """Gradient (C, 2) of the function with given corner values (C, 3)."""
        return np.einsum("cid,ci->cd", self._slopes, corner_values)

    def shares(self, pressures: Family, streams: Family, leak: float) -> np.ndarray:
        """What each cell (C,) adds to the relative difference of the two matrices.

        e_T = ∫ K|∇p|² + j·R·j - 2 ∇p·j with the best flux j for the jump of p, summed over an
        orthonormal basis of pressures, so that the direction in which least flows counts as much
        as the others: Σ e_T = tr(A⁻¹(A - C)).
        """
        tensor, total = self._regularised(leak), np.zeros(len(self._areas))
        for weights in _orthonormal(pressures):
            psi = streams.combined(best_flux(streams) @ (weights @ pressures.jumps))
            p, s = self.gradients(pressures.combined(weights)), self.gradients(psi)
            mean = self.gradients(mean_gradient_values(psi, self.data.contact))
            cell = self.data.K * (p * p).sum(axis=1) + (s * _applied(tensor, s)).sum(axis=1)
            cell -= 2 * (p[:, 0] * mean[:, 1] - p[:, 1] * mean[:, 0])
            total += self._areas * cell
        return total

    def throughflow(self, pressures: Family, streams: Family) -> np.ndarray:
        """Flow through each closed cell (C,), |j| times its width, in parts of the whole."""
        width, total = np.sqrt(2 * self._areas), np.zeros(len(self._areas))
        for weights in _orthonormal(pressures):
            jump = weights @ pressures.jumps
            slope = self.gradients(streams.combined(best_flux(streams) @ jump))
            total += np.linalg.norm(slope, axis=1) * width * np.linalg.norm(jump)
        return np.where(self.data.closed, total, 0.0)


def _orthonormal(pressures: Family) -> np.ndarray:
    """(k, k): rows of weights that combine a family to pressures of energy one, orthogonal."""
    scale = 1 / np.sqrt(pressures.energies.diagonal())
    values, vectors = np.linalg.eigh(scale[:, None] * pressures.energies * scale)
    return (scale[:, None] * vectors / np.sqrt(values)).T


def _applied(tensor: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """T·v of symmetric tensors (C, 3) as xx, xy, yy and vectors (C, 2)."""
    xx, xy, yy = tensor.T
    x, y = vectors.T
    return np.stack([xx * x + xy * y, xy * x + yy * y], axis=1)
