"""The critical constriction: the tightest place on the widest path from inlet to outlet."""

from dataclasses import dataclass

import numpy as np

from fem_seal.grid import GridField
from fem_seal.topology import clusters
from fem_seal.topology.lattice import Lattice, lattice
from fem_seal.topology.percolation import spans


@dataclass(frozen=True)
class Constriction:
    """The tightest place of the widest path.

    gap : largest height that a thin plate crossing from inlet to outlet may have [m]
    position : (x, y) where the gap has that value [m]
    """

    gap: float
    position: tuple[float, float]


def critical_constriction(gap: GridField, sides: str, representation: str) -> Constriction | None:
    """Bottleneck of the widest path from inlet to outlet.

    Bisection over the sorted gaps for the largest h at which the points with gap >= h still join
    inlet and outlet. Exact for the gap as represented: the set {gap >= h} of a piecewise linear
    gap is connected in the same way as the vertices it contains. Near percolation this one place
    governs the leak rate (W. B. Dapp, M. H. Müser, Sci. Rep. 6, 19513 (2016)).

    Parameters
    ----------
    gap : gap in metres, zero in contact
    sides : "wall" or "periodic"
    representation : "linear" or "constant"

    Returns
    -------
    Constriction, or None if the gap is sealed. Where several points share the critical gap one of
    those on the widest path is given.

    Raises
    ------
    InvalidInput
        As in `lattice.lattice`.
    """
    sites = lattice(gap, sides, representation)
    candidates = np.unique(sites.gap[sites.open])
    if candidates.size == 0 or not spans(sites.open, sites.connectivity, sides):
        return None
    # A path has to leave the inlet and reach the outlet: no bottleneck is wider than those.
    widest = min(sites.gap[0].max(), sites.gap[-1].max())
    spanning, blocked = 0, int(np.searchsorted(candidates, widest, side="right"))
    while blocked - spanning > 1:
        middle = (spanning + blocked) // 2
        if spans(sites.gap >= candidates[middle], sites.connectivity, sides):
            spanning = middle
        else:
            blocked = middle
    critical = float(candidates[spanning])
    i, j = _tightest_site(sites, critical)
    (x0, y0), (dx, dy) = sites.origin, sites.spacing
    return Constriction(critical, (x0 + i * dx, y0 + j * dy))


def _tightest_site(sites: Lattice, critical: float) -> tuple[int, int]:
    """First site of the critical gap inside the clusters that just join inlet and outlet."""
    labels, count = clusters.label(sites.gap >= critical, sites.connectivity, sites.periodic)
    joined = clusters.touching(labels, count, labels[0], labels[-1])
    i, j = np.unravel_index(np.argmax(joined & (sites.gap == critical)), joined.shape)
    return int(i), int(j)
