"""Primal and dual problem of a cell that is periodic in both directions, as 2 × 2 matrices.

The tensor A* maps the jumps J of the pressure across the two seams to the fluxes through them.

    primal    J·A·J = ∫ K|∇p_J|²,    p_J minimises it among pressures with jumps J
    dual      G·B·G = ∫ |∇ψ_G|²/K,   ψ_G minimises it among stream functions with jumps G
              J·C·J = max_G 2 J×G - G·B·G,   J×G = J_x G_y - J_y G_x

Dirichlet's principle gives A* <= A for all J at once, since p_J is linear in J; Thomson's
principle in Legendre's form gives C <= A*. Hence C <= A* <= A as quadratic forms, from two solves
each.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain

import numpy as np

from fem_seal.fenicsx import MPI
from fem_seal.flow.bounds import MatrixBounds
from fem_seal.flow.cell_data import ISOTROPIC
from fem_seal.flow.energy import ROUNDING, gradients, shape_gradients
from fem_seal.flow.film_on_mesh import FilmOnMesh
from fem_seal.flow.gap_on_mesh import ConstantGap, LinearGap
from fem_seal.flow.integrals import AT_ONCE
from fem_seal.flow.linear import Minimum
from fem_seal.flow.numbering import Numbering
from fem_seal.flow.solution import CornerValues, FlowEstimate, Guess, Start
from fem_seal.flow.torus import (
    jumps_along,
    open_torus,
    pressure_numbering,
    stream_numbering,
)
from fem_seal.mesh.grouping import parts
from fem_seal.mesh.torus import Torus

_CROSS = np.array([[0.0, 1.0], [-1.0, 0.0]])  # J×G = J·_CROSS·G


@dataclass(frozen=True, eq=False)
class Family:
    """Minimisers for a basis of jumps."""

    jumps: np.ndarray  #: (k, 2), the jumps across both seams
    minima: Sequence[Minimum]  #: the k minimisers
    energies: np.ndarray  #: (k, k) ∫ ∇v_a·T·∇v_b, raised by a bound of its rounding error
    #: factor ε of the regularised dual; zero in the true dual and in the primal
    epsilon: float = 0.0

    @property
    def residuals(self) -> tuple[float, ...]:
        """Those of all solves, one after the other."""
        return tuple(chain.from_iterable(minimum.residuals for minimum in self.minima))

    @property
    def stalled(self) -> str:
        """Reason why CG stopped short of its tolerance in one of the solves, else ""."""
        return next((minimum.stalled for minimum in self.minima if minimum.stalled), "")

    def combined(self, weights: np.ndarray) -> CornerValues:
        """Corner values of a combination with weights (k,)."""
        return lambda cells: sum(
            weight * minimum.corners(cells)
            for weight, minimum in zip(weights, self.minima, strict=True)
        )

    @property
    def corner_values(self) -> np.ndarray:
        """Corner values (2, C, 3) of the functions of unit jumps across x and across y.

        Where the family has fewer functions, only the component along its direction counts.
        """
        return np.array([self.combined(row)(slice(None)) for row in np.linalg.pinv(self.jumps)])


@dataclass(frozen=True, eq=False)
class StreamFamily(Family):
    """Stream functions for a basis of jumps."""

    #: (2, V), values at the vertices of the stream functions of unit jumps across x and across y;
    #: zero where nothing flows
    psi: np.ndarray = field(kw_only=True)


def upper_matrix(pressures: Family) -> np.ndarray:
    """A (2, 2): energies of the pressures of unit jumps across x and across y."""
    # With a single winding w the family has one pressure, of the jump w/|w|². A jump J drives J·w
    # times its flow; w is the pseudo-inverse of that jump.
    basis = np.linalg.pinv(pressures.jumps)
    return basis @ pressures.energies @ basis.T


def best_flux(streams: Family) -> np.ndarray:
    """Weights (k, 2) of the stream functions whose jumps G attain the maximum of C, linear in J."""
    crossing = streams.jumps @ _CROSS.T  # (k, 2): J×G_a = crossing[a]·J
    return np.linalg.solve(streams.energies, crossing) if len(streams.jumps) else crossing


def lower_matrix(streams: Family) -> np.ndarray:
    """C (2, 2), zero along jumps that no stream function of the family drives."""
    return (streams.jumps @ _CROSS.T).T @ best_flux(streams)


class CellProblem(FilmOnMesh):
    """The periodic cell on one mesh, K = g³ (gap in units of its maximum)."""

    mesh: Torus  #: mesh of the torus

    def __init__(
        self,
        gap: LinearGap | ConstantGap,
        mesh: Torus,
        values: np.ndarray,
        comm: MPI.Comm,
        tolerance: float,
    ):
        data = gap.cell_data(mesh, values)
        cells = open_torus(mesh, data)
        numbering = pressure_numbering(mesh, data, cells)
        super().__init__(gap, mesh, values, data, cells.kept, numbering, comm, tolerance)
        self._driving = jumps_along(cells.windings)

    def guess(self, start: Start) -> Guess:
        """Functions (2, C, 3) and (2, V) of unit jumps."""
        return Guess(start.pressures[:, self.kept], start.streams)

    def pressure(self, guess: np.ndarray) -> Family:
        """Minimise ∫K|∇p|² for each jump that can drive a flow.

        The guess (2, C, 3) has the corner values for unit jumps across x and across y.
        """
        crossed = self.mesh.copy[self._cells]
        return self._family(
            lambda cells: self.data.K[cells, None] * ISOTROPIC,
            self.primal_numbering,
            crossed,
            self._driving,
            guess,
        )

    def stream(self, guess: np.ndarray) -> StreamFamily:
        """Minimise ∫|∇ψ|²/K for each jump that contact and blocked cells allow.

        The guess (2, V) has the values at the vertices for unit jumps across x and across y.
        """
        return self._streams(0.0, guess)

    def regularised_stream(self, guess: np.ndarray, epsilon: float) -> StreamFamily:
        """Regularised dual: blocked cells conduct `epsilon` times as much as in the primal."""
        return self._streams(epsilon, guess)

    def _streams(self, epsilon: float, guess: np.ndarray) -> StreamFamily:
        stream = stream_numbering(self.mesh, self._cell_contact, self.kept, epsilon == 0)
        tensor = partial(self._resistivity, epsilon)
        family = self._family(
            tensor, stream.numbering, stream.seams_crossed, stream.jumps, guess[:, self._cells]
        )
        at_vertices = [self._at_vertices(m.numbering, m.values) for m in family.minima]
        psi = np.linalg.pinv(family.jumps) @ np.reshape(at_vertices, (-1, len(self.mesh.xy)))
        return StreamFamily(family.jumps, family.minima, family.energies, epsilon, psi=psi)

    def _family(
        self,
        tensor: Callable[[slice], np.ndarray],
        periodic: Numbering,
        crossed: np.ndarray,
        jumps: np.ndarray,
        guess: np.ndarray,
    ) -> Family:
        numberings = [
            Numbering(periodic.of_corner, crossed @ jump, periodic.count) for jump in jumps
        ]
        starts = [
            numbering.from_corners(np.tensordot(jump, guess, axes=1))
            for jump, numbering in zip(jumps, numberings, strict=True)
        ]
        minima = self.space.minimise(tensor, numberings, starts, self.tolerance)
        return Family(jumps, minima, self._energies(tensor, minima))

    def _energies(
        self, tensor: Callable[[slice], np.ndarray], minima: Sequence[Minimum]
    ) -> np.ndarray:
        """∫ ∇v_a·T·∇v_b (k, k) of k minimisers, raised by a bound of its rounding error."""
        energies = np.zeros((len(minima), len(minima)))
        for cells in parts(0, self.space.count, AT_ONCE):
            slopes, areas = shape_gradients(self._corners(cells))
            T = areas[:, None] * tensor(cells)
            slope = np.array([gradients(slopes, v.corners(cells)) for v in minima])
            flux = np.array([_applied(T, s) for s in slope])
            if len(minima):
                energies += np.tensordot(slope, flux, axes=([1, 2], [1, 2]))
        return _raised(energies, [m.total.error / m.total.value for m in minima])

    def upper_bound(self, pressure: Family) -> MatrixBounds:
        """Bounds from the pressures alone, widened for rounding errors."""
        return MatrixBounds(np.zeros((2, 2)), upper_matrix(pressure)).widened(ROUNDING)

    def difference(self, pressure: Family, stream: Family) -> float:
        """Largest relative difference (u - l)/l of both energies before the correction."""
        return MatrixBounds(lower_matrix(stream), upper_matrix(pressure)).excess

    def corrected(self, pressure: Family, stream: Family) -> MatrixBounds:
        """Bounds after the hierarchical correction, widened for rounding errors.

        Each minimiser gets its own bubble functions, so that both families stay linear in their
        jumps, and their energies quadratic forms.
        """
        lowered, raised = self._bubble_drops(
            [v.corners for v in pressure.minima],
            [self._at_vertices(v.numbering, v.values) for v in stream.minima],
        )
        upper = upper_matrix(_with_bubbles(pressure, lowered))
        lower = lower_matrix(_with_bubbles(stream, raised))
        return MatrixBounds(lower, upper).widened(ROUNDING)

    def flows(self, pressure: Family, stream: StreamFamily) -> list[FlowEstimate]:
        """Flows of two pressures that are orthonormal in energy, each with its best flux.

        The direction of smallest conductivity thus counts as much as the other one: the error
        indicators have the sum tr(A⁻¹(A - C)).
        """
        flows = []
        for weights in _orthonormal(pressure):
            jump = weights @ pressure.jumps
            drop = float(np.linalg.norm(jump))
            # p has the energy rate · drop = 1. Fluid flows down the pressure.
            flux = -(best_flux(stream) @ jump) @ stream.jumps * drop
            flows.append(
                FlowEstimate(
                    pressure.combined(weights),
                    flux @ stream.psi,
                    1 / drop,
                    stream.epsilon,
                    drop,
                    flux,
                )
            )
        return flows


def _raised(energies: np.ndarray, errors: Sequence[float]) -> np.ndarray:
    """Energies (k, k) raised for relative rounding errors of their diagonal (k,).

    The rounding error of entry (a, b) is at most their largest one times √(E_aa E_bb). For any
    combination of at most two functions it is therefore at most twice that times the diagonal part.
    """
    return energies + 2 * max(errors, default=0.0) * np.diag(np.diag(energies))


def _with_bubbles(family: Family, drops: np.ndarray) -> Family:
    """The family after bubble functions have lowered its energies by `drops` (k, k).

    In a combination with weights J the residual of each function a acts on the bubble functions of
    each function b. The rounding errors add up to a multiple of Σ |J_a| |J_b| √(terms_a drop_b)
    (`Energy.error_of_drop`). With the largest ratio of drop to terms in place of each one, this is
    at most twice its diagonal part.
    """
    totals, energies = [minimum.total for minimum in family.minima], family.energies - drops
    ratio = max((d / t.terms for d, t in zip(drops.diagonal(), totals, strict=True)), default=0.0)
    errors = [
        total.error_of_drop(ratio * total.terms) / energy
        for total, energy in zip(totals, energies.diagonal(), strict=True)
    ]
    return replace(family, energies=_raised(energies, errors))


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
