"""The primal and the dual problem of a leak rate on one mesh, and their bounds.

For unit pressure drop and K = g³ (g in units of its maximum), with a tensor R that has at least
the energy of 1/K on every admissible stream function (`traces.py`):

    p minimises ∫ K|∇p|²      over p = 1 at the inlet, 0 at the outlet    (Dirichlet's principle)
    ψ minimises ∫ ∇ψ·R·∇ψ     over ψ with a jump of 1 across the film     (Thomson's principle)

    1 / ∫ ∇ψ·R·∇ψ  <=  Q  <=  ∫ K|∇p|²
"""

from copy import copy
from dataclasses import dataclass

import numpy as np

from fem_seal.fenicsx import MPI
from fem_seal.flow.bounds import Bounds
from fem_seal.flow.cell_data import ISOTROPIC
from fem_seal.flow.energy import Energy, gradients, shape_gradients
from fem_seal.flow.film_on_mesh import FilmOnMesh
from fem_seal.flow.gap_on_mesh import GapOnMesh, LinearGap
from fem_seal.flow.integrals import AT_ONCE
from fem_seal.flow.linear import Minimum
from fem_seal.flow.numbering import Numbering
from fem_seal.flow.solution import FlowEstimate, Guess, Start
from fem_seal.flow.topology import dual_numbering, open_cells, primal_numbering
from fem_seal.flow.traces import mean_gradient_values
from fem_seal.leak_rate import FacetTag
from fem_seal.mesh.bisection import AnyMesh
from fem_seal.mesh.grouping import parts
from fem_seal.mesh.mesh import find_edges, side_ends
from fem_seal.mesh.nested import NestedMesh


@dataclass(frozen=True, eq=False)
class Stream:
    """A stream function of unit flux, from the true or from the regularised dual."""

    psi: np.ndarray  #: (V,) ψ at the vertices of the mesh; zero where nothing flows
    energy: Energy  #: ∫ ∇ψ·R·∇ψ
    residuals: tuple[float, ...]  #: as of `Minimum`
    epsilon: float  #: factor ε of the regularised dual; zero in the true dual
    stalled: str = ""  #: reason why CG stopped short of its tolerance, else ""

    @property
    def conductance(self) -> float:
        """1 / energy; for the true dual a lower bound of the leak rate, up to rounding."""
        return 1 / self.energy.value


