"""Newest-vertex bisection on arrays: refinement that never leaves the nested family.

A triangle is only ever cut from its right angle to the middle of its hypotenuse (Mitchell, ACM
Trans. Math. Softw. 15, 326 (1989)). Cutting a hypotenuse that is a leg of the neighbour forces the
neighbour to be cut first; this closure ends because the starting mesh pairs up all hypotenuses.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.mesh.nested import NestedMesh, TooFine
from fem_seal.mesh.triangles import TriangleMesh

__all__ = ["Refinement", "TooFine", "bisect"]


@dataclass(frozen=True, eq=False)
class Refinement:
    """A refined mesh and where it came from.

    mesh : the finer mesh; its first vertices are those of the coarser one
    parent : (C',) int32, the coarse cell each fine cell lies in
    halvings : two steps, each with the cell every cell of the next mesh comes from, and the
        places of the first halves (middle, a, b); the other half (middle, c, a) follows next
    edge_ends : (V' - V, 2) int32: the coarse vertices each new vertex lies midway between
    """

    mesh: NestedMesh | TriangleMesh
    parent: np.ndarray
    halvings: tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
    edge_ends: np.ndarray

    def prolong(self, corner_values: np.ndarray) -> np.ndarray:
        """Carry corner values (C, 3) of a function linear on each coarse cell to (C', 3)."""
        for source, first in self.halvings:
            a, b, c = corner_values[source[first]].T
            middle = (b + c) / 2
            corner_values = corner_values[source]
            corner_values[first] = np.stack([middle, a, b], axis=1)
            corner_values[first + 1] = np.stack([middle, c, a], axis=1)
        return corner_values

    def at_vertices(self, values: np.ndarray) -> np.ndarray:
        """Carry values (V, ...) at the coarse vertices to (V', ...): linear on each edge."""
        a, b = self.edge_ends.T
        return np.concatenate([values, (values[a] + values[b]) / 2])


def bisect(mesh: NestedMesh | TriangleMesh, marked: np.ndarray) -> Refinement:
    """Halve the marked triangles, and those that must follow for the mesh to stay conforming.

    Parameters
    ----------
    mesh : of the nested family, or of any triangles
    marked : (C,) bool

    Returns
    -------
    Refinement

    Raises
    ------
    TooFine
        If a triangle would become narrower than the integer coordinates can hold.
    """
    ends, of_cell = mesh.edges
    cut = _closure(of_cell, marked, len(ends))
    middle, xy, twin, edge_ends = _new_vertices(mesh, ends, of_cell, cut)
    cells, parent, first = _halve(mesh.cells, middle[:, 0])
    # A leg of the parent is the hypotenuse of a child, and may be cut as well.
    leg = np.full(len(cells), -1, dtype=np.int32)
    leg[first], leg[first + 1] = middle[parent[first], 2], middle[parent[first], 1]
    cells, child, first_of_half = _halve(cells, leg)
    halvings = ((parent, first), (child, first_of_half))
    fine = mesh.halved(xy, cells, twin, halvings)
    return Refinement(fine, parent[child], halvings, edge_ends)


def _closure(of_cell: np.ndarray, marked: np.ndarray, edge_count: int) -> np.ndarray:
    """Edges (E,) bool to cut so that no triangle is cut on a leg but not on its hypotenuse."""
    cut = np.zeros(edge_count, dtype=bool)
    hypotenuse, leg, other_leg = of_cell.T
    cut[hypotenuse[marked]] = True
    while True:
        follow = (cut[leg] | cut[other_leg]) & ~cut[hypotenuse]
        if not follow.any():
            return cut
        cut[hypotenuse[follow]] = True


def _new_vertices(
    mesh: NestedMesh | TriangleMesh, ends: np.ndarray, of_cell: np.ndarray, cut: np.ndarray
):
    """Middles of the cut edges, twice where the edge lies on a periodic side.

    Returns
    -------
    middle : (C, 3) int32, new vertex on the edge opposite each corner, -1 where it is not cut
    xy : (V', 2), twin : (V',), of all vertices
    edge_ends : (V' - V, 2)
    """
    number = np.full(len(ends), -1, dtype=np.int32)
    number[cut] = len(mesh.xy) + np.arange(np.count_nonzero(cut))
    middle = number[of_cell]
    new_ends = ends[cut]
    twin = np.concatenate([mesh.twin, number[cut]])
    if mesh.periodic:
        corner_ends = mesh.ends_of_sides()
        at_top = mesh.sides_on_top() & (middle >= 0)
        twin = np.concatenate([twin, middle[at_top]])
        middle[at_top] = len(mesh.xy) + len(new_ends) + np.arange(np.count_nonzero(at_top))
        new_ends = np.concatenate([new_ends, corner_ends[at_top]])
    xy = np.concatenate([mesh.xy, mesh.midpoints(new_ends)])
    return middle, xy, twin, new_ends


def _halve(cells: np.ndarray, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut each cell whose hypotenuse has a new vertex `middle` (-1: none); children stay adjacent.

    Returns
    -------
    cells : (C', 3), source : (C',) the cell each comes from, first : places of the first halves
    """
    is_cut = middle >= 0
    cut = np.flatnonzero(is_cut)
    source = np.repeat(np.arange(len(cells), dtype=np.int32), is_cut + 1)
    first = cut + np.arange(len(cut))
    (a, b, c), m = cells[cut].T, middle[cut]
    halves = cells[source]
    halves[first] = np.stack([m, a, b], axis=1)
    halves[first + 1] = np.stack([m, c, a], axis=1)
    return halves, source, first
