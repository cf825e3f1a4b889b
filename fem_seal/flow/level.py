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
from functools import partial, reduce
from itertools import chain

import numpy as np

from fem_seal.flow.bounds import Bounds, excess
from fem_seal.flow.cell_data import ISOTROPIC
from fem_seal.flow.energy import SUM_ROUNDING, Energy, gradients
from fem_seal.flow.film_on_mesh import FilmOnMesh
from fem_seal.flow.hierarchical import AppliedBubbles, Drops, energy_drops
from fem_seal.flow.linear import Minimum
from fem_seal.flow.numbering import Jumps
from fem_seal.flow.solution import CornerValues, FlowEstimate, SolvedLevel, Start
from fem_seal.flow.topology import dual_numbering

# J×G = J·_CROSS[d]·G for d components. The pressure rises by J from the outlet to the inlet, but
# by J_x along x across a seam.
_CROSS = {1: np.array([[-1.0]]), 2: np.array([[0.0, 1.0], [-1.0, 0.0]])}


@dataclass(frozen=True, eq=False)
class Family:
    """Minimisers for a basis of jumps."""

    jumps: np.ndarray  #: (k, d), the basis
    energies: np.ndarray  #: (k, k) ∫ ∇v_a·T·∇v_b
    totals: tuple[Energy, ...]  #: the k energies, with bounds of their rounding errors
    residuals: tuple[float, ...]  #: those of all solves, one after the other, as of `Minimum`
    stalled: str  #: reason why CG stopped short of its tolerance in one of the solves, else ""

    def upper_bound(self, drops: Drops | None = None) -> np.ndarray:
        """Upper bound (k, k), as a form, of the energies, less any drops by bubble functions.

        The rounding error of the energy of functions a and b is at most the largest relative error
        of all times √(E_aa E_bb). That of a drop (`Energy.error_of_drop`) is at most the largest
        error relative to the terms of the function, times √(terms_a terms_b). For any combination
        of k functions either sum is at most k times its diagonal part.
        """
        totals, upper = self.totals, self.energies
        relative = max(total.error / total.value for total in totals) + SUM_ROUNDING
        errors = np.array([relative * total.value for total in totals])
        if drops is not None:
            upper = upper - drops.energies
            own = np.array([total.terms for total in totals])
            ratios = (drops.terms / own[:, None]).max(axis=0)
            errors += [total.error_of_drop(*(ratios * total.terms)) for total in totals]
        return upper + len(totals) * np.diag(errors)


@dataclass(frozen=True, eq=False)
class Pressures(Family):
    """Pressures for a basis of jumps."""

    minima: Sequence[Minimum]  #: the k pressures

    def combined(self, weights: np.ndarray) -> CornerValues:
        """Corner values of a combination with weights (k,)."""
        return lambda cells: reduce(
            np.add,
            (w * minimum.corners(cells) for w, minimum in zip(weights, self.minima, strict=True)),
        )

    def of_unit_jumps(self) -> Iterator[np.ndarray]:
        """Corner values (C, 3) of the function of each of the d unit jumps.

        Where the family has fewer functions, only the component along its direction counts.
        """
        return (self.combined(row)(slice(None)) for row in np.linalg.pinv(self.jumps))


@dataclass(frozen=True, eq=False)
class Streams(Family):
    """Stream functions for a basis of jumps, from the true or from the regularised dual."""

    at_vertices: np.ndarray  #: (k, V), their values at the vertices; zero where nothing flows
    chi: float  #: factor χ of the regularised dual; zero in the true dual

    @property
    def psi(self) -> np.ndarray:
        """Values (d, V) at the vertices of the stream functions of unit jumps."""
        return np.linalg.pinv(self.jumps) @ self.at_vertices

    @property
    def conductance(self) -> float:
        """Flow rate between inlet and outlet; of the true dual a lower bound, up to rounding."""
        return lower_matrix(self).item()


