"""The primal and the dual problem on one mesh, their bounds, and the error indicators.

For unit pressure drop and K = g³ (g in units of its maximum), with a tensor R that has at least
the energy of 1/K on every admissible stream function (`traces.py`):

    p minimises ∫ K|∇p|²      over p = 1 at the inlet, 0 at the outlet    (Dirichlet's principle)
    ψ minimises ∫ ∇ψ·R·∇ψ     over ψ with a jump of 1 across the film     (Thomson's principle)

    1 / ∫ ∇ψ·R·∇ψ  <=  Q  <=  ∫ K|∇p|²
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.fenicsx import MPI
from fem_seal.flow.energy import Energy
from fem_seal.flow.gap_on_mesh import (
    ISOTROPIC,
    CellContact,
    ConstantGap,
    LinearGap,
    VertexGap,
)
from fem_seal.flow.gradients import gradients, shape_gradients
from fem_seal.flow.hierarchical import Correction, energy_drops, pressure_bubbles, stream_bubbles
from fem_seal.flow.integrals import AT_ONCE
from fem_seal.flow.linear import CellSpace, Minimum
from fem_seal.flow.numbering import Numbering
from fem_seal.flow.topology import (
    components,
    dual_numbering,
    open_cells,
    primal_numbering,
    side_ends,
)
from fem_seal.flow.traces import mean_gradient_values
from fem_seal.leak_rate import FacetTag
from fem_seal.mesh.edges import find_edges
from fem_seal.mesh.grouping import parts
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.triangles import TriangleMesh

# Pressure drop, relative to that from inlet to outlet, below which equipotential groups count as
# well joined if all the leak rate passes between them.
MAX_DROP = 0.1


@dataclass(frozen=True, eq=False)
class Stream:
    """A stream function of unit flux, from the true or from the regularised dual.

    Attributes
    ----------
    psi : (V,)
        ψ at the vertices of the mesh; zero where nothing flows.
    energy : Energy
        ∫ ∇ψ·R·∇ψ.
    iterations : int
        CG iterations.
    epsilon : float
        Factor ε of the regularised dual; zero in the true dual.
    stalled : str
        Reason why CG stopped short of its tolerance, else "".
    """

    psi: np.ndarray
    energy: Energy
    iterations: int
    epsilon: float
    stalled: str = ""

    @property
    def conductance(self) -> float:
        """1 / energy; for the true dual a lower bound of the leak rate, up to rounding."""
        return 1 / self.energy.value


class LevelProblem:
    """Reynolds flow of unit pressure drop on one mesh (gap in units of its maximum).

    Parameters
    ----------
    gap : the gap as represented
    mesh : of the nested family, or of any triangles
    values : gap at its vertices
    comm : MPI communicator
    tolerance : relative energy error at which CG stops

    Notes
    -----
    Arrays of length C below run over the cells that carry flow, `kept`.
    """

    def __init__(
        self,
        gap: LinearGap | ConstantGap | VertexGap,
        mesh: NestedMesh | TriangleMesh,
        values: np.ndarray,
        comm: MPI.Comm,
        tolerance: float,
    ):
        self.mesh, self.tolerance = mesh, tolerance
        self.gap, self.values = gap, values
        data = gap.cell_data(mesh, values)
        cells = open_cells(mesh, data)
        self.kept = cells.kept
        self.data = data.part(cells.kept)
        self._cell_contact: CellContact = data.without_values()
        self.primal_numbering: Numbering = primal_numbering(mesh, data, cells)
        del data, cells
        self._cells = triangles = mesh.cells.compress(self.kept, axis=0)

        # A closure, not a bound method: this avoids a reference cycle, so the mesh is freed at
        # once.
        def corners(cells: np.ndarray | slice) -> np.ndarray:
            return mesh.corners(gap.aspect, triangles[cells])

        self._corners = corners
        kept = self.kept
        self.space = CellSpace(
            len(triangles),
            corners,
            lambda: mesh.edges[1].compress(kept, axis=0),
            comm,
            mesh.blur * float(np.max(gap.aspect)),
        )

    @property
    def unknowns(self) -> int:
        """Number of pressure unknowns."""
        return self.primal_numbering.count

    @property
    def vertex_gap(self) -> np.ndarray:
        """Gap (V,) at the vertices of the mesh, in units of its maximum."""
        return self.gap.plotted_values(self.mesh, self.values)

    def parted_points(self) -> tuple[np.ndarray, np.ndarray]:
        """Points of the mesh; a vertex counts once for each pressure that the cells have there.

        Returns
        -------
        point : (C, 3), point of each corner
        corner : one corner of each point, as 3 cell + k
        """
        numbering = self.primal_numbering
        # Label of the pressure: unknowns count from 2, the outlet has 1, the inlet 0.
        pressure = numbering.of_corner - numbering.lift + 2
        key = self._cells.astype(np.int64) * (numbering.count + 2) + pressure
        _, corner, point = np.unique(key.ravel(), return_index=True, return_inverse=True)
        return point.reshape(-1, 3), corner

    def facet_tags(self, points: np.ndarray) -> np.ndarray:
        """`FacetTag` (C, 3) of the side opposite each corner, INSIDE where two cells share a side.

        Parameters
        ----------
        points : (C, 3), the points of the corners, of `parted_points`
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
        """Minimise ∫K|∇p|² (Dirichlet's principle): the energy is an upper bound of the leak rate.

        Parameters
        ----------
        guess : (unknowns,), to start from
        """
        # Cells of constant pressure have no energy; in the matrix they would leave rounding errors.
        K = np.where(self.primal_numbering.constant(), 0.0, self.data.K)
        return self.space.minimise(
            lambda cells: K[cells, None] * ISOTROPIC,
            self.primal_numbering,
            guess,
            self.tolerance,
            balanced=True,
        )

    def stream(self, guess: np.ndarray) -> Stream | None:
        """Minimise ∫|∇ψ|²/K (Thomson's principle); None if blocked cells close every channel.

        Parameters
        ----------
        guess : (V,), at the vertices of the mesh
        """
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
        minimum = self.space.minimise(
            lambda cells: self._resistivity(epsilon, cells),
            numbering,
            numbering.from_corners(guess[self._cells]),
            self.tolerance,
        )
        psi = np.zeros(len(self.mesh.xy))
        for cells in parts(0, self.space.count, AT_ONCE):
            psi[self._cells[cells]] = numbering.corners(minimum.values, cells)
        return Stream(psi, minimum.total, minimum.iterations, epsilon, minimum.stalled)

    def _resistivity(self, epsilon: float, cells: slice) -> np.ndarray:
        """Tensor (n, 3) of the true dual, or of the regularised one if epsilon > 0."""
        if epsilon == 0:
            return self.data.resistivity[cells]
        return self.data.part(cells).regularised(epsilon, self.gap.cut)

    def indicators(self, pressure: Minimum, stream: Stream) -> np.ndarray:
        """Error indicators e_T (C,): the part of each cell in upper - lower (Prager and Synge).

        e_T = ∫_T K|∇p|² + J·R·J + 2 J·∇p >= 0, with the flux J, the rotated gradient of ψ scaled
        to its leak rate. For the true dual Σ e_T = upper - lower exactly. For the regularised dual
        the sum is off by about 1e-4, since ψ in blocked cells does not match the power traces of
        their neighbours.
        """
        Q, indicators = stream.conductance, np.empty(self.space.count)
        for cells in parts(0, len(indicators), AT_ONCE):
            slopes, areas = shape_gradients(self._corners(cells))
            px, py = gradients(slopes, pressure.numbering.corners(pressure.values, cells)).T
            psi, contact = stream.psi[self._cells[cells]], self.data.contact_vertex[cells]
            sx, sy = gradients(slopes, psi).T
            mx, my = gradients(slopes, mean_gradient_values(psi, contact)).T
            xx, xy, yy = self._resistivity(stream.epsilon, cells).T
            primal = self.data.K[cells] * (px * px + py * py)
            # Not Q² first: it may underflow.
            dual = Q * (Q * (xx * sx * sx + 2 * xy * sx * sy + yy * sy * sy))
            indicators[cells] = areas * (primal + dual + 2 * Q * (my * px - mx * py))
        return indicators

    def cell_energies(self, pressure: Minimum, stream: Stream) -> tuple[np.ndarray, np.ndarray]:
        """What each cell (C,) adds to ∫K|∇p|², and to ∫∇ψ·R·∇ψ of the true dual."""
        primal, dual = np.empty((2, self.space.count))
        for cells in parts(0, len(primal), AT_ONCE):
            slopes, areas = shape_gradients(self._corners(cells))
            px, py = gradients(slopes, pressure.numbering.corners(pressure.values, cells)).T
            primal[cells] = areas * self.data.K[cells] * (px * px + py * py)
            sx, sy = gradients(slopes, stream.psi[self._cells[cells]]).T
            xx, xy, yy = self._resistivity(0.0, cells).T
            dual[cells] = areas * (xx * sx * sx + 2 * xy * sx * sy + yy * sy * sy)
        return primal, dual

    def residuals(self, pressure: Minimum, least: float) -> np.ndarray:
        """Residual estimate (C,) of the pressure's error: Σ over sides (jump of the flux)²/K.

        The flux of the exact pressure is continuous across sides and zero through walls and along
        contact. The jump is divided by the K of the cell itself, not by the larger K of the two
        cells: this keeps the estimate reliable where good conductors touch at a single vertex
        (C. Bernardi and R. Verfürth, Numer. Math. 85, 579 (2000); M. Petzoldt, Adv. Comput. Math.
        16, 47 (2002)). There a linear pressure lets fluid leak through the vertex at almost no
        cost in energy.

        Parameters
        ----------
        pressure : Minimum
            Solution of the primal problem.
        least : float
            Smallest conductivity to divide by.
        """
        out = np.empty((self.space.count, 3))
        for cells in parts(0, len(out), AT_ONCE):
            slopes, areas = shape_gradients(self._corners(cells))
            slope = gradients(slopes, pressure.numbering.corners(pressure.values, cells))
            weight = -2 * areas * self.data.K[cells]
            out[cells] = weight[:, None] * (slopes * slope[:, None]).sum(axis=2)
        side = self.mesh.edges[1].compress(self.kept, axis=0)
        jump = np.bincount(side.ravel(), out.ravel())[side]
        jump[self.data.zero_gap] = out[self.data.zero_gap]
        # No condition on the flux through sides of prescribed pressure.
        a, b, c = (self.primal_numbering.of_corner < 0).T
        jump[np.stack([b & c, c & a, a & b], axis=1)] = 0.0
        return (jump * jump).sum(axis=1) / np.maximum(self.data.K, least)

    def joints(self, leak_rate: float) -> np.ndarray:
        """Cells (C,) bool that join equipotential groups where the gap is too small for the flow.

        All equipotential cells that touch have the same pressure. That is accurate if they share
        a vertex of large gap. Groups that meet only at vertices of small gap may differ in
        pressure. They hardly do if the edges between such vertices, or the vertices themselves
        (of gap g, each conducts about g³), carry the leak rate at a small pressure drop. All other
        groups are wrongly joined, until the cells at these vertices are refined so far that they
        are no longer equipotential.

        Parameters
        ----------
        leak_rate : estimate of the leak rate
        """
        joined = np.zeros(self.space.count, dtype=bool)
        equipotential = np.flatnonzero(self.data.equipotential)
        if not len(equipotential) or not self.values.shape[1]:
            return joined
        enough = leak_rate / MAX_DROP
        high = self.values[self._cells[equipotential], 0] >= self.gap.ceiling
        equipotential, high = equipotential[high.any(axis=1)], high[high.any(axis=1)]
        vertex, cell = self.mesh.twin[self._cells[equipotential]], np.nonzero(high)[0]
        count = len(self.mesh.xy)
        pairs = np.stack([vertex[high], count + cell], axis=1)
        group = components(pairs, count + len(equipotential))[count:]
        group = self._joined_by_edges(equipotential, high, group, enough)[group]
        # Cells on both sides of a contact line have different unknowns and are not joined.
        pressure = self.primal_numbering.of_corner - self.primal_numbering.lift
        key = np.stack([vertex[~high], pressure[equipotential][~high]])
        point, place = np.unique(key, axis=1, return_inverse=True)
        place, low = place.ravel(), np.nonzero(~high)[0]
        least, most = np.full((2, point.shape[1]), len(group) + count) * [[1], [-1]]
        np.minimum.at(least, place, group[low])
        np.maximum.at(most, place, group[low])
        joint = np.flatnonzero(least < most)
        ends, pair = np.unique(np.stack([least, most])[:, joint], axis=1, return_inverse=True)
        cubes = self.values[point[0, joint], 0] ** 3
        conductance = np.bincount(pair.ravel(), cubes, ends.shape[1])
        resists = np.zeros(len(least), dtype=bool)
        resists[joint] = (conductance < enough)[pair.ravel()]
        joined[equipotential[low[resists[place]]]] = True
        return joined

    def _joined_by_edges(
        self, cells: np.ndarray, high: np.ndarray, group: np.ndarray, enough: float
    ) -> np.ndarray:
        """Number of each group, equal for groups that edges of small gap join well.

        Flow across an edge passes the two cells at its sides, one after the other.

        Parameters
        ----------
        cells : (n,) int, equipotential cells
        high : (n, 3) bool, their vertices of large gap
        group : (n,) int, group of each cell
        enough : conductance from which on two groups count as well joined
        """
        count = int(group.max(initial=-1)) + 1
        at_edge = np.flatnonzero(high.sum(axis=1) == 1)
        side = self.mesh.edges[1].compress(self.kept, axis=0)[cells[at_edge]][high[at_edge]]
        order = np.argsort(side, kind="stable")
        twice = np.flatnonzero(np.diff(side[order]) == 0)
        first, second = at_edge[order[twice]], at_edge[order[twice + 1]]
        resistivity = self.data.resistivity[cells, 0]
        conductance = 1 / (resistivity[first] + resistivity[second])
        ends = np.sort(np.stack([group[first], group[second]]), axis=0)
        ends, pair = np.unique(ends, axis=1, return_inverse=True)
        well = np.bincount(pair.ravel(), conductance, ends.shape[1]) >= enough
        return components(ends[:, well].T, count)

    def flux(self, stream: Stream) -> np.ndarray:
        """Mean flux J (C, 2) of each cell: the rotated gradient of ψ, scaled to its leak rate."""
        psi = stream.psi[self._cells]
        dx, dy = self.gradients(mean_gradient_values(psi, self.data.contact_vertex)).T
        return stream.conductance * np.stack([dy, -dx], axis=1)

    def blocked_flux(self, stream: Stream) -> np.ndarray:
        """Flux |J| × width through each blocked cell (C,); zero in all other cells."""
        flux, blocked = np.zeros(self.space.count), np.flatnonzero(self.data.blocked)
        slopes, areas = shape_gradients(self._corners(blocked))
        steepness = np.linalg.norm(gradients(slopes, stream.psi[self._cells[blocked]]), axis=1)
        flux[blocked] = stream.conductance * steepness * np.sqrt(2 * areas)
        return flux

    def gradients(
        self, corner_values: np.ndarray, cells: np.ndarray | slice = slice(None)
    ) -> np.ndarray:
        """Gradient (n, 2) on n cells of the function with corner values (n, 3)."""
        return gradients(shape_gradients(self._corners(cells))[0], corner_values)

    def corrected(self, pressure: Minimum, stream: Stream) -> tuple[float, float]:
        """Lower and upper bound after the hierarchical correction, widened for rounding errors.

        Parameters
        ----------
        pressure : Minimum
            Solution of the primal problem.
        stream : Stream
            Solution of the true dual problem.
        """
        cells = self.mesh, self._cell_contact, self.kept
        place = np.cumsum(self.kept, dtype=np.int32) - np.int32(1)
        dual = Correction(
            stream_bubbles(*cells),
            lambda some: stream.psi.take(self.mesh.cells.take(some, axis=0)),
            lambda data: data.resistivity[:, 0],
        )
        primal = Correction(
            pressure_bubbles(*cells),
            lambda some: pressure.numbering.corners(pressure.values, place[some]),
            lambda data: data.K,
        )
        gap = self.gap, self.mesh, self.values
        raised, lowered = energy_drops(*gap, (dual, primal), self.space.comm)
        return 1 / stream.energy.least_upper(raised), pressure.total.least_upper(lowered)

    def boundary_flows(self, pressure: Minimum) -> tuple[float, float]:
        """Inflow and outflow from the residuals of the discrete equations at inlet and outlet."""
        prescribed = self.primal_numbering.of_corner < 0
        inlet = self.primal_numbering.lift
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
