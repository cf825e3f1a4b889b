"""Pressure at the nodes of the network, by a sparse direct solve."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

from fem_seal.film.grid_film import GridFilm
from fem_seal.finite_difference.stencil import Network, flow_grid


def node_pressure(film: GridFilm, pressure_drop: float, links: str = "linear-gap") -> np.ndarray:
    """Pressure [Pa] at the samples of a film, 0 at the outlet, by the five-point stencil.

    NaN where chains of links do not join both ends.
    """
    # The pressure does not depend on the viscosity.
    grid = flow_grid(film, 1.0, links)
    pressure = np.where(grid.carrying, _solved(grid.network, grid.carrying), np.nan)
    if film.representation == "constant":
        pressure = pressure[1:-1]  # the ends are nodes of their own
    return film.sites.on_samples(pressure_drop * pressure)


def _solved(network: Network, carrying: np.ndarray) -> np.ndarray:
    """Pressure at all nodes, 1 at the inlet, 0 at the outlet and where nothing flows."""
    shape, (a, b, link) = network.shape, network.links()
    known = np.zeros(carrying.size)
    known[: shape[1]] = 1.0
    free = carrying.copy()
    free[[0, -1]] = False
    free = free.ravel()
    if not free.any():
        return known.reshape(shape)
    total = np.bincount(a, link, carrying.size) + np.bincount(b, link, carrying.size)
    # Divide the rows by their diagonal: conductances differ by many decades.
    rows, columns = np.concatenate([a, b]), np.concatenate([b, a])
    weights = np.concatenate([link, link])
    used = free[rows] & (weights > 0)
    rows, columns, weights = rows[used], columns[used], weights[used] / total[rows[used]]
    number = np.cumsum(free) - 1
    inner = free[columns]
    unknowns = int(free.sum())
    links = number[rows[inner]], number[columns[inner]]
    off = coo_array((weights[inner], links), (unknowns,) * 2)
    matrix = coo_array((np.ones(unknowns), (np.arange(unknowns),) * 2)) - off
    right_side = np.bincount(
        number[rows[~inner]], weights[~inner] * known[columns[~inner]], unknowns
    )
    known[free] = spsolve(matrix.tocsc(), right_side)
    return known.reshape(shape)
