"""Cutting a ring open, so that it is a strip whose two sides are one line."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from fem_seal.mesh.triangles import BOTTOM, INSIDE, TOP


def shortest_path(
    cells: np.ndarray, sides: np.ndarray, start: np.ndarray, end: np.ndarray
) -> np.ndarray | None:
    """Fewest edges inside the mesh from one loop of vertices to another.

    The path avoids all other boundaries. As it is the shortest, no edge of the mesh but its own
    joins two of its vertices, and this stays so under bisection.

    Parameters
    ----------
    cells, sides : of the mesh
    start, end : vertices of the two loops

    Returns
    -------
    (n,) vertices, or None if there is no such path.
    """
    count = int(cells.max()) + 1
    cell, side = np.nonzero(sides == INSIDE)
    edges = np.stack([cells[cell, (side + 1) % 3], cells[cell, (side + 2) % 3]], axis=1)
    on_rim = np.zeros(count, dtype=bool)
    rim_cell, rim_side = np.nonzero(sides != INSIDE)
    on_rim[cells[rim_cell, (rim_side + 1) % 3]] = True
    allowed = ~on_rim
    allowed[start], allowed[end] = True, True
    edges = edges[allowed[edges].all(axis=1)]
    # The path leaves from anywhere on the first loop: an extra node stands before all of it.
    source = np.stack([np.full(len(start), count), start], axis=1)
    links = np.concatenate([edges, source])
    shape = (count + 1,) * 2
    graph = coo_array((np.ones(len(links), dtype=np.int8), tuple(links.T)), shape=shape).tocsr()
    order, before = breadth_first_order(graph, count, directed=False)
    reached = order[np.isin(order, end)]
    if reached.size == 0:
        return None
    path = [reached[0]]
    while before[path[-1]] != count:
        path.append(before[path[-1]])
    return np.array(path[::-1])


def cut_open(
    xy: np.ndarray, cells: np.ndarray, sides: np.ndarray, path: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Part the cells along a path of edges from the inlet's loop to the outlet's.

    Seen from the inlet the cells on the left keep the vertices of the path (BOTTOM), those on the
    right get copies (TOP), so that ψ grows to the left of the flow as it does in a strip.

    Parameters
    ----------
    xy, cells, sides : of the mesh
    path : (n,) int, vertices of `shortest_path`

    Returns
    -------
    xy, cells, sides, twin : of the mesh with the copies
    """
    place = np.full(len(xy), -1)
    place[path] = np.arange(len(path))
    near = np.flatnonzero((place[cells] >= 0).any(axis=1))
    of = cells[near]
    slot = np.arange(3 * len(near)).reshape(-1, 3)
    ends = of[:, [[1, 2], [2, 0], [0, 1]]]
    along = place[ends[:, :, 1]] - place[ends[:, :, 0]]
    on_path = (place[ends] >= 0).all(axis=2) & (np.abs(along) == 1)
    left, right = on_path & (along == 1), on_path & (along == -1)
    sides = sides.copy()
    for which, label in ((left, BOTTOM), (right, TOP)):
        cell, side = np.nonzero(which)
        sides[near[cell], side] = label
    bank = _joined_corners(slot, ends, on_path)
    corners = slot[np.arange(len(near))[:, None, None], [[1, 2], [2, 0], [0, 1]]]
    to_right = np.isin(bank, bank[corners[right].ravel()]).reshape(-1, 3) & (place[of] >= 0)
    cells = cells.copy()
    cells[near] = np.where(to_right, len(xy) + place[of], of)
    twin = np.concatenate([np.arange(len(xy)), path])
    return np.concatenate([xy, xy[path]]), cells, sides, twin


def _joined_corners(slot: np.ndarray, ends: np.ndarray, on_path: np.ndarray) -> np.ndarray:
    """Component of each corner slot: corners at one vertex, joined through sides off the path."""
    cell, side = np.nonzero(~on_path)
    edge = ends[cell, side]
    pair = np.stack([slot[cell, (side + 1) % 3], slot[cell, (side + 2) % 3]], axis=1)
    swap = edge[:, 0] > edge[:, 1]
    edge[swap], pair[swap] = edge[swap][:, ::-1], pair[swap][:, ::-1]
    order = np.lexsort(edge.T)
    same = (edge[order[1:]] == edge[order[:-1]]).all(axis=1)
    links = np.concatenate(
        [np.stack([pair[order[:-1]][same, k], pair[order[1:]][same, k]], 1) for k in (0, 1)]
    )
    count = slot.size
    graph = coo_array((np.ones(len(links), dtype=np.int8), tuple(links.T)), shape=(count, count))
    return connected_components(graph, directed=False)[1]
