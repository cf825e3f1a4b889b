"""The film on one mesh: its averages, the error indicators, and the hierarchical correction.

The leak rate (`level.py`) and the periodic cell (`cell_problem.py`) share this module: both solve a
primal and a dual problem of the same form, and differ in the functions that they admit.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fem_seal.fenicsx import MPI
from fem_seal.flow.bounds import Bounds
from fem_seal.flow.cell_data import CellContact, CellData
from fem_seal.flow.energy import gradients, shape_gradients
from fem_seal.flow.gap_on_mesh import ConstantGap, GapOnMesh, LinearGap
from fem_seal.flow.hierarchical import (
    Correction,
    energy_drops,
    pressure_bubbles,
    stream_bubbles,
)
from fem_seal.flow.integrals import AT_ONCE
from fem_seal.flow.linear import CellSpace
from fem_seal.flow.numbering import Numbering
from fem_seal.flow.traces import mean_gradient_values
from fem_seal.mesh.bisection import AnyMesh, refine
from fem_seal.mesh.grouping import components, parts
from fem_seal.mesh.nested import NestedMesh

# Pressure drop, relative to that of the whole film, below which equipotential groups count as
# well joined if all the flow passes between them.
MAX_DROP = 0.1

# Corner values (n, 3) of a function on a slice or an array of n cells.
CornerValues = Callable[[slice | np.ndarray], np.ndarray]

# A problem is a `LevelProblem` or, of a tensor, a `CellProblem`, and its solutions and bounds have
# types of their own. Pressures are a `Minimum` or a `Family`, stream functions a `Stream` or a
# `StreamFamily`: all with `residuals` and `stalled`, with `corner_values`, (C, 3) or (2, C, 3), or
# with `psi`, (V,) or (2, V). Bounds are `Bounds` or `MatrixBounds`.
AnyProblem = Any
AnyPressure = Any
AnyStream = Any
AnyBounds = Any


@dataclass(frozen=True, eq=False)
class FlowEstimate:
    """Estimates of one flow through the film: a pressure p, and a flux J that should be -K∇p."""

    pressure: CornerValues  #: corner values (n, 3) of p on a slice of n cells
    #: (V,), stream function ψ of unit flux at the vertices: J = Q (∂ψ/∂y, -∂ψ/∂x), Q the `rate`
    stream: np.ndarray
    rate: float  #: flow rate
    epsilon: float  #: factor ε of the regularised dual that ψ solves; zero for the true dual
    drop: float = 1.0  #: pressure drop
    #: (k,), ψ as a combination of the stream functions that were solved for; None if it is
    #: the only one
    weights: np.ndarray | None = None

    @property
    def conductance(self) -> float:
        """Flow rate at unit pressure drop."""
        return self.rate / self.drop

    def without_functions(self) -> "FlowEstimate":
        """The flow without p and ψ, so that the mesh on which they live can be freed."""
        return replace(self, pressure=_freed, stream=np.empty(0))


def _freed(cells: slice | np.ndarray) -> np.ndarray:
    raise AssertionError("the mesh of this flow has been freed")


@dataclass(frozen=True, eq=False)
class Guess:
    """Initial values of the solves on one mesh, in the form that its problem takes."""

    pressure: np.ndarray  #: initial pressure of the primal problem
    stream: np.ndarray  #: initial stream functions of the dual problems


@dataclass(frozen=True, eq=False)
class Start:
    """A mesh, the gap at its vertices, and functions to start from.

    A leak rate has one pressure and one stream function, a conductivity tensor two of each.
    """

    mesh: AnyMesh  #: mesh to be solved next
    #: (V, n), gap at its vertices, raised and lowered; n = 0 for pixels of constant gap
    values: np.ndarray
    pressures: np.ndarray  #: (k, C, 3), pressures at the corners, since they jump across contact
    streams: np.ndarray  #: (k, V), stream functions at the vertices

    @classmethod
    def first(cls, gap: GapOnMesh, mesh: AnyMesh) -> "Start":
        """Start on the first mesh with the solution of a uniform gap."""
        pressures, streams = map(np.atleast_2d, mesh.first_guess())
        return cls(mesh, gap.vertex_values(mesh), pressures[:, mesh.cells], streams)

    def refined(self, gap: GapOnMesh, times: np.ndarray) -> "Start":
        """Bisect each cell at least `times` (C,) times; prolongate the gap and all functions."""
        step = refine(self.mesh, times)
        values = self.values
        for mesh, edge_ends in step.by_rounds():
            values = gap.refined_values(values, mesh, edge_ends)
        pressures = np.stack([step.prolong(pressure) for pressure in self.pressures])
        streams = np.stack([step.at_vertices(psi) for psi in self.streams])
        return Start(step.mesh, values, pressures, streams)

    def through(self, gap: GapOnMesh) -> "Start":
        """The same mesh and functions, for another gap on the same grid."""
        if isinstance(gap, LinearGap | ConstantGap) and isinstance(self.mesh, NestedMesh):
            return replace(self, values=gap.values_at(self.mesh))
        raise TypeError("only films on a grid share a mesh")


@dataclass(frozen=True)
class SolvedLevel:
    """One mesh of a refinement in the units of the problem, with its bounds and cost."""

    unknowns: int  #: unknowns of the primal problem, for one direction
    cells: int  #: open triangles of the mesh
    bounds: AnyBounds  #: best bounds so far
    residuals: dict[str, tuple[float, ...]] = field(default_factory=dict)  #: as in `Level`
    seconds: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class LevelSolution:
    """One level of the refinement: the best bounds so far and the solutions on this mesh."""

    level: SolvedLevel  #: best bounds so far, and the cost of this level
    problem: AnyProblem  #: the mesh with its numberings
    pressure: AnyPressure  #: solution of the primal problem
    #: solution of the true dual problem; None if it was not solved, or blocked cells close every
    #: channel
    stream: AnyStream | None
    #: bounds for a gas that slips, if a `widen` of the loop has added them
    slip: Bounds | None = None

    @property
    def stalled(self) -> str:
        """Reason why CG stopped short of its tolerance in the primal or the dual, else ""."""
        return self.pressure.stalled or (self.stream.stalled if self.stream else "")

    def certified(self) -> "LevelSolution":
        """The same level with the dual solved: the last level must have a lower bound."""
        if self.stream is not None:
            return self
        _, guess = self.problem.mesh.first_guess()
        stream = self.problem.stream(guess)
        if stream is None:
            return self
        bounds = self.problem.corrected(self.pressure, stream).tightened(self.level.bounds)
        residuals = {**self.level.residuals, "dual": stream.residuals}
        level = replace(self.level, bounds=bounds, residuals=residuals)
        return replace(self, level=level, stream=stream)


class FilmOnMesh:
    """A film on one mesh (gap in units of its maximum): base of the problems of the adaptive loop.

    Arrays of length C run over the cells that carry flow: those of `kept`, (cells of the mesh,)
    bool.
    """

    def __init__(
        self,
        gap: GapOnMesh,
        mesh: AnyMesh,
        values: np.ndarray,
        data: CellData,
        kept: np.ndarray,
        numbering: Numbering,
        comm: MPI.Comm,
        tolerance: float,
    ):
        self.mesh, self.tolerance = mesh, tolerance
        self.gap, self.values = gap, values
        self.kept = kept
        self.data = data.part(kept)
        self._cell_contact: CellContact = data.without_values()
        self.primal_numbering = numbering
        self._cells = triangles = mesh.cells.compress(kept, axis=0)

        # A closure, not a bound method: this avoids a reference cycle, so the mesh is freed at
        # once.
        def corners(cells: np.ndarray | slice) -> np.ndarray:
            return mesh.corners(gap.aspect, triangles[cells])

        self._corners = corners
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

    def start(self, pressure: AnyPressure, stream: AnyStream | None) -> Start:
        """Start on this mesh from its solutions; where nothing flows the functions are zero."""
        solved = np.reshape(pressure.corner_values, (-1, self.space.count, 3))
        pressures = np.zeros((len(solved), *self.mesh.cells.shape))
        pressures[:, self.kept] = solved
        streams = np.zeros((len(solved), len(self.mesh.xy)))
        if stream is not None:
            streams[:] = stream.psi
        return Start(self.mesh, self.values, pressures, streams)

    def _at_vertices(self, numbering: Numbering, values: np.ndarray) -> np.ndarray:
        """Values (V,) at the vertices of a continuous function; zero where nothing flows."""
        at_vertices = np.zeros(len(self.mesh.xy))
        for cells in parts(0, self.space.count, AT_ONCE):
            at_vertices[self._cells[cells]] = numbering.corners(values, cells)
        return at_vertices

    def _resistivity(self, epsilon: float, cells: slice) -> np.ndarray:
        """Tensor (n, 3) of the true dual, or of the regularised one if epsilon > 0."""
        if epsilon == 0:
            return self.data.resistivity[cells]
        return self.data.part(cells).regularised(epsilon, self.gap.cut)

    def indicators(self, flows: Sequence[FlowEstimate]) -> np.ndarray:
        """Error indicators e_T (C,): the part of each cell in upper - lower (Prager and Synge).

        e_T = ∫_T K|∇p|² + J·R·J + 2 J·∇p >= 0, summed over the flows. For the true dual of a leak
        rate Σ e_T = upper - lower exactly. For the regularised dual the sum is off by about 1e-4,
        since ψ in blocked cells does not match the power traces of their neighbours.
        """
        indicators = np.zeros(self.space.count)
        for cells in parts(0, len(indicators), AT_ONCE):
            slopes, areas = shape_gradients(self._corners(cells))
            K, contact = self.data.K[cells], self.data.contact_vertex[cells]
            xx, xy, yy = self._resistivity(flows[0].epsilon, cells).T
            for flow in flows:
                px, py = gradients(slopes, flow.pressure(cells)).T
                psi, Q = flow.stream[self._cells[cells]], flow.rate
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
        slopes, areas = shape_gradients(self._corners(blocked))
        for flow in flows:
            steepness = np.linalg.norm(gradients(slopes, flow.stream[self._cells[blocked]]), axis=1)
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
        side = self.mesh.edges[1].compress(self.kept, axis=0)
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
        for cells in parts(0, len(out), AT_ONCE):
            slopes, areas = shape_gradients(self._corners(cells))
            slope = gradients(slopes, pressure(cells))
            weight = -2 * areas * self.data.K[cells]
            out[cells] = weight[:, None] * (slopes * slope[:, None]).sum(axis=2)
        return out

    def joints(self, leak_rate: float) -> np.ndarray:
        """Cells (C,) bool that join equipotential groups where the gap is too small for the flow.

        All equipotential cells that touch have the same pressure. That is accurate if they share a
        vertex of large gap. Groups that meet only at vertices of small gap may differ in pressure.
        They hardly do if the edges between such vertices, or the vertices themselves (of gap g,
        each conducts about g³), carry the leak rate at a small pressure drop. All other groups are
        wrongly joined, until the cells at these vertices are refined so far that they are no longer
        equipotential.
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
        pressure = self.primal_numbering.of_corner - self.primal_numbering.offset
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
        """Number of each group (n,), equal for groups that edges of small gap join well enough.

        Flow across an edge passes the two cells at its sides, one after the other. A blocked cell
        is partly in contact and lets none pass. `high` (n, 3) are the vertices of large gap.
        """
        count = int(group.max(initial=-1)) + 1
        at_edge = np.flatnonzero(high.sum(axis=1) == 1)
        side = self.mesh.edges[1].compress(self.kept, axis=0)[cells[at_edge]][high[at_edge]]
        order = np.argsort(side, kind="stable")
        twice = np.flatnonzero(np.diff(side[order]) == 0)
        first, second = at_edge[order[twice]], at_edge[order[twice + 1]]
        blocked = self.data.blocked[cells]
        resistivity = np.where(blocked, np.inf, self.data.resistivity[cells, 0])
        conductance = 1 / (resistivity[first] + resistivity[second])
        ends = np.sort(np.stack([group[first], group[second]]), axis=0)
        ends, pair = np.unique(ends, axis=1, return_inverse=True)
        well = np.bincount(pair.ravel(), conductance, ends.shape[1]) >= enough
        return components(ends[:, well].T, count)

    def gradients(
        self, corner_values: np.ndarray, cells: np.ndarray | slice = slice(None)
    ) -> np.ndarray:
        """Gradient (n, 2) on n cells of the function with corner values (n, 3)."""
        return gradients(shape_gradients(self._corners(cells))[0], corner_values)

    def pressure_correction(self, pressures: Sequence[CornerValues]) -> Correction:
        """Bubble functions for pressures; see `_bubble_drops`."""
        place = np.cumsum(self.kept, dtype=np.int32) - np.int32(1)
        return Correction(
            len(pressures),
            pressure_bubbles(self.mesh, self._cell_contact, self.kept),
            lambda cells: [pressure(place[cells]) for pressure in pressures],
            lambda data: data.K,
        )

    def stream_correction(self, streams: Sequence[np.ndarray]) -> Correction:
        """Bubble functions for stream functions; see `_bubble_drops`."""
        return Correction(
            len(streams),
            stream_bubbles(self.mesh, self._cell_contact, self.kept),
            lambda cells: [psi.take(self.mesh.cells.take(cells, axis=0)) for psi in streams],
            lambda data: data.resistivity[:, 0],
        )

    def _bubble_drops(
        self,
        pressures: Sequence[CornerValues],
        streams: Sequence[np.ndarray],
    ) -> tuple[np.ndarray, np.ndarray]:
        """Decreases (k, k), (m, m) by bubbles of the energies of k pressures, m stream functions.

        Pressures are given by corner values (n, 3) on some of the C cells, stream functions by
        values (V,) at the vertices; see `hierarchical.energy_drops`.
        """
        dual, primal = self.stream_correction(streams), self.pressure_correction(pressures)
        gap = self.gap, self.mesh, self.values
        raised, lowered = energy_drops(*gap, (dual, primal), self.space.comm)
        return lowered, raised
