"""The critical constriction: the tightest place on the widest path from inlet to outlet.

A flat plate that slides along a path must be thinner than the smallest gap of that path. The
thickest plate that slides from inlet to outlet has the critical gap

    g_c = max over paths of (min over the path of g)
        = max {h : the points with g >= h join inlet and outlet}.

The second form is exact for the gap as represented: the set {g >= h} of a piecewise linear gap is
connected in the same way as the vertices it contains. Next to closing the leak rate is governed by
this one place (W. B. Dapp, M. H. Müser, Sci. Rep. 6, 19513 (2016)).

g_c is one of the gaps of the samples, and is found by bisection over them: first on the sites, then
on a graph in which each cluster of wider sites is one node.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from math import inf

import numpy as np

from fem_seal.film import clusters
from fem_seal.film.lattice import Lattice
from fem_seal.graphs import components

# Part of the sites whose gap may still be g_c when the graph takes their place.
FEW = 1 / 64


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
    critical, left = _bisected(
        in_reach,
        lambda h: clusters.joins_ends(gap >= h, sites.connectivity, sites.periodic),
        few=int(FEW * gap.size),
    )
    if left.size:
        critical = max(critical, highest_spanning(left, _by_graph(sites, left.min(), left.max())))
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
    return _bisected(gaps, spans)[0]


def _bisected(
    gaps: np.ndarray, spans: Callable[[float], bool], few: int = 0
) -> tuple[float, np.ndarray]:
    """The highest of the gaps (n,) [m] tried at which the sites span, and at most few others left.

    One of those may be the highest of all.
    """
    highest = 0.0
    while gaps.size > few:
        middle = float(np.partition(gaps, gaps.size // 2)[gaps.size // 2])
        if spans(middle):
            highest, gaps = middle, gaps[gaps > middle]
        else:
            gaps = gaps[gaps < middle]
    return highest, gaps


def _by_graph(sites: Lattice, low: float, high: float) -> Callable[[float], bool]:
    """Tell whether the sites with a gap of at least h join inlet and outlet, for low <= h <= high.

    Each site with a gap from low to high is a node, and each cluster of wider ones.
    """
    gap, (nx, ny), (_, around) = sites.gap, sites.gap.shape, sites.periodic
    nodes, count = clusters.label(gap > high, sites.connectivity, sites.periodic)
    i, j = np.nonzero((gap >= low) & (gap <= high))
    nodes[i, j] = np.arange(count + 1, count + 1 + len(i))
    height = np.concatenate([np.full(count + 1, inf), gap[i, j]])  # node 0: all lower sites
    pairs = []
    for di, dj in product((-1, 0, 1), repeat=2):
        row, column = i + di, j + dj
        neighbours = (row >= 0) & (row < nx) & (around | ((column >= 0) & (column < ny)))
        if di and dj:
            # A diagonal begins at a vertex (i, j) of its left column with an even i + j.
            even = (i + j if dj > 0 else row + column % ny) % 2 == 0
            neighbours &= even & (sites.connectivity == "triangulation")
        ends = nodes[i, j][neighbours], nodes[row[neighbours], column[neighbours] % ny]
        pairs.append(np.stack(ends, axis=1)[ends[1] > 0])
    links = np.concatenate(pairs)

    def spans(h: float) -> bool:
        within = height >= h
        cluster = components(links[within[links].all(axis=1)], len(height))
        first, last = (cluster[row[(row > 0) & within[row]]] for row in (nodes[0], nodes[-1]))
        return bool(np.isin(first, last).any())

    return spans
