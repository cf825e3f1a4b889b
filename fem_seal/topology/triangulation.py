"""Percolation and critical constriction of a gap that is linear on the triangles of any mesh.

As on a grid (`topology.constriction`), g_c is the largest h at which the vertices with g >= h join
inlet and outlet, here along the edges of the mesh: the set {g >= h} of a gap that is linear on
every triangle is connected in the same way as the vertices it contains.
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fem_seal.topology.constriction import Constriction


def mesh_constriction(
    gap: np.ndarray, points: np.ndarray, edges: np.ndarray, inlet: np.ndarray, outlet: np.ndarray
) -> Constriction | None:
    """Bottleneck of the widest path from inlet to outlet.

    Parameters
    ----------
    gap : (V,) float
        Gap at the vertices [m], zero in contact.
    points : (V, 2) float
        Coordinates of the vertices [m].
    edges : (E, 2) int
        Vertices at the ends of each edge. Vertices at one point (on a seam) must share one number.
    inlet, outlet : (V,) bool
        Vertices on the inlet and on the outlet.

    Returns
    -------
    Constriction, or None if no open path joins inlet and outlet.
    """
    heights = np.unique(gap[gap > 0])
    if heights.size == 0 or not _spanning(gap >= heights[0], edges, inlet, outlet).any():
        return None
    spanning, blocked = 0, len(heights)
    while blocked - spanning > 1:
        middle = (spanning + blocked) // 2
        if _spanning(gap >= heights[middle], edges, inlet, outlet).any():
            spanning = middle
        else:
            blocked = middle
    critical = heights[spanning]
    path = _spanning(gap >= critical, edges, inlet, outlet)
    x, y = points[np.argmax(path & (gap == critical))]
    return Constriction(float(critical), (float(x), float(y)))


def _spanning(
    open_vertices: np.ndarray, edges: np.ndarray, inlet: np.ndarray, outlet: np.ndarray
) -> np.ndarray:
    """(V,) bool: open vertices that edges between open vertices connect to both ends."""
    links = edges[open_vertices[edges].all(axis=1)]
    shape = (len(open_vertices),) * 2
    graph = coo_array((np.ones(len(links), dtype=np.int8), tuple(links.T)), shape=shape)
    component = connected_components(graph, directed=False)[1]
    both = np.intersect1d(component[inlet & open_vertices], component[outlet & open_vertices])
    return open_vertices & np.isin(component, both)
