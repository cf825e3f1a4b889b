"""The five-point stencil as a network of resistors between neighbouring samples.

The conductance of a link is the mean of K = g³/(12 η) along it, by one of the rules of `links`,
times its width over its length.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from fem_seal.arguments import choose
from fem_seal.film import clusters
from fem_seal.film.grid_film import GridFilm
from fem_seal.film.law import film_conductivity
from fem_seal.finite_difference.links import LINKS


@dataclass(frozen=True, eq=False)
class Stencil:
    """Conductances between neighbouring nodes of an (mx, my) grid.

    The nodes of row 0 have the pressure of the inlet, those of row mx - 1 that of the outlet.
    """

    #: (mx - 1, my), conductance of the link from node (i, j) to (i + 1, j) [m^3/(Pa s)]
    x: np.ndarray
    #: (mx, my - 1) with walls, (mx, my) with periodic sides, conductance of the link from node (i,
    #: j) to (i, j + 1), or from the last column to column 0
    y: np.ndarray
    periodic: bool  #: whether column my - 1 is linked to column 0

    @property
    def shape(self) -> tuple[int, int]:
        """Number of nodes (mx, my)."""
        return self.x.shape[0] + 1, self.x.shape[1]

    def links(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Nodes at both ends of each link, as flat indices, and its conductance."""
        mx, my = self.shape
        node = np.arange(mx * my).reshape(mx, my)
        left, right = node[:, :-1], node[:, 1:]
        if self.periodic:
            left, right = node, np.roll(node, -1, axis=1)
        first = np.concatenate([node[:-1].ravel(), left.ravel()])
        second = np.concatenate([node[1:].ravel(), right.ravel()])
        return first, second, np.concatenate([self.x.ravel(), self.y.ravel()])

    def laplacian(self, carrying: np.ndarray) -> sparse.csr_array:
        """Matrix of links between carrying nodes: Σ_b c_ab on the diagonal, -c_ab off it."""
        a, b, c = self.links()
        used = carrying.ravel()[a] & carrying.ravel()[b] & (c > 0)
        return laplacian(a[used], b[used], c[used], carrying.size)

    def pressure(
        self,
        carrying: np.ndarray,
        solve: Callable[[sparse.csr_array, np.ndarray], np.ndarray],
    ) -> np.ndarray:
        """Pressure (mx, my) from 1 at the inlet to 0 at the outlet; NaN at nodes not `carrying`.

        `solve` takes the matrix of the carrying nodes between the ends, and the right side.
        """
        pressure = np.where(carrying, 0.0, np.nan)
        pressure[0, carrying[0]] = 1.0
        free = np.flatnonzero(carrying[1:-1]) + self.shape[1]
        if free.size:
            matrix = self.laplacian(carrying)
            right_side = -(matrix @ np.nan_to_num(pressure.ravel()))[free]
            pressure.flat[free] = solve(matrix[free][:, free], right_side)
        return pressure


def laplacian(a: np.ndarray, b: np.ndarray, c: np.ndarray, nodes: int) -> sparse.csr_array:
    """Matrix (nodes, nodes) of links c (n,) from a to b: Σ_b c_ab on the diagonal, -c_ab off it."""
    entries = np.tile(c, 2), (np.append(a, b), np.append(b, a))
    links = sparse.csr_array(sparse.coo_array(entries, (nodes, nodes)))
    return sparse.csr_array(sparse.diags(links.sum(axis=1)) - links)


@dataclass(frozen=True, eq=False)
class FlowGrid:
    """Stencil of a gap's samples, and which of its nodes are open."""

    stencil: Stencil  #: links between the samples, and to the two ends
    open: np.ndarray  #: (mx, my) bool, nodes that are not in contact

    @cached_property
    def carrying(self) -> np.ndarray:
        """(mx, my) bool: open nodes that chains of links join to both ends."""
        labels, count = clusters.label(self.open, "4", (False, self.stencil.periodic))
        return clusters.on_all_lines(labels, count, labels[0], labels[-1])

    @property
    def unknowns(self) -> int:
        """Number of carrying nodes between the two ends, whose pressure is unknown."""
        return int(np.count_nonzero(self.carrying[1:-1]))


def flow_grid(film: GridFilm, viscosity: float, link_rule: str) -> FlowGrid:
    """Lay the five-point stencil over a film; for the rules see `links.LINKS`.

    Nodes in contact have no links. A linear gap has its nodes at the vertices, and links as wide as
    the two half pixels beside them. A constant gap has them at the centres of the pixels, and links
    to inlet and outlet have half the length.
    """
    rule, per_cube = choose(LINKS, link_rule, "link_rule"), film_conductivity(1.0, viscosity)
    g, (dx, dy), periodic = film.sites.gap, film.sites.spacing, film.sites.periodic[1]
    nodes, along_x, along_y = g > 0, per_cube * dy / dx, per_cube * dx / dy

    def mean(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Mean of g³ along the links from a to b, zero if either end is in contact."""
        return np.where((a > 0) & (b > 0), rule(a, b), 0.0)

    x = along_x * mean(g[:-1], g[1:])
    y = along_y * (mean(g, np.roll(g, -1, axis=1)) if periodic else mean(g[:, :-1], g[:, 1:]))
    if film.representation == "linear":
        if not periodic:
            x[:, [0, -1]] *= 0.5
        y[[0, -1]] *= 0.5
    else:
        to_ends = 2 * along_x * g[[0, -1]] ** 3
        x = np.concatenate([to_ends[:1], x, to_ends[1:]])
        y = np.pad(y, ((1, 1), (0, 0)))
        nodes = np.pad(nodes, ((1, 1), (0, 0)), mode="edge")
    return FlowGrid(Stencil(x, y, periodic), nodes)
