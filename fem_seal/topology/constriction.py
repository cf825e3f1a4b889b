"""The critical constriction: the tightest place on the widest path from inlet to outlet.

Its gap g_c is a maximum over the open paths P from inlet to outlet,

    g_c = max over P of (min over P of g) = max {h : the points with g >= h join inlet and outlet},

and it is found by bisection over the values h of the gap's samples. The second form is exact for
the gap as represented: the set {g >= h} of a piecewise linear gap is connected in the same way as
the vertices it contains. Near percolation the leak rate is governed by this one place (W. B. Dapp,
M. H. Müser, Sci. Rep. 6, 19513 (2016)).
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.grid import GridField
from fem_seal.topology import clusters
from fem_seal.topology.lattice import Lattice, lattice
from fem_seal.topology.percolation import spans


@dataclass(frozen=True)
class Constriction:
    """The tightest place of the widest path.

    Attributes
    ----------
    gap : float
        Critical gap g_c [m]: a flat plate of this height still passes from inlet to outlet.
    position : (x, y)
        A point of the path where the gap is g_c [m].
    """

    gap: float
    position: tuple[float, float]


def critical_constriction(gap: GridField, sides: str, representation: str) -> Constriction | None:
    """Bottleneck of the widest path from inlet to outlet.

    Parameters
    ----------
    gap : GridField
        Gap [m], zero in contact.
    sides : "wall" or "periodic"
    representation : "linear" or "constant"

    Returns
    -------
    Constriction, or None if the gap is sealed. Where several points of the widest path have the
    critical gap, the first in the order of the samples is returned.

    Raises
    ------
    InvalidInput
        As in `lattice.lattice`.
    """
    sites = lattice(gap, sides, representation)
    candidates = np.unique(sites.gap[sites.open])
    if candidates.size == 0 or not spans(sites.open, sites.connectivity, sides):
        return None
    # Every path starts on the inlet and ends on the outlet: their largest gaps bound g_c.
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
    """First site with the critical gap in the clusters of {g >= g_c} that join the two ends."""
    labels, count = clusters.label(sites.gap >= critical, sites.connectivity, sites.periodic)
    spanning = clusters.touching(labels, count, labels[0], labels[-1])
    i, j = np.unravel_index(np.argmax(spanning & (sites.gap == critical)), spanning.shape)
    return int(i), int(j)
