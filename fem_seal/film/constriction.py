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

from fem_seal.film import clusters
from fem_seal.film.lattice import Lattice
from fem_seal.film.widest_path import widest_path


@dataclass(frozen=True)
class CriticalConstriction:
    """The tightest place of the widest path."""

    #: critical gap g_c [m]: a flat plate of this height still passes from inlet to outlet
    gap: float
    position: tuple[float, float]  #: (x, y), a point of the path where the gap is g_c [m]


def critical_constriction(sites: Lattice) -> CriticalConstriction | None:
    """Bottleneck of the widest path from inlet to outlet; None if no open path joins them.

    Where several points of the widest path have the critical gap, the first in the order of the
    sites is returned.
    """
    critical = widest_path(sites)
    if critical == 0:
        return None
    i, j = _tightest_site(sites, critical)
    (x0, y0), (dx, dy) = sites.origin, sites.spacing
    return CriticalConstriction(critical, (x0 + i * dx, y0 + j * dy))


def _tightest_site(sites: Lattice, critical: float) -> tuple[int, int]:
    """First site with the critical gap in the clusters of {g >= g_c} that join the two ends."""
    labels, count = clusters.label(sites.gap >= critical, sites.connectivity, sites.periodic)
    spanning = clusters.touching(labels, count, labels[0], labels[-1])
    i, j = np.unravel_index(np.argmax(spanning & (sites.gap == critical)), spanning.shape)
    return int(i), int(j)
