"""The critical constriction: the tightest place on the widest path from inlet to outlet.

A flat plate that slides along a path P must pass its smallest gap. The highest plate that slides
from inlet to outlet has the critical gap

    g_c = max over P of (min over P of g) = max {h : the points with g >= h join inlet and outlet}.

The second form is exact for the gap as represented: the set {g >= h} of a piecewise linear gap is
connected in the same way as the vertices it contains. Near percolation the leak rate is governed by
this one place (W. B. Dapp, M. H. Müser, Sci. Rep. 6, 19513 (2016)).

g_c is one of the gaps of the samples, and is found by bisection over them. Each step halves the
interval of gaps in which g_c can lie, but labelling a large grid costs the same at every step. The
last steps therefore work on a small graph, whose nodes are the sites with a gap in this interval,
and the clusters of the sites above it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_seal.film import clusters
from fem_seal.film.lattice import Lattice
from fem_seal.mesh.grouping import components

# Go on with the graph once at most this part of the sites is in the interval of g_c.
GRAPH_BELOW = 1 / 64


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
    critical = widest_path(sites)
    if critical == 0:
        return None
    places = np.flatnonzero(sites.gap == critical)
    if len(places) > 1:
        labels, count = clusters.label(sites.gap >= critical, sites.connectivity, sites.periodic)
        spanning = clusters.on_all_lines(labels, count, labels[0], labels[-1])
        places = places[spanning.ravel()[places]]
    i, j = np.unravel_index(places[0], sites.gap.shape)
    (x0, y0), (dx, dy) = sites.origin, sites.spacing
    return CriticalConstriction(critical, (x0 + int(i) * dx, y0 + int(j) * dy))


def highest_spanning(gaps: np.ndarray, spans: Callable[[float], bool]) -> float:
    """Largest gap h [m] at which the sites with a gap >= h still span; 0 if they do at none.

    `gaps` (n,) are those of the sites. If the sites span, or wind around a cell, at one h, they do
    so at every smaller h.
    """
    return _bisect(gaps, spans, until=0)[0]


def widest_path(sites: Lattice) -> float:
    """Height g_c [m] of the highest plate that slides from inlet to outlet; 0 if sealed."""
    # Every path starts on the inlet and ends on the outlet: their largest gaps bound g_c.
    largest = min(sites.gap[0].max(), sites.gap[-1].max())

    def spans(h: float) -> bool:
        """Whether the sites with a gap >= h join inlet and outlet."""
        return clusters.joins_ends(sites.gap >= h, sites.connectivity, sites.periodic)

    gaps = sites.gap[(sites.gap > 0) & (sites.gap <= largest)]
    low, high, between = _bisect(gaps, spans, until=int(GRAPH_BELOW * sites.gap.size))
    if not between.size:
        return low
    return max(low, highest_spanning(between, _spans_on_graph(sites, float(between.min()), high)))


def _bisect(
    gaps: np.ndarray, spans: Callable[[float], bool], until: int
) -> tuple[float, float, np.ndarray]:
    """Bisect until at most `until` gaps are left in the interval of g_c.

    Returns its ends and these gaps (m,): the sites span at the lower end (0 if that is known of no
    gap), and not at the higher one (or inf).
    """
    low, high = 0.0, np.inf
    while gaps.size > until:
        middle = float(np.partition(gaps, gaps.size // 2)[gaps.size // 2])
        if spans(middle):
            low, gaps = middle, gaps[gaps > middle]
        else:
            high, gaps = middle, gaps[gaps < middle]
    return low, high, gaps


def _spans_on_graph(sites: Lattice, low: float, high: float) -> Callable[[float], bool]:
    """Function of h, low <= h < high, that returns whether the sites with a gap >= h span.

    The nodes of its graph are the clusters of the sites with a gap >= high, and each site with a
    gap from low to high.
    """
    labels, count = clusters.label(sites.gap >= high, sites.connectivity, sites.periodic)
    between = (sites.gap >= low) & (sites.gap < high)
    height = np.concatenate([np.full(count + 1, np.inf), sites.gap[between]])
    labels[between] = np.arange(count + 1, height.size)
    nodes = labels.reshape(-1)
    pairs = sites.links_of(np.flatnonzero(between))
    links = np.concatenate([nodes[pair] for pair in pairs], axis=1)
    links = links[:, links.all(axis=0)]  # node 0 stands for the sites below `low`
    lowest = height[links].min(axis=0)
    inlet, outlet = (np.unique(row[row > 0]) for row in labels[[0, -1]])

    def spans(h: float) -> bool:
        """Whether an inlet and an outlet node lie in one component of the links open at h."""
        component = components(links[:, lowest >= h].T, height.size)
        ends = (component[end[height[end] >= h]] for end in (inlet, outlet))
        return bool(np.intersect1d(*ends).size)

    return spans
