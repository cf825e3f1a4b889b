"""Gauss-Legendre quadrature over wavenumbers, in equal steps of ln q between kinks."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fem_seal.errors import InvalidInput

# Points in each cell; integrates polynomials in ln q of degree 7.
POINTS = 4
# Halvings of a cell towards an integrable singularity at its lower edge.
HALVINGS = 60


@dataclass(frozen=True, eq=False)
class Cumulative:
    """A running integral from the lowest wavenumber.

    at_edges : (n + 1,) at the cells' edges; at_nodes : (n, POINTS) at the quadrature points
    """

    at_edges: np.ndarray
    at_nodes: np.ndarray


@dataclass(frozen=True, eq=False)
class LogGrid:
    """Cells in ln q with their quadrature points.

    edges : (n + 1,) [1/m]
    nodes, weights : (n, POINTS) [1/m], for integrals dq
    """

    edges: np.ndarray
    nodes: np.ndarray
    weights: np.ndarray

    def cumulative(self, integrand: Callable[[np.ndarray], np.ndarray]) -> Cumulative:
        """Integrate from the lowest edge up to every edge and every node.

        Parameters
        ----------
        integrand : function of q [1/m], vectorised, smooth inside cells
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
    wavenumbers : beginning, kinks and end, in order [1/m]; equal ones count once
    cells_per_octave : cells in every factor of two

    Returns
    -------
    LogGrid

    Raises
    ------
    InvalidInput
        If the wavenumbers are not positive and ascending, or span no range.
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
    start, stop : the cell [1/m]

    Returns
    -------
    nodes, weights : (m,) for integrals dq
    inner : (m, POINTS, 2) nodes and weights of integrals from `start` to each node
    """
    t, gauss = np.polynomial.legendre.leggauss(POINTS)
    t, gauss = 0.5 * (t + 1), 0.5 * gauss
    halves = np.log(stop / start) * 0.5 ** np.arange(HALVINGS)
    low, span = 0.5 * halves[:, None], 0.5 * halves[:, None]
    low[-1], span[-1] = 0.0, halves[-1]
    above = (low + span * t).ravel()  # ln(q / start), never by subtraction
    nodes = start * np.exp(above)
    weights = (span * gauss).ravel() * nodes
    inner = start * np.exp(above[:, None] * t)
    return nodes, weights, np.stack([inner, above[:, None] * gauss * inner], axis=-1)


def _gauss(start: np.ndarray, stop: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights (..., POINTS) for ∫ dq from start to stop, Gaussian in ln q."""
    t, weights = np.polynomial.legendre.leggauss(POINTS)
    span = np.log(stop / start)[..., None]
    nodes = start[..., None] * np.exp(0.5 * (t + 1) * span)
    return nodes, 0.5 * span * weights * nodes
