"""The network for the fluid's pressure: on the contact's own grid, a finer or a coarser one.

The network of level k has 2^k times as many nodes along each side as the contact has samples. Two
sparse matrices join both grids: gaps are interpolated from the samples to the nodes the way the
film is read between its samples, and pressures from the nodes to the samples.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from fem_seal.film.grid_film import GridFilm
from fem_seal.finite_difference.links import LINKS
from fem_seal.finite_difference.stencil import flow_grid
from fem_seal.grid import GridField


@dataclass(frozen=True, eq=False)
class PressureGrid:
    """Nodes and links of a network, and how they are joined to the samples of a contact."""

    shape: tuple[int, int]  #: samples of the contact
    nodes: tuple[int, int]  #: the first row has the inlet's pressure, the last the outlet's
    ends: np.ndarray  #: (2, number of links), nodes at the two ends of each link
    weight: np.ndarray  #: width of each link over its length
    rule: str  #: name of the mean of g³ along a link, see `links.LINKS`
    to_nodes: sparse.csr_array  #: gap at the nodes from that at the samples
    to_samples: sparse.csr_array  #: pressure at the samples from that at the nodes

    @classmethod
    def of(cls, film: GridFilm, rule: str, level: int = 0) -> "PressureGrid":
        """Network of a level for all films on the grid of this one.

        Parameters
        ----------
        level
            If negative, the numbers of samples must be divisible by 2^-level.
        """
        (nx, ny), (dx, dy) = film.gap.shape, film.gap.spacing
        fine, coarse = 2 ** max(level, 0), 2 ** max(-level, 0)
        mx, my = nx * fine // coarse, ny * fine // coarse
        spacing = dx * coarse / fine, dy * coarse / fine
        flat = GridField(np.ones((mx, my)), spacing, film.gap.periodic)
        network = flow_grid(GridFilm(flat, film.sides, film.representation), 1 / 12, rule).network
        periodic = film.sides == "periodic"
        if film.representation == "linear":
            to_nodes = _vertices_of_samples(nx, ny, film.gap.periodic, periodic)
            rows = nx + film.gap.periodic
            columns = ny + (film.gap.periodic and not periodic)
            for _ in range(level):
                to_nodes = _refined(rows, columns, periodic) @ to_nodes
                rows, columns = 2 * rows - 1, 2 * columns - (not periodic)
            if level < 0:
                kept = np.arange(rows * columns).reshape(rows, columns)[::coarse, ::coarse]
                to_nodes = to_nodes[kept.ravel()]
            along, across = (
                _at(np.arange(n) * fine / coarse, m, wraps)
                for n, m, wraps in zip((nx, ny), network.shape, (False, periodic), strict=True)
            )
        else:
            shares = [_pixels(n, fine, coarse) for n in (nx, ny)]
            first, last = shares[0][:1], shares[0][-1:]
            to_nodes = sparse.kron(sparse.vstack([first, shares[0], last]), shares[1], "csr")
            centres = [(np.arange(n) + 0.5) * fine / coarse for n in (nx, ny)]
            # The ends are nodes of their own, half a pixel from the first and the last centre.
            place = np.clip(centres[0] - 0.5, -0.5, mx - 0.5)
            place = np.where(
                place < 0, 1 + 2 * place, np.where(place > mx - 1, 2 * place - mx + 2, place + 1)
            )
            along = _at(place, mx + 2, False)
            across = _at(centres[1] - 0.5, my, periodic)
        node = np.arange(network.x.size + network.x.shape[1]).reshape(network.shape)
        right = np.roll(node, -1, axis=1) if periodic else node[:, 1:]
        left = node[:, : network.y.shape[1]]
        ends = [np.append(node[:-1], left), np.append(node[1:], right)]
        weight = np.append(network.x, network.y)
        used = weight > 0
        return cls(
            shape=(nx, ny),
            nodes=network.shape,
            ends=np.stack(ends)[:, used],
            weight=weight[used],
            rule=rule,
            to_nodes=sparse.csr_array(to_nodes),
            to_samples=sparse.csr_array(sparse.kron(along, across, "csr")),
        )

    def conductances(self, gap: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Conductances of the links with a gap at the nodes, times 12 η, and their derivatives.

        Returns
        -------
        (links,) and (2, links), the derivatives by the gaps at both ends
        """
        rule, step = LINKS[self.rule], 1e-5
        a, b = gap[self.ends]
        by_ends = [
            (rule(a * (1 + step), b) - rule(a * (1 - step), b)) / (2 * step * a),
            (rule(a, b * (1 + step)) - rule(a, b * (1 - step))) / (2 * step * b),
        ]
        return self.weight * rule(a, b), self.weight * np.stack(by_ends)


def _vertices_of_samples(
    nx: int, ny: int, periodic_gap: bool, periodic_sides: bool
) -> sparse.csr_array:
    """Vertices of a film from its samples: the first row and column end a periodic gap."""
    i = np.arange(nx + periodic_gap) % nx
    j = np.arange(ny + (periodic_gap and not periodic_sides)) % ny
    column = (i[:, None] * ny + j).ravel()
    rows = np.arange(column.size)
    return sparse.csr_array((np.ones(column.size), (rows, column)), (column.size, nx * ny))


def _refined(rows: int, columns: int, periodic: bool) -> sparse.csr_array:
    """Vertices of half the spacing, linear on the triangles of the pixels: `GridField.refined`."""
    fine = 2 * rows - 1, 2 * columns - (not periodic)
    i, j = (index.ravel() for index in np.indices(fine))
    a, b = i // 2, j // 2
    # A new vertex lies midway between two old ones, which differ by a step along each odd index;
    # in the middle of a pixel they are the ends of its diagonal.
    falling = (i % 2 == 1) & (j % 2 == 1) & ((a + b) % 2 == 1)
    first = a * columns + np.where(falling, b + 1, b) % columns
    second = (a + i % 2) * columns + np.where(falling, b, b + j % 2) % columns
    row = np.arange(i.size)
    half = np.full(i.size, 0.5)
    entries = np.append(half, half), (np.append(row, row), np.append(first, second))
    return sparse.csr_array(entries, (i.size, rows * columns))


def _pixels(count: int, fine: int, coarse: int) -> sparse.csr_array:
    """Pixels of another size: parts of the old ones, or means over several."""
    own = np.arange(count * max(fine, 1))
    row, column = own // coarse, own // fine
    return sparse.csr_array(
        (np.full(own.size, 1 / coarse), (row, column)), (count * fine // coarse, count)
    )


def _at(places: np.ndarray, nodes: int, wraps: bool) -> sparse.csr_array:
    """Values at places between nodes 0, 1, 2, ... along one axis, linear between the nodes."""
    below = np.floor(places).astype(int)
    part = places - below
    ends = [below, below + 1]
    ends = [end % nodes if wraps else np.clip(end, 0, nodes - 1) for end in ends]
    row = np.arange(places.size)
    entries = np.append(1 - part, part), (np.append(row, row), np.append(*ends))
    matrix = sparse.csr_array(entries, (places.size, nodes))
    matrix.eliminate_zeros()
    return matrix
