"""One mesh: the primal and the dual problem on it, and what each cell adds to their difference."""

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
from fem_seal.flow.integrals import AT_ONCE
from fem_seal.flow.linear import CellSpace, Minimum
from fem_seal.flow.numbering import Unknowns
from fem_seal.flow.sharpening import Sharpening, energy_drops, pressure_hats, stream_hats
from fem_seal.flow.traces import mean_gradient_values
from fem_seal.flow.unknowns import (
    components,
    dual_unknowns,
    open_cells,
    primal_unknowns,
    side_ends,
)
from fem_seal.leak_rate import FacetTag
from fem_seal.mesh.edges import find_edges
from fem_seal.mesh.grouping import parts
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.triangles import TriangleMesh


@dataclass(frozen=True, eq=False)
class Stream:
    """A stream function of unit flux, from the true or from the regularised dual.

    psi : (V,), at the vertices of the mesh; zero where nothing flows
    energy : ∫∇ψ·R·∇ψ
    iterations : of CG
    leak : what closed cells conduct, relative to the primal; zero in the true dual
    stalled : why CG stopped short of its tolerance, "" if it did not
    """

    psi: np.ndarray
    energy: Energy
    iterations: int
    leak: float
    stalled: str = ""

    @property
    def conductance(self) -> float:
        """1 / energy: a lower bound of the leak rate, but for rounding, if the dual was true."""
        return 1 / self.energy.value


