"""Percolation and critical constriction of a gap that is linear on arbitrary triangles.

The set {gap >= h} of such a gap is connected in the same way as the vertices it contains along
the edges of the mesh, so that a graph of vertices answers both questions exactly.
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fem_seal.topology.constriction import Constriction


def mesh_constriction(
    gap: np.ndarray, points: np.ndarray, edges: np.ndarray, inlet: np.ndarray, outlet: np.ndarray
) -> Constriction | None:
    """Bottleneck of the widest path from inlet to outlet, None if there is no open path.

    Parameters
    ----------
    gap : (V,) [m], zero in contact
    points : (V, 2) [m]
    edges : (E, 2) int, pairs of vertices; vertices that are one point must have one number
    inlet, outlet : (V,) bool
    """
    heights = np.unique(gap[gap > 0])
    if heights.size == 0 or not _joined(gap >= heights[0], edges, inlet, outlet).any():
        return None
    spanning, blocked = 0, len(heights)
    while blocked - spanning > 1:
        middle = (spanning + blocked) // 2
        if _joined(gap >= heights[middle], edges, inlet, outlet).any():
            spanning = middle
        else:
            blocked = middle
    critical = heights[spanning]
    path = _joined(gap >= critical, edges, inlet, outlet)
    where = points[np.argmax(path & (gap == critical))]
    return Constriction(float(critical), (float(where[0]), float(where[1])))


def _joined(
    open_vertices: np.ndarray, edges: np.ndarray, inlet: np.ndarray, outlet: np.ndarray
) -> np.ndarray:
    """(V,) bool: open vertices joined to inlet and outlet through open vertices."""
    links = edges[open_vertices[edges].all(axis=1)]
    shape = (len(open_vertices),) * 2
    graph = coo_array((np.ones(len(links), dtype=np.int8), tuple(links.T)), shape=shape)
    component = connected_components(graph, directed=False)[1]
    both = np.intersect1d(component[inlet & open_vertices], component[outlet & open_vertices])
    return open_vertices & np.isin(component, both)