def upper_matrix(pressures: Pressures, energies: np.ndarray | None = None) -> np.ndarray:
    """A (d, d): energies of the pressures of unit jumps; from `energies` in place of theirs."""
    # With a single winding w the family has one pressure, of the jump w. A jump J drives J·w/|w|²
    # times its flow; w/|w|² is the pseudo-inverse of that jump.
    basis = np.linalg.pinv(pressures.jumps)
    return basis @ (pressures.energies if energies is None else energies) @ basis.T


def best_flux(streams: Streams, energies: np.ndarray | None = None) -> np.ndarray:
    """Weights (k, d) of the stream functions whose jumps G attain the maximum of C, linear in J."""
    energies = streams.energies if energies is None else energies
    # Scale the diagonal to ones: elimination would lose the small energy beside a large one.
    scale = 1 / np.sqrt(energies.diagonal())[:, None]
    return scale * np.linalg.solve(scale * energies * scale.T, scale * _crossing(streams))


def lower_matrix(streams: Streams, energies: np.ndarray | None = None) -> np.ndarray:
    """C (d, d), zero along jumps that no stream function of the family drives."""
    return _crossing(streams).T @ best_flux(streams, energies)


def _crossing(streams: Streams) -> np.ndarray:
    """(k, d): J×G_a = crossing[a]·J for the jumps G_a of the family."""
    return streams.jumps @ _CROSS[streams.jumps.shape[1]].T


@dataclass(frozen=True, eq=False)
class CorrectedBounds(Bounds):
    """Bounds after the hierarchical correction."""

    lowered: Drops  #: of the energies of the pressures
    raised: Drops  #: of the energies of the stream functions
    bubbles: AppliedBubbles  #: of the stream functions, then of the pressures


@dataclass(frozen=True, eq=False)
class Guess:
    """Initial values of the solves on one mesh."""

    pressures: list[np.ndarray]  #: (count,), unknowns of each pressure of the basis
    streams: np.ndarray  #: (d, V), stream functions of unit jumps at the vertices


class LevelProblem(FilmOnMesh):
    """Both problems on one mesh (gap in units of its maximum)."""

    def start(self, pressure: Pressures, stream: Streams | None) -> Start:
        """Start on this mesh from its solutions; where nothing flows the functions are zero."""
        count = self._jumps.shape[1]
        pressures = np.zeros((count, *self.mesh.cells.shape))
        for corner_values, solved in zip(pressures, pressure.of_unit_jumps(), strict=True):
            corner_values[self.kept] = solved
        streams = np.zeros((count, len(self.mesh.xy))) if stream is None else stream.psi
        return Start(self.mesh, self.values, pressures, streams)

    def guess(self, start: Start) -> Guess:
        """Initial values of the unknowns."""
        pressures = start.pressures.compress(self.kept, axis=1)
        return Guess(
            [
                numbering.from_corners(np.tensordot(jump, pressures, axes=1))
                for jump, numbering in zip(self._jumps, self._numberings, strict=True)
            ],
            start.streams,
        )

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
        psi = np.array([self._at_vertices(m.numbering, m.values) for m in minima])
        return Streams(*self._of_family(dual.basis, tensor, minima), psi, chi)

    def _of_family(
        self, jumps: np.ndarray, tensor: Callable[[slice], np.ndarray], minima: Sequence[Minimum]
    ) -> tuple[np.ndarray, np.ndarray, tuple[Energy, ...], tuple[float, ...], str]:
        """Fields of the `Family` of minimisers for a basis of jumps (k, d)."""
        residuals = tuple(chain.from_iterable(minimum.residuals for minimum in minima))
        stalled = next((minimum.stalled for minimum in minima if minimum.stalled), "")
        totals = tuple(minimum.total for minimum in minima)
        return jumps, self._energies(tensor, minima), totals, residuals, stalled

    def _energies(
        self, tensor: Callable[[slice], np.ndarray], minima: Sequence[Minimum]
    ) -> np.ndarray:
        """∫ ∇v_a·T·∇v_b (k, k) of k minimisers."""
        energies = np.diag([minimum.energy for minimum in minima])
        if len(minima) < 2:
            return energies
        mixed = 0.0
        for cells, slopes, areas in self.batches():
            xx, xy, yy = (areas[:, None] * tensor(cells)).T
            (ax, ay), (bx, by) = (gradients(slopes, v.corners(cells)).T for v in minima)
            mixed += float((xx * ax * bx + xy * (ax * by + ay * bx) + yy * ay * by).sum())
        return energies + mixed * np.array([[0.0, 1.0], [1.0, 0.0]])

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
        (raised, lowered), bubbles = energy_drops(
            self.gap, self.mesh, self.values, (dual, primal), self.space.comm
        )
        return CorrectedBounds(
            lower_matrix(stream, stream.upper_bound(raised)),
            upper_matrix(pressure, pressure.upper_bound(lowered)),
            lowered,
            raised,
            bubbles,
        )

    def flows(self, pressure: Pressures, stream: Streams) -> list[FlowEstimate]:
        """Flows of pressures that are orthogonal in energy, each with its best flux.

        Two pressures have the energy 1: the direction of smallest conductivity then counts as much
        as the other one, and the error indicators have the sum tr(A⁻¹(A - C)).
        """
        flows = []
        for weights in _orthonormal(pressure):
            jump = weights @ pressure.jumps
            drop = float(np.linalg.norm(jump))
            # Fluid flows down the pressure.
            flux = -(best_flux(stream) @ jump) @ stream.jumps
            rate = float(jump @ lower_matrix(stream) @ jump) / drop
            psi = flux / rate
            flows.append(
                FlowEstimate(
                    pressure.combined(weights), psi @ stream.psi, psi, rate, stream.chi, drop
                )
            )
        return flows


