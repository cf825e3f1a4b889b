"""Meshes of arbitrary straight triangles: what `nested` is to a grid, this is to any shape.

The role of every boundary edge (inlet, outlet, wall) is a label of a cell's side, not of its
vertices: in a corner of the shape an edge inside may have both ends on the same wall. Sides along
which the mesh was cut open, so that it can close upon itself (a ring), are labelled as the side
walls of a strip are; `periodic` says which of the two they are.

Refinement is the newest-vertex bisection of the nested family, started from the longest edges. A
gap that is linear on the cells is linear on their halves, and the shape stays the polygon it is.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fem_seal.mesh.edges import Edges, find_edges
from fem_seal.mesh.halvings import Halvings
from fem_seal.mesh.nested import TooFine

# Labels of sides. BOTTOM and TOP: the two side walls (ψ = 0 and ψ = 1) of a shape whose inlet and
# outlet lie on one boundary, else the two banks of the cut. ISLAND: a wall whose ψ is unknown.
INSIDE, INLET, OUTLET, BOTTOM, TOP, ISLAND = range(6)

NARROWEST = 2.0**-40  # of the whole mesh: bisection ends where coordinates would round


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Triangles of any shape, counterclockwise.

    xy : (V, 2) float [m]
    cells : (C, 3) int32, the vertex opposite the edge that is halved first, then the ends of it
    sides : (C, 3) int8, label of the side opposite each corner
    twin : (V,) int32, of a vertex on the TOP bank of a cut the one on the BOTTOM bank, else itself
    carried_edges : if they are known already
    """

    xy: np.ndarray
    cells: np.ndarray
    sides: np.ndarray
    twin: np.ndarray
    carried_edges: Edges | None = None

    @cached_property
    def periodic(self) -> bool:
        """Whether the mesh was cut open, so that the BOTTOM and the TOP sides are one line."""
        return not np.array_equal(self.twin, np.arange(len(self.twin)))

    @cached_property
    def inlet(self) -> np.ndarray:
        """(V,) bool, vertices of inlet sides."""
        return self._vertices_of(INLET)

    @cached_property
    def outlet(self) -> np.ndarray:
        """(V,) bool, vertices of outlet sides."""
        return self._vertices_of(OUTLET)

    @cached_property
    def bottom(self) -> np.ndarray:
        """(V,) bool, vertices of BOTTOM sides."""
        return self._vertices_of(BOTTOM)

    @cached_property
    def top(self) -> np.ndarray:
        """(V,) bool, vertices of TOP sides."""
        return self._vertices_of(TOP)

    def _vertices_of(self, label: int) -> np.ndarray:
        on = np.zeros(len(self.xy), dtype=bool)
        on[self.side_ends(self.sides == label)] = True
        return on

    def ends_of_sides(self) -> np.ndarray:
        """(C, 3, 2) vertices at the ends of the sides opposite to corner 0, 1 and 2."""
        return self.cells[:, [[1, 2], [2, 0], [0, 1]]]

    def side_ends(self, which: np.ndarray) -> np.ndarray:
        """(n, 2) vertices at the ends of the sides that `which` (C, 3) bool selects."""
        cell, side = np.nonzero(which)
        corners = np.stack([(side + 1) % 3, (side + 2) % 3], axis=1)
        return self.cells[cell[:, None], corners]

    def groups(self) -> tuple[tuple[str, np.ndarray], ...]:
        """Names of the boundary groups, each with its edges (n, 2)."""
        walls = [ISLAND] if self.periodic else [ISLAND, BOTTOM, TOP]
        labels = (("inlet", [INLET]), ("outlet", [OUTLET]), ("wall", walls))
        return tuple((name, self.side_ends(np.isin(self.sides, label))) for name, label in labels)

    def wall_ties(self) -> list[np.ndarray]:
        """Pairs (n, 2) of vertices on one wall, where the stream function has one value."""
        walls = [ISLAND] if self.periodic else [ISLAND, BOTTOM, TOP]
        return [self.side_ends(np.isin(self.sides, walls))]

    def sides_on_wall(self) -> np.ndarray:
        """(C, 3) bool: sides that lie on a wall."""
        return np.isin(self.sides, [ISLAND] if self.periodic else [ISLAND, BOTTOM, TOP])

    def sides_on_top(self) -> np.ndarray:
        """(C, 3) bool: sides on the TOP bank of a cut."""
        return (self.sides == TOP) & self.periodic

    @cached_property
    def numbered_edges(self) -> Edges:
        """The edges; one of the TOP bank and its twin are one, with the vertices at BOTTOM."""
        return self.carried_edges or find_edges(self._ends_of_lines(), len(self.xy))

    @property
    def edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (E, 2) of each edge, and the edges (C, 3) opposite to the corners."""
        return self.numbered_edges.ends, self.numbered_edges.of_cell

    def _ends_of_lines(self) -> np.ndarray:
        """(C, 3, 2) ends of the sides, of one on the TOP bank those of its twin."""
        ends = self.ends_of_sides()
        return np.where(self.sides_on_top()[:, :, None], self.twin[ends], ends)

    def points(self, scale: float | np.ndarray, vertices: np.ndarray | None = None) -> np.ndarray:
        """Coordinates (V, 2) or (..., 2) of all or some vertices, times `scale`."""
        return (self.xy if vertices is None else self.xy.take(vertices, axis=0)) * scale

    def doubled_areas(self) -> np.ndarray:
        """(C,) float [m^2], twice the area of each triangle, > 0."""
        a, b, c = np.moveaxis(self.xy[self.cells], 1, 0)
        (ux, uy), (vx, vy) = (b - a).T, (c - a).T
        return ux * vy - uy * vx

    @staticmethod
    def midpoints(xy: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Middles (n, 2) of the edges between `ends` (n, 2), vertices at `xy`.

        Raises
        ------
        TooFine
            If an edge is so short that its middle is a matter of rounding.
        """
        a, b = xy[ends[:, 0]], xy[ends[:, 1]]
        whole = np.abs(xy).max()
        if (np.abs(a - b).max(axis=1, initial=0.0) < NARROWEST * whole).any():
            raise TooFine(f"triangles below 2^-40 of the mesh ({whole:.3g} m) would be needed")
        return (a + b) / 2

    def can_halve_twice(self) -> np.ndarray:
        """(C,) bool: all sides have a middle."""
        return np.ones(len(self.cells), dtype=bool)

    def halved(
        self, xy: np.ndarray, cells: np.ndarray, twin: np.ndarray, edges: Edges, halvings: Halvings
    ) -> "TriangleMesh":
        """The mesh that bisection has made of this one; only labels are left to be carried."""
        return TriangleMesh(xy, cells, halvings.carried(self.sides, _halved_labels), twin, edges)

    def part(self, cells: np.ndarray) -> "TriangleMesh":
        """Some cells (n,), with all vertices."""
        sides = self.sides[cells]
        return replace(self, cells=self.cells[cells], sides=sides, carried_edges=None)

    def first_guess(self) -> tuple[np.ndarray, np.ndarray]:
        """Pressure and stream function (V,) to start the first solve from."""
        from scipy.spatial import cKDTree

        far = [cKDTree(self.xy[end]).query(self.xy)[0] for end in (self.inlet, self.outlet)]
        pressure = far[1] / (far[0] + far[1])
        return pressure, np.zeros(len(self.xy))


def _halved_labels(sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Labels of the sides of both halves: an old side, half of the first one, the new one."""
    first, b, c = sides.T
    inside = np.full_like(first, INSIDE)
    return np.stack([c, first, inside], axis=1), np.stack([b, inside, first], axis=1)


def longest_edge_first(xy: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Which corner of each triangle (C,) is opposite its longest edge; the first one of equals."""
    corner = xy[cells]
    opposite = corner[:, [2, 0, 1]] - corner[:, [1, 2, 0]]
    length = (opposite**2).sum(axis=2)
    # Equal up to rounding, the same edge must be chosen by both of its cells if it can be.
    return np.argmax(length > length.max(axis=1, keepdims=True) * (1 - 1e-9), axis=1)


def turned(values: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Rows (C, 3) turned so that entry `first` (C,) comes first, the order kept."""
    return np.take_along_axis(values, (first[:, None] + np.arange(3)) % 3, axis=1)