class LevelProblem(FilmOnMesh):
    """Flow of unit pressure drop from inlet to outlet on one mesh (gap in units of its maximum)."""

    def __init__(
        self,
        gap: GapOnMesh,
        mesh: AnyMesh,
        values: np.ndarray,
        comm: MPI.Comm,
        tolerance: float,
    ):
        data = gap.cell_data(mesh, values)
        cells = open_cells(mesh, data)
        numbering = primal_numbering(mesh, data, cells)
        super().__init__(gap, mesh, values, data, cells.kept, numbering, comm, tolerance)

    def with_gap(self, gap: LinearGap) -> "LevelProblem":
        """The same problem with another gap, for the energies of its functions in that gap."""
        if not isinstance(self.mesh, NestedMesh):
            raise TypeError("only films on a grid share a mesh")
        other = copy(self)
        other.gap, other.values = gap, gap.values_at(self.mesh)
        other.data = gap.cell_data(self.mesh, other.values).part(self.kept)
        return other

    def energy_of_pressure(self, pressure: Minimum) -> Energy:
        """∫K|∇p|² of a pressure on this mesh."""
        K = np.where(pressure.numbering.constant(), 0.0, self.data.K)
        return self.space.energy(lambda cells: K[cells, None] * ISOTROPIC, pressure.corners)

    def energy_of_stream(self, psi: np.ndarray) -> Energy:
        """∫ ∇ψ·R·∇ψ of the true dual, of ψ (V,) at the vertices of the mesh."""
        return self.space.energy(
            lambda cells: self._resistivity(0.0, cells), lambda cells: psi[self._cells[cells]]
        )

    def guess(self, start: Start) -> Guess:
        """Initial values of the unknowns."""
        pressure = start.pressures[0].compress(self.kept, axis=0)
        return Guess(self.primal_numbering.from_corners(pressure), start.streams[0])

    @property
    def vertex_gap(self) -> np.ndarray:
        """Gap (V,) at the vertices of the mesh, in units of its maximum."""
        return self.gap.plotted_values(self.mesh, self.values)

    def parted_points(self) -> tuple[np.ndarray, np.ndarray]:
        """Number (C, 3) of the point at each corner, and one corner of each point, as 3 cell + k.

        A vertex is one point for each pressure that the cells have there.
        """
        numbering = self.primal_numbering
        # Label of the pressure: unknowns count from 2, the outlet has 1, the inlet 0.
        pressure = numbering.of_corner - numbering.offset + 2
        key = self._cells.astype(np.int64) * (numbering.count + 2) + pressure
        _, corner, point = np.unique(key.ravel(), return_index=True, return_inverse=True)
        return point.reshape(-1, 3), corner

    def facet_tags(self, points: np.ndarray) -> np.ndarray:
        """`FacetTag` (C, 3) of the side opposite each corner, INSIDE where two cells share a side.

        `points` (C, 3) are those of the corners, of `parted_points`.
        """
        mesh, sides = self.mesh, self.mesh.numbered_edges.slots()
        flows = np.zeros((len(self.kept) + 1, 3), dtype=bool)  # the last row is outside, slot -1
        flows[:-1][self.kept] = ~self.data.zero_gap
        alone = sides[:, 1] < 0
        through = flows.ravel()[sides[:, 0]] & (alone | flows.ravel()[sides[:, 1]])
        tags = np.full(3 * len(self.kept), FacetTag.CONTACT, dtype=np.int8)
        on_seam = mesh.sides_on_top().ravel()[sides].any(axis=1) & ~alone
        tags[sides[through & ~alone]] = FacetTag.INSIDE
        tags[sides[through & on_seam]] = FacetTag.SEAM
        side = sides[through & alone, 0]
        ends = mesh.cells.ravel()[side_ends(side)]
        at_inlet, at_outlet = (end[ends].all(axis=1) for end in (mesh.inlet, mesh.outlet))
        tags[side] = np.select(
            [at_inlet, at_outlet], [FacetTag.INLET, FacetTag.OUTLET], FacetTag.WALL
        )
        tags = tags.reshape(-1, 3)[self.kept]
        # A contact line of a single side has the same two points on both of its sides.
        edges = find_edges(points[:, [[1, 2], [2, 0], [0, 1]]], int(points.max()) + 1).of_cell
        tags[np.bincount(edges.ravel())[edges] == 2] = FacetTag.INSIDE
        return tags

    def pressure(self, guess: np.ndarray) -> Minimum:
        """Minimise ∫K|∇p|² (Dirichlet's principle), an upper bound of the leak rate."""
        # Cells of constant pressure have no energy; in the matrix they would leave rounding errors.
        K = np.where(self.primal_numbering.constant(), 0.0, self.data.K)
        return self.space.minimise(
            lambda cells: K[cells, None] * ISOTROPIC,
            [self.primal_numbering],
            [guess],
            self.tolerance,
            balanced=True,
        )[0]

    def stream(self, guess: np.ndarray) -> Stream | None:
        """Minimise ∫|∇ψ|²/K (Thomson's principle) from a guess (V,); None if no channel is open."""
        numbering = dual_numbering(self.mesh, self._cell_contact, self.kept, merge_blocked=True)
        return None if numbering is None else self._minimal_stream(0.0, numbering, guess)

    def regularised_stream(self, guess: np.ndarray, epsilon: float) -> Stream | None:
        """Regularised dual: blocked cells conduct `epsilon` times as much as in the primal.

        Its energy is no bound, but it shows where fluid would flow if the blocked cells were
        resolved.
        """
        numbering = dual_numbering(self.mesh, self._cell_contact, self.kept, merge_blocked=False)
        return None if numbering is None else self._minimal_stream(epsilon, numbering, guess)

    def _minimal_stream(self, epsilon: float, numbering: Numbering, guess: np.ndarray) -> Stream:
        (minimum,) = self.space.minimise(
            lambda cells: self._resistivity(epsilon, cells),
            [numbering],
            [numbering.from_corners(guess[self._cells])],
            self.tolerance,
        )
        psi = self._at_vertices(numbering, minimum.values)
        return Stream(psi, minimum.total, minimum.residuals, epsilon, minimum.stalled)

    def cell_energies(self, pressure: Minimum, stream: Stream) -> tuple[np.ndarray, np.ndarray]:
        """Energy of each cell (C,): its part of ∫K|∇p|², and of ∫∇ψ·R·∇ψ of the true dual."""
        primal, dual = np.empty((2, self.space.count))
        for cells in parts(0, len(primal), AT_ONCE):
            slopes, areas = shape_gradients(self._corners(cells))
            px, py = gradients(slopes, pressure.numbering.corners(pressure.values, cells)).T
            primal[cells] = areas * self.data.K[cells] * (px * px + py * py)
            sx, sy = gradients(slopes, stream.psi[self._cells[cells]]).T
            xx, xy, yy = self._resistivity(0.0, cells).T
            dual[cells] = areas * (xx * sx * sx + 2 * xy * sx * sy + yy * sy * sy)
        return primal, dual

    def flux(self, stream: Stream) -> np.ndarray:
        """Mean of the flux J = Q (∂ψ/∂y, -∂ψ/∂x) on each cell (C, 2), Q the conductance of ψ."""
        psi = stream.psi[self._cells]
        dx, dy = self.gradients(mean_gradient_values(psi, self.data.contact_vertex)).T
        return stream.conductance * np.stack([dy, -dx], axis=1)

    def upper_bound(self, pressure: Minimum) -> Bounds:
        """Bounds from the pressure alone, widened for rounding errors."""
        return Bounds(0.0, pressure.total.least_upper())

    def difference(self, pressure: Minimum, stream: Stream) -> float:
        """Relative difference (Q_hi - Q_lo)/Q_lo of the energies before the correction."""
        return pressure.energy / stream.conductance - 1

    def corrected(self, pressure: Minimum, stream: Stream) -> Bounds:
        """Bounds after the hierarchical correction, widened for rounding errors."""
        lowered, raised = self._bubble_drops([pressure.corners], [stream.psi])
        lower = 1 / stream.energy.least_upper(raised.item())
        return Bounds(lower, pressure.total.least_upper(lowered.item()))

    def flows(self, pressure: Minimum, stream: Stream) -> list[FlowEstimate]:
        """The one flow from inlet to outlet."""
        return [FlowEstimate(pressure.corners, stream.psi, stream.conductance, stream.epsilon)]

    def boundary_flows(self, pressure: Minimum) -> tuple[float, float]:
        """Inflow and outflow from the residuals of the discrete equations at inlet and outlet."""
        prescribed = self.primal_numbering.of_corner < 0
        inlet = self.primal_numbering.offset
        at_ends = np.flatnonzero(prescribed.any(axis=1))
        sides = inlet[at_ends], (prescribed & (inlet == 0))[at_ends]
        slopes, areas = shape_gradients(self._corners(at_ends))
        slope = gradients(slopes, pressure.numbering.corners(pressure.values, at_ends))
        weight = areas * self.data.K[at_ends]
        into, out = (
            (weight * (slope * gradients(slopes, side.astype(float))).sum(axis=1)).sum()
            for side in sides
        )
        return float(into), float(-out)
