"""The widest path from inlet to outlet, and the height of its tightest gap.

A flat plate that slides along a path must pass its smallest gap, so that the highest plate that
slides from inlet to outlet has the height

    h* = max over the paths P from inlet to outlet of (min over the sites of P of g).

The sites with g >= h join inlet and outlet exactly for h <= h*, and h* is one of the gaps. It is
found by bisection over the gaps. Each step halves the interval of gaps in which h* can lie, but
labelling a large grid costs the same at every step. The last steps therefore work on a small graph,
whose nodes are the sites with a gap in this interval, and the clusters of the sites above it.
"""

from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fem_seal.film import clusters
from fem_seal.film.lattice import Lattice

FEW = 64  # go on with the graph once at most 1/FEW of the sites are in the interval of h*


def highest_spanning(gaps: np.ndarray, spans: Callable[[float], bool]) -> float:
    """Largest gap h at which the sites with a gap >= h still span.

    Parameters
    ----------
    gaps : (n,), gaps of the sites [m], in any order
    spans : maps h [m] to whether the sites with a gap >= h span (or wind around a cell). If they do
        at one h, they do at every smaller h

    Returns
    -------
    float [m]; 0 if they span at none of the gaps.
    """
    return _bisect(gaps, spans, until=0)[0]


def widest_path(sites: Lattice) -> float:
    """Height h* [m] of the highest plate that slides from inlet to outlet; 0 if sealed."""
    # Every path starts on the inlet and ends on the outlet: their largest gaps bound h*.
    largest = min(sites.gap[0].max(), sites.gap[-1].max())

    def spans(h: float) -> bool:
        """Whether the sites with a gap >= h join inlet and outlet."""
        return clusters.joins_ends(sites.gap >= h, sites.connectivity, sites.periodic)

    gaps = sites.gap[(sites.gap > 0) & (sites.gap <= largest)]
    low, high, between = _bisect(gaps, spans, until=sites.gap.size // FEW)
    if not between.size:
        return low
    return max(low, highest_spanning(between, _spans_on_graph(sites, float(between.min()), high)))


def _bisect(
    gaps: np.ndarray, spans: Callable[[float], bool], until: int
) -> tuple[float, float, np.ndarray]:
    """Bisect until at most `until` gaps are left in the interval of h*.

    Returns
    -------
    low, high : the sites span at `low` (0 if that is known of no gap), and not at `high` (or inf)
    between : (m,), the gaps between them
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
        first, second = links[:, lowest >= h]
        ones = np.ones(first.size, dtype=np.int8)
        graph = coo_array((ones, (first, second)), shape=2 * (height.size,))
        component = connected_components(graph, directed=False)[1]
        ends = (component[end[height[end] >= h]] for end in (inlet, outlet))
        return bool(np.intersect1d(*ends).size)

    return spans
