"""The five-point stencil as a network of resistors between neighbouring samples."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.finite_difference.links import LINKS, LinkRule
from fem_seal.grid import GridField
from fem_seal.registry import choose
from fem_seal.topology import clusters
from fem_seal.topology.lattice import Lattice, lattice


@dataclass(frozen=True, eq=False)
class Network:
    """Conductances between neighbouring nodes of an (mx, my) grid.

    x : (mx - 1, my), node (i, j) to (i + 1, j) [m^3/(Pa s)]
    y : (mx, my - 1) with walls, (mx, my) periodic: node (i, j) to (i, j + 1), the last to column 0
    periodic : whether column my - 1 is linked to column 0

    The nodes of row 0 are held at the inlet's pressure, those of row mx - 1 at the outlet's.
    """

    x: np.ndarray
    y: np.ndarray
    periodic: bool

    @property
    def shape(self) -> tuple[int, int]:
        """Number of nodes (mx, my)."""
        return self.x.shape[0] + 1, self.x.shape[1]


@dataclass(frozen=True, eq=False)
class FlowGrid:
    """A gap's samples joined by links, with the places of the nodes.

    sites : samples of the gap
    network : links between them and to the two ends
    open : (mx, my) bool, nodes that are not in contact
    nodes_x : (mx,) coordinates along the flow, from 0 to Lx [m]
    size : (Lx, Ly) [m]
    """

    sites: Lattice
    network: Network
    open: np.ndarray
    nodes_x: np.ndarray
    size: tuple[float, float]

    @cached_property
    def carrying(self) -> np.ndarray:
        """(mx, my) bool: nodes that a chain of links joins to both ends."""
        labels, count = clusters.label(self.open, "4", self.sites.periodic)
        return clusters.touching(labels, count, labels[0], labels[-1])

    @property
    def unknowns(self) -> int:
        """Number of carrying nodes whose pressure is not given."""
        return int(np.count_nonzero(self.carrying[1:-1]))


def flow_grid(
    gap: GridField, viscosity: float, sides: str, representation: str, links: str
) -> FlowGrid:
    """Lay the five-point stencil over a gap.

    Parameters
    ----------
    gap : gap in metres, zero in contact; points in contact have no links
    viscosity : [Pa s]
    sides : "wall" or "periodic"
    representation : "linear": nodes are the vertices, links on walls have half the width;
        "constant": nodes are the pixels' centres, with half links to inlet and outlet
    links : name of the rule, see `links.LINKS`

    Returns
    -------
    FlowGrid

    Raises
    ------
    InvalidInput
        For an unknown choice, a negative gap, or fewer samples than span an area.
    """
    rule = choose(LINKS, links, "links")
    sites = lattice(gap, sides, representation)
    build = choose(_BUILDERS, representation, "representation")
    return build(sites, rule, 1.0 / (12.0 * viscosity))


def _between(rule: LinkRule, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Mean cubed gap of the links from a to b; contact at either end closes them."""
    return np.where((a > 0) & (b > 0), rule(a, b), 0.0)


def _along_y(sites: Lattice, rule: LinkRule) -> np.ndarray:
    g = sites.gap
    if sites.periodic[1]:
        return _between(rule, g, np.roll(g, -1, axis=1))
    return _between(rule, g[:, :-1], g[:, 1:])


def _vertex_grid(sites: Lattice, rule: LinkRule, fluidity: float) -> FlowGrid:
    """Links between vertices; each is as wide as the two half pixels beside it."""
    g = sites.gap
    if g.shape[0] < 2 or (g.shape[1] < 2 and not sites.periodic[1]):
        raise InvalidInput(
            f"a linear gap needs at least 2 samples along each side, got {g.shape}; "
            "use representation = 'constant' for a single row of pixels"
        )
    dx, dy = sites.spacing
    x = _between(rule, g[:-1], g[1:]) * (fluidity * dy / dx)
    y = _along_y(sites, rule) * (fluidity * dx / dy)
    if not sites.periodic[1]:
        x[:, [0, -1]] *= 0.5
    y[[0, -1]] *= 0.5
    (mx, my), periodic = g.shape, sites.periodic[1]
    size = (mx - 1) * dx, (my if periodic else my - 1) * dy
    return FlowGrid(sites, Network(x, y, periodic), sites.open, dx * np.arange(mx), size)


def _centre_grid(sites: Lattice, rule: LinkRule, fluidity: float) -> FlowGrid:
    """Links between pixel centres, and over half a pixel to the ends."""
    g = sites.gap
    dx, dy = sites.spacing
    inner = _between(rule, g[:-1], g[1:])
    x = np.concatenate([2 * g[:1] ** 3, inner, 2 * g[-1:] ** 3]) * (fluidity * dy / dx)
    y = _along_y(sites, rule) * (fluidity * dx / dy)
    links = Network(x, np.pad(y, ((1, 1), (0, 0))), sites.periodic[1])
    nx, ny = g.shape
    nodes_x = dx * np.concatenate([[0.0], np.arange(nx) + 0.5, [nx]])
    ends_open = np.pad(sites.open, ((1, 1), (0, 0)), mode="edge")
    return FlowGrid(sites, links, ends_open, nodes_x, (nx * dx, ny * dy))


_BUILDERS = {"linear": _vertex_grid, "constant": _centre_grid}
