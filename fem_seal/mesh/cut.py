"""Cutting a ring open into a strip, whose two sides (the banks of the cut) are one line."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order

from fem_seal.graphs import components
from fem_seal.mesh.mesh import (
    BOTTOM,
    INSIDE,
    TOP,
    corner_links,
    end_slots,
    ends_of_sides,
    find_edges,
)


def shortest_path(
    cells: np.ndarray, sides: np.ndarray, start: np.ndarray, end: np.ndarray
) -> np.ndarray | None:
    """Path (n,) of fewest inner edges from one boundary loop of the mesh to another, or None.

    The path avoids all other boundaries. Because it is the shortest, no other edge of the mesh
    joins two of its vertices, and bisection does not change this.
    """
    count = int(cells.max()) + 1
    edges = cells.ravel()[end_slots(np.flatnonzero(sides == INSIDE))]
    allowed = np.ones(count, dtype=bool)
    allowed[cells.ravel()[end_slots(np.flatnonzero(sides != INSIDE))]] = False
    allowed[start], allowed[end] = True, True
    edges = edges[allowed[edges].all(axis=1)]
    # The path may start at any vertex of the first loop: an extra node is linked to all of them.
    source = np.stack([np.full(len(start), count), start], axis=1)
    links = np.concatenate([edges, source])
    shape = (count + 1,) * 2
    graph = coo_array((np.ones(len(links), dtype=np.int8), tuple(links.T)), shape=shape).tocsr()
    order, predecessor = breadth_first_order(graph, count, directed=False)
    reached = order[np.isin(order, end)]
    if reached.size == 0:
        return None
    path = [reached[0]]
    while predecessor[path[-1]] != count:
        path.append(predecessor[path[-1]])
    return np.array(path[::-1])


def cut_open(
    xy: np.ndarray, cells: np.ndarray, sides: np.ndarray, path: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Separate the cells on both sides of a path from the loop of the inlet to that of the outlet.

    Seen from the inlet, the cells on the left keep the n vertices of the path (BOTTOM) and those on
    the right get copies (TOP), so that ψ grows to the left of the flow as it does in a strip. The
    twin (V + n,) of a copy is the vertex that it copies, that of any other vertex the vertex
    itself.
    """
    index = np.full(len(xy), -1)  # index of each vertex in the path; -1 if it is not in it
    index[path] = np.arange(len(path))
    adjacent = np.flatnonzero((index[cells] >= 0).any(axis=1))
    corner = cells[adjacent]
    ends = ends_of_sides(corner)
    along = index[ends[:, :, 1]] - index[ends[:, :, 0]]
    on_path = (index[ends] >= 0).all(axis=2) & (np.abs(along) == 1)
    left, right = on_path & (along == 1), on_path & (along == -1)
    sides = sides.copy()
    for bank, label in ((left, BOTTOM), (right, TOP)):
        cell, side = np.nonzero(bank)
        sides[adjacent[cell], side] = label
    # Sides off the path join the corners at one vertex; those of the right bank are on the right.
    slots = find_edges(ends).slots()
    joining = slots[(slots[:, 1] >= 0) & ~on_path.ravel()[slots[:, 0]]]
    component = components(corner_links(corner.ravel(), joining), corner.size)
    of_bank = component[end_slots(np.flatnonzero(right)).ravel()]
    on_right = np.isin(component, of_bank).reshape(-1, 3)
    cells = cells.copy()
    cells[adjacent] = np.where(on_right & (index[corner] >= 0), len(xy) + index[corner], corner)
    twin = np.concatenate([np.arange(len(xy)), path])
    return np.concatenate([xy, xy[path]]), cells, sides, twin
