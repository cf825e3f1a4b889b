"""The primal and the dual problem on one mesh, and their bounds.

With K = g³ (g in units of its maximum), a tensor R that has at least the energy of 1/K on every
admissible stream function (`traces.py`), pressures p_J with jumps J, and stream functions ψ_G with
jumps G (`topology.py`):

    primal    J·A·J = ∫ K|∇p_J|²,       p_J minimises it      (Dirichlet's principle)
    dual      G·B·G = ∫ ∇ψ_G·R·∇ψ_G,    ψ_G minimises it      (Thomson's principle)
              J·C·J = max_G 2 J×G - G·B·G

Between inlet and outlet both jumps are numbers. J = 1 is the pressure drop, J×G = -J G, and

    1 / ∫ ∇ψ·R·∇ψ  =  C  <=  Q  <=  A  =  ∫ K|∇p|².

For a periodic cell they have a component for each of the two seams, J×G = J_x G_y - J_y G_x, and
the tensor A*, which maps the jumps of the pressure to the fluxes through the seams, lies between
the matrices: Dirichlet's principle gives A* <= A for all J at once, since p_J is linear in J;
Thomson's principle in Legendre's form gives C <= A*. Hence C <= A* <= A as quadratic forms, from
two solves each.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain

import numpy as np

from fem_seal.fenicsx import MPI
from fem_seal.flow.bounds import Bounds, excess
from fem_seal.flow.cell_data import ISOTROPIC, CellContact
from fem_seal.flow.energy import Energy, gradients, shape_gradients
from fem_seal.flow.families import (
    Pressures,
    Streams,
    best_flux,
    lower_matrix,
    orthonormal,
    upper_matrix,
)
from fem_seal.flow.gap_on_mesh import GapOnMesh
from fem_seal.flow.hierarchical import BubbleSides, Correction, Drops, energy_drops
from fem_seal.flow.integrals import AT_ONCE
from fem_seal.flow.linear import CellSpace, Minimum
from fem_seal.flow.numbering import Jumps
from fem_seal.flow.solution import CornerValues, FlowEstimate, Flux, SolvedLevel, Start
from fem_seal.flow.topology import dual_numbering, open_cells
from fem_seal.memory import slices
from fem_seal.mesh.bisection import AnyMesh


@dataclass(frozen=True, eq=False)
class CorrectedBounds(Bounds):
    """Bounds after the hierarchical correction."""

    of_pressures: Drops  #: of the energies of the pressures
    of_streams: Drops  #: of the energies of the stream functions


class LevelProblem:
    """Both problems on one mesh (gap in units of its maximum).

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
        self.kept, pressures = open_cells(mesh, data)
        kept = self.kept
        self.data = data.subset(kept)
        self._cell_contact: CellContact = data.without_values()
        self._jumps, self._numberings = pressures.basis, pressures.numberings
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
        for cells in slices(0, self.space.count, AT_ONCE):
            yield cells, *shape_gradients(self.corners(cells))

    def resistivity(self, chi: float, cells: slice) -> np.ndarray:
        """Tensor (n, 3) of the true dual, or of the regularised one if chi > 0."""
        if chi == 0:
            return self.data.resistivity[cells]
        return self.data.subset(cells).regularised(chi, self.gap.cut)

    def gradients(self, corner_values: np.ndarray) -> np.ndarray:
        """Gradient (C, 2) on each cell of the function with corner values (C, 3)."""
        return gradients(shape_gradients(self.corners(slice(None)))[0], corner_values)

    def pressure_correction(self, pressures: Sequence[CornerValues]) -> Correction:
        """Bubble functions for pressures, given by corner values (n, 3) on some of the C cells."""
        place = np.cumsum(self.kept, dtype=np.int32) - np.int32(1)
        return Correction(
            len(pressures),
            lambda cells: [pressure(place[cells]) for pressure in pressures],
            lambda data: data.K,
        )

    def stream_correction(self, streams: Sequence[np.ndarray]) -> Correction:
        """Bubble functions for stream functions, given by values (V,) at the vertices."""
        return Correction(
            len(streams),
            lambda cells: [psi.take(self.mesh.cells.take(cells, axis=0)) for psi in streams],
            lambda data: data.resistivity,
        )

    def start(self, pressure: Pressures, stream: Streams | None) -> Start:
        """Start on this mesh from its solutions; where nothing flows the functions are zero."""
        count = self._jumps.shape[1]
        pressures = np.zeros((count, *self.mesh.cells.shape))
        for corner_values, solved in zip(pressures, pressure.of_unit_jumps(), strict=True):
            corner_values[self.kept] = solved
        streams = np.zeros((count, len(self.mesh.xy))) if stream is None else stream.psi
        return Start(self.mesh, self.values, pressures, streams)

    def guesses(self, start: Start) -> list[np.ndarray]:
        """Initial values (count,) of the unknowns of each pressure of the basis."""
        pressures = start.pressures.compress(self.kept, axis=1)
        return [
            numbering.from_corners(np.tensordot(jump, pressures, axes=1))
            for jump, numbering in zip(self._jumps, self._numberings, strict=True)
        ]

    def pressure(self, guesses: Sequence[np.ndarray]) -> Pressures:
        """Minimise ∫ K|∇p|² for each jump that can drive a flow."""
        # Cells of constant pressure have no energy; in the matrix they would leave rounding errors.
        K = np.where(self.primal_numbering.constant(), 0.0, self.data.K)

        def tensor(cells: slice) -> np.ndarray:
            return K[cells, None] * ISOTROPIC

        # Only between ends is the sum of the residuals the difference of inflow and outflow.
        balanced = bool(self.mesh.inlet.any())
        minima = self.space.minimise(tensor, self._numberings, guesses, self.tolerance, balanced)
        return Pressures(*self._of_family(self._jumps, tensor, minima), minima)

    def stream(self, guess: np.ndarray, chi: float = 0.0) -> Streams | None:
        """Minimise ∫ ∇ψ·R·∇ψ for each jump that contact and blocked cells allow, from (d, V).

        None if they allow no jump. chi > 0: the regularised dual, in which blocked cells conduct
        `chi` times as much as in the primal. Its energy is no bound, but it shows where fluid
        would flow if the blocked cells were resolved.
        """
        dual: Jumps = dual_numbering(self.mesh, self._cell_contact, self.kept, chi == 0)
        if not len(dual.basis):
            return None
        numberings, tensor = dual.numberings, partial(self.resistivity, chi)
        starts = [
            numbering.from_corners((jump @ guess)[self.cells])
            for jump, numbering in zip(dual.basis, numberings, strict=True)
        ]
        minima = self.space.minimise(tensor, numberings, starts, self.tolerance)
        psi = np.zeros((len(minima), len(self.mesh.xy)))
        for cells in slices(0, self.space.count, AT_ONCE):
            psi[:, self.cells[cells]] = [minimum.corners(cells) for minimum in minima]
        return Streams(*self._of_family(dual.basis, tensor, minima), psi, chi)

    def _of_family(
        self, jumps: np.ndarray, tensor: Callable[[slice], np.ndarray], minima: Sequence[Minimum]
    ) -> tuple[np.ndarray, np.ndarray, tuple[Energy, ...], tuple[float, ...], str]:
        """Fields of the `Family` of minimisers for a basis of jumps (k, d)."""
        residuals = tuple(chain.from_iterable(minimum.residuals for minimum in minima))
        stalled = next((minimum.stalled for minimum in minima if minimum.stalled), "")
        totals = tuple(minimum.total for minimum in minima)
        energies = np.diag([total.value for total in totals])
        if len(minima) == 2:
            for cells, slopes, areas in self.batches():
                xx, xy, yy = (areas[:, None] * tensor(cells)).T
                (ax, ay), (bx, by) = (gradients(slopes, v.corners(cells)).T for v in minima)
                mixed = (xx * ax * bx + xy * (ax * by + ay * bx) + yy * ay * by).sum()
                energies[[0, 1], [1, 0]] += mixed
        return jumps, energies, totals, residuals, stalled

    def upper_bound(self, pressure: Pressures) -> Bounds:
        """Bounds from the pressures alone, widened for rounding errors."""
        upper = upper_matrix(pressure, pressure.upper_bound())
        return Bounds(np.zeros_like(upper), upper)

    def excess(self, pressure: Pressures, stream: Streams) -> float:
        """`bounds.excess` of both energies before the correction."""
        return excess(lower_matrix(stream), upper_matrix(pressure))

    def corrected(self, pressure: Pressures, stream: Streams) -> CorrectedBounds:
        """Bounds after the hierarchical correction, widened for rounding errors.

        Each minimiser gets its own bubble functions, so that both families stay linear in their
        jumps, and their energies quadratic forms.
        """
        dual = self.stream_correction([*stream.at_vertices])
        primal = self.pressure_correction([v.corners for v in pressure.minima])
        sides = BubbleSides.of(self.mesh, self._cell_contact, self.kept)
        of_streams, of_pressures = energy_drops(
            self.gap, self.mesh, self.values, (dual, primal), self.space.comm, sides
        )
        return CorrectedBounds(
            lower_matrix(stream, stream.upper_bound(of_streams)),
            upper_matrix(pressure, pressure.upper_bound(of_pressures)),
            of_pressures,
            of_streams,
        )

    def flows(self, pressure: Pressures, stream: Streams) -> list[FlowEstimate]:
        """Flows of pressures that are orthogonal in energy, each with its best flux.

        Two pressures have the energy 1: the direction of smallest conductivity then counts as much
        as the other one, and the error indicators have the sum tr(A⁻¹(A - C)).
        """
        flows = []
        for weights in orthonormal(pressure):
            jump = weights @ pressure.jumps
            drop = float(np.linalg.norm(jump))
            rate = float(jump @ lower_matrix(stream) @ jump) / drop
            # Fluid flows down the pressure.
            psi = -(best_flux(stream) @ jump) @ stream.jumps / rate
            flux = Flux(psi, rate, drop, stream.chi)
            flows.append(FlowEstimate(pressure.combined(weights), flux, psi @ stream.psi))
        return flows


