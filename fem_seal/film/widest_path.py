"""The widest path: the height of the highest plate that slides from inlet to outlet.

Along a path the plate must pass the lowest gap, so its height is at most

    h* = max over paths from inlet to outlet of  min over the path's sites of  g.

The sites with g >= h join inlet and outlet exactly for h <= h*, and h* is one of the gaps: it is
found by bisection over the sorted gaps. On a large grid each step halves the gaps in doubt, while
labelling the grid costs the same however few those are. So the last steps go over a graph: the
sites in doubt, and the clusters of the sites above them, each cluster one node.
"""

from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fem_seal.film import clusters
from fem_seal.film.lattice import Lattice

FEW = 64  # the search leaves the grid when the gaps in doubt are fewer than the sites over this


def highest_spanning(gaps: np.ndarray, spans: Callable[[float], bool]) -> float:
    """Largest of some gaps at which a property that larger gaps lose still holds.

    Parameters
    ----------
    gaps : (n,) [m], in any order
    spans : whether the sites with a gap >= h have the property; if they have it at h, then at
        every smaller h as well

    Returns
    -------
    float [m]; 0 if none of the gaps has it.
    """
    return _bisect(gaps, spans, until=0)[0]


def widest_path(sites: Lattice) -> float:
    """Height h* [m] of the highest plate that slides from inlet to outlet, 0 if none does."""
    # A path has to leave the inlet and reach the outlet: h* is at most the largest gap of either.
    most = min(sites.gap[0].max(), sites.gap[-1].max())

    def spans(h: float) -> bool:
        return clusters.joins_ends(sites.gap >= h, sites.connectivity, sites.periodic)

    gaps = sites.gap[(sites.gap > 0) & (sites.gap <= most)]
    low, high, doubtful = _bisect(gaps, spans, until=sites.gap.size // FEW)
    if not doubtful.size:
        return low
    graph = _doubtful_graph(sites, float(doubtful.min()), high)
    return max(low, highest_spanning(doubtful, graph))


def _bisect(
    gaps: np.ndarray, spans: Callable[[float], bool], until: int
) -> tuple[float, float, np.ndarray]:
    """Halve the gaps in doubt until at most `until` are left.

    Returns
    -------
    low : largest gap that is known to span, 0 if none is
    high : least gap that is known not to span, inf if none is
    doubtful : gaps between them
    """
    low, high = 0.0, np.inf
    while gaps.size > until:
        middle = float(np.partition(gaps, gaps.size // 2)[gaps.size // 2])
        if spans(middle):
            low, gaps = middle, gaps[gaps > middle]
        else:
            high, gaps = middle, gaps[gaps < middle]
    return low, high, gaps


def _doubtful_graph(sites: Lattice, low: float, high: float) -> Callable[[float], bool]:
    """Make the function that tells whether the sites with a gap >= h span, low <= h < high.

    Nodes are the clusters of the sites with a gap >= high and, one by one, the sites between.
    """
    labels, count = clusters.label(sites.gap >= high, sites.connectivity, sites.periodic)
    in_doubt = (sites.gap >= low) & (sites.gap < high)
    height = np.concatenate([np.full(count + 1, np.inf), sites.gap[in_doubt]])
    labels[in_doubt] = np.arange(count + 1, height.size)
    nodes, doubtful = labels.reshape(-1), np.flatnonzero(in_doubt)
    links = np.concatenate([nodes[pair] for pair in sites.links_of(doubtful)], axis=1)
    links = links[:, links.all(axis=0)]  # 0 stands for the sites below `low`
    lowest = height[links].min(axis=0)
    inlet, outlet = (np.unique(row[row > 0]) for row in labels[[0, -1]])

    def spans(h: float) -> bool:
        first, second = links[:, lowest >= h]
        ones = np.ones(first.size, dtype=np.int8)
        graph = coo_array((ones, (first, second)), shape=2 * (height.size,))
        component = connected_components(graph, directed=False)[1]
        ends = (component[end[height[end] >= h]] for end in (inlet, outlet))
        return bool(np.intersect1d(*ends).size)

    return spans