class LevelProblem:
    """Reynolds flow of unit pressure drop on one mesh, K = g³ (gap in units of its maximum).

    Parameters
    ----------
    gap : the gap as represented
    mesh : of the nested family, or of any triangles
    values : gap at its vertices
    comm : MPI communicator
    tolerance : relative energy error at which CG stops

    Notes
    -----
    Attributes with the suffix C below run over the cells that carry flow, `kept`.
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
        self._gap, self.values = gap, values
        data = gap.cell_data(mesh, values)
        cells = open_cells(mesh, data)
        self.kept = cells.kept
        self.data = data.part(cells.kept)
        self._contact: CellContact = data.without_values()
        self.primal_numbering: Unknowns = primal_unknowns(mesh, data, cells)
        del data, cells
        self._cells = triangles = mesh.cells.compress(self.kept, axis=0)

        # Not a method: an object that refers to itself stays in memory until Python looks for such.
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
        return self._gap.plotted_values(self.mesh, self.values)

    def parted_points(self) -> tuple[np.ndarray, np.ndarray]:
        """Points of the mesh, a vertex counted once for each of the pressures around it.

        Returns
        -------
        (C, 3), the point of each corner; and for each point one of its corners, 3 cell + k
        """
        numbering = self.primal_numbering
        # Unknowns from 2 on, and what is given: 1 where the pressure is zero, 0 where it is one.
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
        flows[:-1][self.kept] = ~self.data.shut
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
        # Cells of one pressure add nothing to the energy, and to the matrix only rounding.
        K = np.where(self.primal_numbering.constant(), 0.0, self.data.K)
        return self.space.minimise(
            lambda cells: K[cells, None] * ISOTROPIC,
            self.primal_numbering,
            guess,
            self.tolerance,
            balanced=True,
        )

    def stream(self, guess: np.ndarray) -> Stream | None:
        """Minimise ∫|∇ψ|²/K (Thomson's principle); None where closed cells bar every channel.

        Parameters
        ----------
        guess : (V,), at the vertices of the mesh
        """
        numbering = dual_unknowns(self.mesh, self._contact, self.kept, merge_closed=True)
        return numbering and self._minimal_stream(0.0, numbering, guess)

    def regularised_stream(self, guess: np.ndarray, leak: float) -> Stream | None:
        """The same with closed cells conducting `leak` times what they do in the primal.

        No bound, but it knows where flow would pass if the closed cells were resolved.
        """
        numbering = dual_unknowns(self.mesh, self._contact, self.kept, merge_closed=False)
        return numbering and self._minimal_stream(leak, numbering, guess)

    def _minimal_stream(self, leak: float, numbering: Unknowns, guess: np.ndarray) -> Stream:
        found = self.space.minimise(
            lambda cells: self._resistivity(leak, cells),
            numbering,
            numbering.from_corners(guess[self._cells]),
            self.tolerance,
        )
        psi = np.zeros(len(self.mesh.xy))
        for cells in parts(0, self.space.count, AT_ONCE):
            psi[self._cells[cells]] = numbering.corners(found.values, cells)
        return Stream(psi, found.total, found.iterations, leak, found.stalled)

    def _resistivity(self, leak: float, cells: slice) -> np.ndarray:
        """Tensor (n, 3) of the true dual, or of the regularised one if leak > 0."""
        if leak == 0:
            return self.data.resistivity[cells]
        return self.data.part(cells).regularised(leak, self._gap.cut)

    def shares(self, pressure: Minimum, stream: Stream) -> np.ndarray:
        """What each cell (C,) adds to the difference of the bounds (Prager and Synge).

        e_T = ∫ K|∇p|² + J·R·J + 2 J·∇p, with J the rotated gradient of ψ scaled to its leak rate.
        Each is ≥ 0, and Σ e_T = upper - lower, exactly for the true dual; closed cells of the
        regularised one are not conforming to power traces, and its sum is off by about 1e-4.
        """
        Q, shares = stream.conductance, np.empty(self.space.count)
        for cells in parts(0, len(shares), AT_ONCE):
            slopes, areas = shape_gradients(self._corners(cells))
            px, py = gradients(slopes, pressure.unknowns.corners(pressure.values, cells)).T
            psi, contact = stream.psi[self._cells[cells]], self.data.contact[cells]
            sx, sy = gradients(slopes, psi).T
            mx, my = gradients(slopes, mean_gradient_values(psi, contact)).T
            xx, xy, yy = self._resistivity(stream.leak, cells).T
            primal = self.data.K[cells] * (px * px + py * py)
            # Q² alone may be below what double precision holds.
            dual = Q * (Q * (xx * sx * sx + 2 * xy * sx * sy + yy * sy * sy))
            shares[cells] = areas * (primal + dual + 2 * Q * (my * px - mx * py))
        return shares

    def residuals(self, pressure: Minimum, least: float) -> np.ndarray:
        """Estimate of the pressure's error from its flux, Σ (jump of the flow)²/K over sides, (C,).

        The flow through a side should leave one cell and enter the other, and there should be
        none through a wall or along contact. Dividing by the K of the cell itself, and not by
        that of the better conducting of the two, keeps the estimate reliable where good
        conductors touch at one vertex alone (C. Bernardi and R. Verfürth, Numer. Math. 85, 579
        (2000); M. Petzoldt, Adv. Comput. Math. 16, 47 (2002)): there the linear pressure lets
        pass what hardly flows, at no cost in energy.

        Parameters
        ----------
        pressure : the solution
        least : conductivity to divide by in cells that conduct less
        """
        out = np.empty((self.space.count, 3))
        for cells in parts(0, len(out), AT_ONCE):
            slopes, areas = shape_gradients(self._corners(cells))
            slope = gradients(slopes, pressure.unknowns.corners(pressure.values, cells))
            weight = -2 * areas * self.data.K[cells]
            out[cells] = weight[:, None] * (slopes * slope[:, None]).sum(axis=2)
        side = self.mesh.edges[1].compress(self.kept, axis=0)
        jump = np.bincount(side.ravel(), out.ravel())[side]
        jump[self.data.shut] = out[self.data.shut]
        # Flow may pass through sides along which the pressure is given.
        a, b, c = (self.primal_numbering.of_corner < 0).T
        jump[np.stack([b & c, c & a, a & b], axis=1)] = 0.0
        return (jump * jump).sum(axis=1) / np.maximum(self.data.K, least)

    def joints(self) -> np.ndarray:
        """Cells (C,) bool of one pressure only since they touch where the gap is small.

        Stiff cells that touch have one pressure. Those that share high vertices conduct well to
        each other; groups of such cells that meet in low vertices alone do not, and are joined
        until the cells at these vertices are small enough not to be stiff.
        """
        joined, stiff = np.zeros(self.space.count, dtype=bool), np.flatnonzero(self.data.stiff)
        if not len(stiff) or not self.values.shape[1]:
            return joined
        high = self.values[self._cells[stiff], 0] >= self._gap.ceiling
        stiff, high = stiff[high.any(axis=1)], high[high.any(axis=1)]
        vertex, cell = self.mesh.twin[self._cells[stiff]], np.nonzero(high)[0]
        count = len(self.mesh.xy)
        pairs = np.stack([vertex[high], count + cell], axis=1)
        group = components(pairs, count + len(stiff))[count:]
        # Pressures at one point differ across contact, which parts the groups already.
        pressure = self.primal_numbering.of_corner - self.primal_numbering.lift
        key = np.stack([vertex[~high], pressure[stiff][~high]])
        _, place = np.unique(key, axis=1, return_inverse=True)
        low = np.nonzero(~high)[0]
        least, most = np.full((2, len(low)), len(group) + count) * [[1], [-1]]
        np.minimum.at(least, place.ravel(), group[low])
        np.maximum.at(most, place.ravel(), group[low])
        joined[stiff[low[(least < most)[place.ravel()]]]] = True
        return joined

    def flux(self, stream: Stream) -> np.ndarray:
        """Mean flux J (C, 2) on each cell: the gradient of ψ turned, scaled to its leak rate."""
        psi = stream.psi[self._cells]
        dx, dy = self.gradients(mean_gradient_values(psi, self.data.contact)).T
        return stream.conductance * np.stack([dy, -dx], axis=1)

    def throughflow(self, stream: Stream) -> np.ndarray:
        """Flow through each closed cell (C,), |J| times its width; zero in cells not closed."""
        flow, closed = np.zeros(self.space.count), np.flatnonzero(self.data.closed)
        slopes, areas = shape_gradients(self._corners(closed))
        steepness = np.linalg.norm(gradients(slopes, stream.psi[self._cells[closed]]), axis=1)
        flow[closed] = stream.conductance * steepness * np.sqrt(2 * areas)
        return flow

    def gradients(
        self, corner_values: np.ndarray, cells: np.ndarray | slice = slice(None)
    ) -> np.ndarray:
        """Gradient (n, 2), on all or some cells, of a function with corner values (n, 3) there."""
        return gradients(shape_gradients(self._corners(cells))[0], corner_values)

    def sharpened(self, pressure: Minimum, stream: Stream) -> tuple[float, float]:
        """Lower and upper bound, from a true dual, after hats on the middles of the edges.

        Both with room for rounding.
        """
        cells = self.mesh, self._contact, self.kept
        place = np.cumsum(self.kept, dtype=np.int32) - np.int32(1)
        dual = Sharpening(
            stream_hats(*cells),
            lambda some: stream.psi.take(self.mesh.cells.take(some, axis=0)),
            lambda data: data.resistivity[:, 0],
        )
        primal = Sharpening(
            pressure_hats(*cells),
            lambda some: pressure.unknowns.corners(pressure.values, place[some]),
            lambda data: data.K,
        )
        gap = self._gap, self.mesh, self.values
        raised, lowered = energy_drops(*gap, (dual, primal), self.space.comm)
        return 1 / stream.energy.least_upper(raised), pressure.total.least_upper(lowered)

    def boundary_flows(self, pressure: Minimum) -> tuple[float, float]:
        """Flow in through the inlet and out through the outlet, from the discrete equations."""
        prescribed = self.primal_numbering.of_corner < 0
        inlet = self.primal_numbering.lift
        at_ends = np.flatnonzero(prescribed.any(axis=1))
        sides = inlet[at_ends], (prescribed & (inlet == 0))[at_ends]
        slopes, areas = shape_gradients(self._corners(at_ends))
        slope = gradients(slopes, pressure.unknowns.corners(pressure.values, at_ends))
        weight = areas * self.data.K[at_ends]
        into, out = (
            (weight * (slope * gradients(slopes, side.astype(float))).sum(axis=1)).sum()
            for side in sides
        )
        return float(into), float(-out)
