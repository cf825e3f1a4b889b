"""The film on one mesh: its averages, the error indicators, and the hierarchical correction.

What depends on the mesh, not on a solution, and what is estimated from any flow through it; the
problems that are solved are in `level.py`.
"""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from fem_seal.fenicsx import MPI
from fem_seal.flow.cell_data import CellContact
from fem_seal.flow.energy import gradients, shape_gradients
from fem_seal.flow.gap_on_mesh import GapOnMesh
from fem_seal.flow.hierarchical import Correction, pressure_bubbles, stream_bubbles
from fem_seal.flow.integrals import AT_ONCE
from fem_seal.flow.linear import CellSpace
from fem_seal.flow.numbering import Numbering
from fem_seal.flow.solution import CornerValues, FlowEstimate
from fem_seal.flow.topology import open_cells
from fem_seal.flow.traces import mean_gradient_values
from fem_seal.mesh.bisection import AnyMesh
from fem_seal.mesh.grouping import parts


class FilmOnMesh:
    """A film on one mesh (gap in units of its maximum): base of `LevelProblem`.

    Arrays of length C run over the cells that carry flow: those of `kept`, (cells of the mesh,)
    bool.
    """

    def __init__(
        self,
        gap: GapOnMesh,
        mesh: AnyMesh,
        values: np.ndarray,
        comm: MPI.Comm,
        tolerance: float,
    ):
        self.gap, self.mesh, self.values, self.tolerance = gap, mesh, values, tolerance
        data = gap.cell_data(mesh, values)
        carrying = open_cells(mesh, data)
        self.kept = kept = carrying.kept
        self.data = data.subset(kept)
        self._cell_contact: CellContact = data.without_values()
        self._jumps, self._numberings = carrying.pressures.basis, carrying.pressures.numberings
        self.primal_numbering = self._numberings[0]
        self.cells = triangles = mesh.cells.compress(kept, axis=0)

        # A closure, not a bound method: this avoids a reference cycle, so the mesh is freed at
        # once.
        def corners(cells: np.ndarray | slice) -> np.ndarray:
            return mesh.corners(gap.aspect, triangles[cells])

        self.corners = corners
        self.space = CellSpace(
            len(triangles),
            corners,
            lambda: mesh.edges.of_cell.compress(kept, axis=0),
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

    def batches(self) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
        """Batches of n cells with gradients (n, 3, 2) and areas (n,), as of `shape_gradients`."""
        for cells in parts(0, self.space.count, AT_ONCE):
            yield cells, *shape_gradients(self.corners(cells))

    def _at_vertices(self, numbering: Numbering, values: np.ndarray) -> np.ndarray:
        """Values (V,) at the vertices of a continuous function; zero where nothing flows."""
        at_vertices = np.zeros(len(self.mesh.xy))
        for cells in parts(0, self.space.count, AT_ONCE):
            at_vertices[self.cells[cells]] = numbering.corners(values, cells)
        return at_vertices

    def resistivity(self, chi: float, cells: slice) -> np.ndarray:
        """Tensor (n, 3) of the true dual, or of the regularised one if chi > 0."""
        if chi == 0:
            return self.data.resistivity[cells]
        return self.data.subset(cells).regularised(chi, self.gap.cut)

    def indicators(self, flows: Sequence[FlowEstimate]) -> np.ndarray:
        """Error indicators e_T (C,): the part of each cell in upper - lower (Prager and Synge).

        e_T = ∫_T K|∇p|² + Q² ∇ψ·R ∇ψ + 2 J·∇p >= 0 with the flux J = Q (∂ψ/∂y, -∂ψ/∂x), summed over
        the flows. For the true dual of a leak rate Σ e_T = upper - lower exactly. For the
        regularised dual the sum is off by about 1e-4, since ψ in blocked cells does not match the
        power traces of their neighbours.
        """
        indicators = np.zeros(self.space.count)
        for cells, slopes, areas in self.batches():
            K, contact = self.data.K[cells], self.data.contact_vertex[cells]
            xx, xy, yy = self.resistivity(flows[0].chi, cells).T
            for flow in flows:
                px, py = gradients(slopes, flow.pressure(cells)).T
                psi, Q = flow.stream[self.cells[cells]], flow.rate
                sx, sy = gradients(slopes, psi).T
                mx, my = gradients(slopes, mean_gradient_values(psi, contact)).T
                primal = K * (px * px + py * py)
                # Not Q² first: it may underflow.
                dual = Q * (Q * (xx * sx * sx + 2 * xy * sx * sy + yy * sy * sy))
                indicators[cells] += areas * (primal + dual + 2 * Q * (my * px - mx * py))
        return indicators

    def blocked_flux(self, flows: Sequence[FlowEstimate]) -> np.ndarray:
        """Σ |J| × width × pressure drop of each blocked cell (C,); zero in all other cells."""
        flux, blocked = np.zeros(self.space.count), np.flatnonzero(self.data.blocked)
        slopes, areas = shape_gradients(self.corners(blocked))
        for flow in flows:
            steepness = np.linalg.norm(gradients(slopes, flow.stream[self.cells[blocked]]), axis=1)
            flux[blocked] += flow.drop * flow.rate * steepness * np.sqrt(2 * areas)
        return flux

    def residuals(self, flows: Sequence[FlowEstimate]) -> np.ndarray:
        """Residual estimate (C,) of the pressures' error: Σ over sides (jump of the flux)²/K.

        The flux of the exact pressure is continuous across sides and zero through walls and along
        contact. The jump is divided by the K of the cell itself, not by the larger K of the two
        cells: this keeps the estimate reliable where good conductors touch at a single vertex
        (C. Bernardi and R. Verfürth, Numer. Math. 85, 579 (2000); M. Petzoldt, Adv. Comput. Math.
        16, 47 (2002)). There a linear pressure lets fluid leak through the vertex at almost no
        cost in energy. The smallest K to divide by is the conductance of the flow.
        """
        residuals = np.zeros(self.space.count)
        side = self.mesh.edges.of_cell.compress(self.kept, axis=0)
        for flow in flows:
            out = self._flux_out(flow.pressure)
            jump = np.bincount(side.ravel(), out.ravel())[side]
            jump[self.data.zero_gap] = out[self.data.zero_gap]
            # No condition on the flux through sides of prescribed pressure.
            a, b, c = (self.primal_numbering.of_corner < 0).T
            jump[np.stack([b & c, c & a, a & b], axis=1)] = 0.0
            residuals += (jump * jump).sum(axis=1) / np.maximum(self.data.K, flow.conductance)
        return residuals

    def _flux_out(self, pressure: CornerValues) -> np.ndarray:
        """Flux of a pressure out of each cell through its sides (C, 3)."""
        out = np.empty((self.space.count, 3))
        for cells, slopes, areas in self.batches():
            slope = gradients(slopes, pressure(cells))
            weight = -2 * areas * self.data.K[cells]
            out[cells] = weight[:, None] * (slopes * slope[:, None]).sum(axis=2)
        return out

    def gradients(
        self, corner_values: np.ndarray, cells: np.ndarray | slice = slice(None)
    ) -> np.ndarray:
        """Gradient (n, 2) on n cells of the function with corner values (n, 3)."""
        return gradients(shape_gradients(self.corners(cells))[0], corner_values)

    def pressure_correction(self, pressures: Sequence[CornerValues]) -> Correction:
        """Bubble functions for pressures, given by corner values (n, 3) on some of the C cells."""
        place = np.cumsum(self.kept, dtype=np.int32) - np.int32(1)
        return Correction(
            len(pressures),
            partial(pressure_bubbles, self.mesh, self._cell_contact, self.kept),
            lambda cells: [pressure(place[cells]) for pressure in pressures],
            lambda data: data.K,
        )

    def stream_correction(self, streams: Sequence[np.ndarray]) -> Correction:
        """Bubble functions for stream functions, given by values (V,) at the vertices."""
        return Correction(
            len(streams),
            partial(stream_bubbles, self.mesh, self._cell_contact, self.kept),
            lambda cells: [psi.take(self.mesh.cells.take(cells, axis=0)) for psi in streams],
            lambda data: data.resistivity[:, 0],
        )
