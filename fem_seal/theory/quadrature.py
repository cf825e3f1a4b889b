"""Gauss-Legendre quadrature of ∫ f(q) dq over wavenumbers, in cells of equal length in ln q."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fem_seal.errors import InvalidInput

# Quadrature points in each cell; exact for polynomials of degree 7 in ln q.
POINTS = 4
NODES, WEIGHTS = np.polynomial.legendre.leggauss(POINTS)
# Number of halvings of a cell towards an integrable singularity at its lower edge.
HALVINGS = 60


@dataclass(frozen=True, eq=False)
class Cumulative:
    """Integral from the lowest wavenumber up to each edge and each quadrature point."""

    at_edges: np.ndarray  #: (n + 1,), integral up to the edges of the cells
    at_nodes: np.ndarray  #: (n, POINTS), integral up to the quadrature points


@dataclass(frozen=True, eq=False)
class LogGrid:
    """Cells in ln q with their quadrature points."""

    edges: np.ndarray  #: (n + 1,), wavenumbers that bound the cells [1/m]
    nodes: np.ndarray  #: (n, POINTS), quadrature points of ∫ f dq [1/m]
    weights: np.ndarray  #: (n, POINTS), their weights [1/m]

    def cumulative(self, integrand: Callable[[np.ndarray], np.ndarray]) -> Cumulative:
        """Integrate from the lowest edge up to every edge and every node.

        Parameters
        ----------
        integrand : vectorised function of q [1/m], smooth inside each cell
        """
        whole = (integrand(self.nodes) * self.weights).sum(axis=1)
        at_edges = np.concatenate([[0.0], np.cumsum(whole)])
        start = np.broadcast_to(self.edges[:-1, None], self.nodes.shape)
        q, weights = _gauss(start, self.nodes)
        return Cumulative(at_edges, at_edges[:-1, None] + (integrand(q) * weights).sum(axis=-1))


def log_grid(wavenumbers: tuple[float, ...], cells_per_octave: int) -> LogGrid:
    """Divide a range of wavenumbers into cells that end at its kinks.

    Parameters
    ----------
    wavenumbers : smallest wavenumber, kinks of the integrand, and largest wavenumber, ascending
        [1/m]. Repeated values count once
    cells_per_octave : number of cells between a wavenumber and its double
    """
    marks = np.array(wavenumbers, dtype=float)
    if not (marks.size >= 2 and marks[0] > 0 and (np.diff(marks) >= 0).all()):
        raise InvalidInput(f"wavenumbers must be positive and ascending, got {wavenumbers}")
    if marks[0] == marks[-1]:
        raise InvalidInput(f"the spectrum spans no range of wavenumbers: {wavenumbers}")
    edges = [marks[:1]]
    for a, b in pairwise(np.unique(marks)):
        cells = int(np.ceil(np.log2(b / a) * cells_per_octave))
        edges.append(np.geomspace(a, b, cells + 1)[1:])
    edges = np.concatenate(edges)
    nodes, weights = _gauss(edges[:-1], edges[1:])
    return LogGrid(edges, nodes, weights)


def graded_cell(start: float, stop: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Quadrature of one cell whose integrand is singular, like a root or a log, at its lower edge.

    Parameters
    ----------
    start, stop : edges of the cell [1/m]

    Returns
    -------
    nodes, weights : (m,), quadrature points and weights of ∫ f dq over the cell [1/m]
    inner : (m, POINTS, 2), points [..., 0] and weights [..., 1] of the integrals from `start` to
        each node
    """
    t, gauss = 0.5 * (NODES + 1), 0.5 * WEIGHTS
    halves = np.log(stop / start) * 0.5 ** np.arange(HALVINGS)
    low, span = 0.5 * halves[:, None], 0.5 * halves[:, None]
    low[-1], span[-1] = 0.0, halves[-1]
    above = (low + span * t).ravel()  # ln(q / start); ln q - ln start would cancel near 0
    nodes = start * np.exp(above)
    weights = (span * gauss).ravel() * nodes
    inner = start * np.exp(above[:, None] * t)
    return nodes, weights, np.stack([inner, above[:, None] * gauss * inner], axis=-1)


def _gauss(start: np.ndarray, stop: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights (..., POINTS) of ∫ f dq from start to stop, by the Gauss rule in ln q."""
    span = np.log(stop / start)[..., None]
    nodes = start[..., None] * np.exp(0.5 * (NODES + 1) * span)
    return nodes, 0.5 * span * WEIGHTS * nodes