@dataclass(frozen=True, eq=False)
class LevelSolution:
    """One level of the refinement: the best bounds so far and the solutions on this mesh."""

    level: SolvedLevel  #: best bounds so far, and the cost of this level
    problem: LevelProblem  #: the mesh with its numberings
    pressure: Pressures  #: solution of the primal problem
    #: solution of the true dual problem; None if it was not solved, or blocked cells close every
    #: channel
    stream: Streams | None = None
    corrected: CorrectedBounds | None = None  #: bounds on this mesh; None without a stream function
    #: bounds for a gas that slips, if `Stopping.with_slip_bounds` has added them
    slip: Bounds | None = None

    @property
    def stalled(self) -> str:
        """Reason why CG stopped short of its tolerance in the primal or the dual, else ""."""
        return self.pressure.stalled or (self.stream.stalled if self.stream else "")

    def certified(self, guess: np.ndarray | None = None) -> "LevelSolution":
        """The same level with the true dual solved, from stream functions (d, V) of unit jumps.

        By default they are those of the first guess.
        """
        begun = time.perf_counter()
        stream = self.problem.stream(self.problem.mesh.first_guess()[1] if guess is None else guess)
        solved = time.perf_counter()
        level = replace(self.level, seconds=self.level.seconds | {"dual": solved - begun})
        if stream is None:
            return replace(self, level=level)
        corrected = self.problem.corrected(self.pressure, stream)
        level = replace(
            level,
            bounds=corrected.tightened(level.bounds),
            residuals=level.residuals | {"dual": stream.residuals},
            seconds=level.seconds | {"correction": time.perf_counter() - solved},
        )
        return replace(self, level=level, stream=stream, corrected=corrected)