def _orthonormal(pressures: Pressures) -> np.ndarray:
    """Weights (k, k): each row combines the family into a pressure; two are orthonormal."""
    if len(pressures.energies) == 1:
        return np.ones((1, 1))
    scale = 1 / np.sqrt(pressures.energies.diagonal())
    values, vectors = np.linalg.eigh(scale[:, None] * pressures.energies * scale)
    # Of two pressures that differ by rounding alone one value is rounding, and may be negative.
    values = np.maximum(values, np.finfo(float).eps)
    return (scale[:, None] * vectors / np.sqrt(values)).T


@dataclass(frozen=True, eq=False)
class LevelSolution:
    """One level of the refinement: the best bounds so far and the solutions on this mesh."""

    level: SolvedLevel  #: best bounds so far, and the cost of this level
    problem: LevelProblem  #: the mesh with its numberings
    pressure: Pressures  #: solution of the primal problem
    #: solution of the true dual problem; None if it was not solved, or blocked cells close every
    #: channel
    stream: Streams | None
    corrected: CorrectedBounds | None  #: bounds on this mesh; None without a stream function
    #: bounds for a gas that slips, if `Stopping.with_slip_bounds` has added them
    slip: Bounds | None = None

    @property
    def stalled(self) -> str:
        """Reason why CG stopped short of its tolerance in the primal or the dual, else ""."""
        return self.pressure.stalled or (self.stream.stalled if self.stream else "")

    def certified(self) -> "LevelSolution":
        """The same level with the dual solved: the last level must have a lower bound."""
        if self.stream is not None:
            return self
        # The regularised stream function, a nearer start, is not kept with a level.
        _, guess = self.problem.mesh.first_guess()
        begun = time.perf_counter()
        stream = self.problem.stream(guess)
        if stream is None:
            return self
        solved = time.perf_counter()
        corrected = self.problem.corrected(self.pressure, stream)
        bounds = corrected.tightened(self.level.bounds)
        spent = {"dual": solved - begun, "correction": time.perf_counter() - solved}
        level = replace(
            self.level,
            bounds=bounds,
            residuals=self.level.residuals | {"dual": stream.residuals},
            seconds=self.level.seconds | spent,
        )
        return replace(self, level=level, stream=stream, corrected=corrected)
