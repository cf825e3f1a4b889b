"""The critical constriction: the tightest place on the widest path from inlet to outlet.

A flat plate that slides along a path must be thinner than the smallest gap of that path. The
thickest plate that slides from inlet to outlet has the critical gap

    g_c = max over paths of (min over the path of g)
        = max {h : the points with g >= h join inlet and outlet}.

The second form is exact for the gap as represented: the set {g >= h} of a piecewise linear gap is
connected in the same way as the vertices it contains. Next to closing the leak rate is governed by
this one place (W. B. Dapp, M. H. Müser, Sci. Rep. 6, 19513 (2016)).

g_c is one of the gaps of the samples, and is found by bisection over them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_seal.film import clusters
from fem_seal.film.lattice import Lattice


@dataclass(frozen=True)
class CriticalConstriction:
    """The tightest place of the widest path."""

    #: critical gap g_c [m]: a flat plate of this height still passes from inlet to outlet
    gap: float
    position: tuple[float, float]  #: (x, y), a point of the path where the gap is g_c [m]


def critical_constriction(sites: Lattice) -> CriticalConstriction | None:
    """Bottleneck of the widest path from inlet to outlet; None if no open path joins them.

    Of several points of the path with the critical gap it is the first in the order of the sites.
    """
    gap = sites.gap
    # Every path crosses every row.
    in_reach = gap[(gap > 0) & (gap <= gap.max(axis=1).min())]
    critical = highest_spanning(
        in_reach, lambda h: clusters.joins_ends(gap >= h, sites.connectivity, sites.periodic)
    )
    if critical == 0:
        return None
    labels, count = clusters.label(gap >= critical, sites.connectivity, sites.periodic)
    spanning = clusters.on_all_lines(labels, count, labels[0], labels[-1])
    i, j = np.unravel_index(np.argmax(spanning & (gap == critical)), gap.shape)
    (x0, y0), (dx, dy) = sites.origin, sites.spacing
    return CriticalConstriction(critical, (x0 + int(i) * dx, y0 + int(j) * dy))


def highest_spanning(gaps: np.ndarray, spans: Callable[[float], bool]) -> float:
    """Largest gap h [m] at which the sites with a gap >= h still span; 0 if they do at none.

    `gaps` (n,) are those of the sites. If the sites span, or wind around a cell, at one h, they do
    so at every smaller h.
    """
    highest = 0.0
    while gaps.size:
        middle = float(np.partition(gaps, gaps.size // 2)[gaps.size // 2])
        if spans(middle):
            highest, gaps = middle, gaps[gaps > middle]
        else:
            gaps = gaps[gaps < middle]
    return highest
