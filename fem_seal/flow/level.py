"""One mesh: the primal and the dual problem on it, and what each cell adds to their difference."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem_seal.fenicsx import MPI
from fem_seal.flow.bubbles import (
    Sharpening,
    energy_drops,
    pressure_bubbles,
    shape_gradients,
    stream_bubbles,
)
from fem_seal.flow.gap_on_mesh import ISOTROPIC, CellContact, ConstantGap, LinearGap
from fem_seal.flow.linear import CellSpace, Minimum
from fem_seal.flow.traces import mean_gradient_values
from fem_seal.flow.unknowns import Unknowns, dual_unknowns, open_cells, primal_unknowns
from fem_seal.mesh.nested import NestedMesh


@dataclass(frozen=True, eq=False)
class Stream:
    """A stream function of unit flux, from the true or from the regularised dual.

    psi : (C, 3) corner values
    conductance : 1 / ∫∇ψ·R·∇ψ; a lower bound of the leak rate if the dual was the true one
    iterations : of CG
    leak : what closed cells conduct, relative to the primal; zero in the true dual
    """

    psi: np.ndarray
    conductance: float
    iterations: int
    leak: float


class LevelProblem:
    """Reynolds flow of unit pressure drop on one mesh, K = g³ (gap in units of its maximum).

    Parameters
    ----------
    gap : the gap as represented
    mesh : NestedMesh
    values : gap at its vertices
    comm : MPI communicator
    tolerance : relative energy error at which CG stops

    Notes
    -----
    Attributes with the suffix C below run over the cells that carry flow, `kept`.
    """

    def __init__(
        self,
        gap: LinearGap | ConstantGap,
        mesh: NestedMesh,
        values: np.ndarray,
        comm: MPI.Comm,
        tolerance: float,
    ):
        self.mesh, self.tolerance = mesh, tolerance
        self._gap, self._values = gap, values
        data = gap.cell_data(mesh, values)
        cells = open_cells(mesh, data)
        self.kept = cells.kept
        self.data = data.part(cells.kept)
        self._contact: CellContact = data.without_values()
        self.primal_numbering: Unknowns = primal_unknowns(mesh, data, cells)
        del data, cells
        self._points = mesh.points(gap.aspect)
        self._comm = comm

    @cached_property
    def space(self) -> CellSpace:
        """Functions on the cells that carry flow; their DOLFINx mesh is made when first needed."""
        return CellSpace(self._points, self.mesh.cells[self.kept], self._comm)

    @property
    def unknowns(self) -> int:
        """Number of pressure unknowns."""
        return self.primal_numbering.count

    @property
    def vertex_gap(self) -> np.ndarray:
        """Gap (V,) at the vertices of the mesh, in units of its maximum."""
        return self._gap.plotted_values(self.mesh, self._values)

    def pressure(self, guess: np.ndarray) -> Minimum:
        """Minimise ∫K|∇p|² (Dirichlet's principle): the energy is an upper bound of the leak rate.

        Parameters
        ----------
        guess : (C, 3) corner values to start from
        """
        # Cells of one pressure add nothing to the energy, and to the matrix only rounding.
        K = np.where(self.primal_numbering.constant(), 0.0, self.data.K)
        tensor = K[:, None] * ISOTROPIC
        start = self.primal_numbering.from_corners(guess)
        return self.space.minimise(
            tensor, self.primal_numbering, start, self.tolerance, balanced=True
        )

    def stream(self, guess: np.ndarray) -> Stream | None:
        """Minimise ∫|∇ψ|²/K (Thomson's principle); None where closed cells bar every channel."""
        numbering = dual_unknowns(self.mesh, self._contact, self.kept, merge_closed=True)
        return numbering and self._minimal_stream(0.0, numbering, guess)

    def regularised_stream(self, guess: np.ndarray, leak: float) -> Stream | None:
        """The same with closed cells conducting `leak` times what they do in the primal.

        No bound, but it knows where flow would pass if the closed cells were resolved.
        """
        numbering = dual_unknowns(self.mesh, self._contact, self.kept, merge_closed=False)
        return numbering and self._minimal_stream(leak, numbering, guess)

    def _minimal_stream(self, leak: float, numbering: Unknowns, guess: np.ndarray) -> Stream:
        start = numbering.from_corners(guess)
        found = self.space.minimise(self._resistivity(leak), numbering, start, self.tolerance)
        return Stream(found.corner_values, 1 / found.energy, found.iterations, leak)

    def _resistivity(self, leak: float) -> np.ndarray:
        """Tensor (C, 3) of the true dual, or of the regularised one if leak > 0."""
        if leak == 0:
            return self.data.resistivity
        return self.data.regularised(leak, self._gap.cut)

    def shares(self, pressure: Minimum, stream: Stream) -> np.ndarray:
        """What each cell (C,) adds to the difference of the bounds (Prager and Synge).

        e_T = ∫ K|∇p|² + J·R·J + 2 J·∇p, with J the rotated gradient of ψ scaled to its leak rate.
        Each is ≥ 0, and Σ e_T = upper - lower, exactly for the true dual; closed cells of the
        regularised one are not conforming to power traces, and its sum is off by about 1e-4.
        """
        data, Q = self.data, stream.conductance
        px, py = self.gradients(pressure.corner_values).T
        sx, sy = self.gradients(stream.psi).T
        jx, jy = self.flux(stream).T
        xx, xy, yy = self._resistivity(stream.leak).T
        primal = data.K * (px * px + py * py)
        # Q² alone may be below what double precision holds.
        dual = Q * (Q * (xx * sx * sx + 2 * xy * sx * sy + yy * sy * sy))
        return self._shapes[1] * (primal + dual + 2 * (jx * px + jy * py))

    def flux(self, stream: Stream) -> np.ndarray:
        """Mean flux J (C, 2) on each cell: the gradient of ψ turned, scaled to its leak rate."""
        dx, dy = self.gradients(mean_gradient_values(stream.psi, self.data.contact)).T
        return stream.conductance * np.stack([dy, -dx], axis=1)

    def throughflow(self, stream: Stream) -> np.ndarray:
        """Flow through each closed cell (C,), |J| times its width; zero in cells not closed."""
        grad = np.linalg.norm(self.gradients(stream.psi), axis=1)
        width = np.sqrt(2 * self._shapes[1])
        return np.where(self.data.closed, stream.conductance * grad * width, 0.0)

    @cached_property
    def _shapes(self) -> tuple[np.ndarray, np.ndarray]:
        return shape_gradients(self._points[self.mesh.cells[self.kept]])

    def gradients(
        self, corner_values: np.ndarray, cells: np.ndarray | slice = slice(None)
    ) -> np.ndarray:
        """Gradient (C, 2), on all or some cells, of the function with corner values (C, 3)."""
        values = corner_values[cells]
        rise = values[:, 1:] - values[:, :1]
        return np.einsum("cid,ci->cd", self._shapes[0][cells][:, 1:], rise)

    def sharpened(self, pressure: Minimum, stream: Stream) -> tuple[float, float]:
        """Lower and upper bound, from a true dual, after the best hypotenuse bubbles."""
        where = self.mesh, self._contact, self.kept
        dual = Sharpening(
            stream_bubbles(*where),
            self._everywhere(self.gradients(stream.psi)),
            lambda data: data.resistivity[:, 0],
        )
        primal = Sharpening(
            pressure_bubbles(*where),
            self._everywhere(self.gradients(pressure.corner_values)),
            lambda data: data.K,
        )
        raised, lowered = energy_drops(self._gap, self.mesh, self._values, (dual, primal))
        return 1 / (1 / stream.conductance - raised), pressure.energy - lowered

    def _everywhere(self, of_kept: np.ndarray) -> np.ndarray:
        """Vectors of the kept cells as (C, 2) of the whole mesh, zero where nothing flows."""
        whole = np.zeros((len(self.kept), 2))
        whole[self.kept] = of_kept
        return whole

    def boundary_flows(self, pressure: Minimum) -> tuple[float, float]:
        """Flow in through the inlet and out through the outlet, from the discrete equations."""
        prescribed = self.primal_numbering.of_corner < 0
        inlet = self.primal_numbering.lift
        at_ends = np.flatnonzero(prescribed.any(axis=1))
        sides = inlet, prescribed & (inlet == 0)
        slope = self.gradients(pressure.corner_values, at_ends)
        weight = self._shapes[1][at_ends] * self.data.K[at_ends]
        into, out = (
            (weight * (slope * self.gradients(side.astype(float), at_ends)).sum(axis=1)).sum()
            for side in sides
        )
        return float(into), float(-out)
