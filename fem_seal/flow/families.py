"""Minimisers of both problems for a basis of jumps, and the forms A and C of `level.py`."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from fem_seal.flow.energy import SUM_ROUNDING, Energy
from fem_seal.flow.hierarchical import Drops
from fem_seal.flow.linear import Minimum
from fem_seal.flow.solution import CornerValues

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
    # Scale the diagonal to ones: elimination would lose an energy far below another.
    scale = 1 / np.sqrt(energies.diagonal())[:, None]
    return scale * np.linalg.solve(scale * energies * scale.T, scale * _crossing(streams))


def lower_matrix(streams: Streams, energies: np.ndarray | None = None) -> np.ndarray:
    """C (d, d), zero along jumps that no stream function of the family drives."""
    return _crossing(streams).T @ best_flux(streams, energies)


def _crossing(streams: Streams) -> np.ndarray:
    """(k, d): J×G_a = crossing[a]·J for the jumps G_a of the family."""
    return streams.jumps @ _CROSS[streams.jumps.shape[1]].T


def orthonormal(pressures: Pressures) -> np.ndarray:
    """Weights (k, k): each row combines the family into a pressure; two are orthonormal."""
    if len(pressures.energies) == 1:
        return np.ones((1, 1))
    scale = 1 / np.sqrt(pressures.energies.diagonal())
    values, vectors = np.linalg.eigh(scale[:, None] * pressures.energies * scale)
    # Of two pressures that differ by rounding alone one value is rounding, and may be negative.
    values = np.maximum(values, np.finfo(float).eps)
    return (scale[:, None] * vectors / np.sqrt(values)).T
