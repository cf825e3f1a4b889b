"""Meshes of arbitrary straight triangles: the counterpart of `nested` for any shape.

The role of a boundary edge (inlet, outlet, wall) is a label of a side of a cell, not of vertices:
in a corner of the shape an inner edge may have both ends on the same wall. The two banks of a cut
that opens a ring have the same labels as the side walls of a strip, BOTTOM and TOP; `periodic`
distinguishes the two cases.

Refinement is the newest-vertex bisection of the nested family; it starts with the longest edges. A
gap that is linear on the cells is linear on their halves, and the shape keeps its polygonal
boundary.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from fem_seal.mesh.mesh import Edges, Halvings, Mesh, end_slots
from fem_seal.mesh.nested import TooFine

# Labels of sides. BOTTOM and TOP are the two side walls (ψ = 0 and ψ = 1) of a shape whose inlet
# and outlet lie on the same boundary loop, else the two banks of the cut. ISLAND is a wall with
# unknown ψ.
INSIDE, INLET, OUTLET, BOTTOM, TOP, ISLAND = range(6)

# Shortest edge to halve, over the largest coordinate, which rounds at 2^-53.
SHORTEST_EDGE = 2.0**-40


@dataclass(frozen=True, eq=False)
class TriangleMesh(Mesh):
    """A conforming mesh of triangles, counterclockwise."""

    xy: np.ndarray  #: (V, 2), coordinates of the vertices [m]
    #: (C, 3) int32, vertices of the triangles: first that opposite the edge that is halved next,
    #: then the ends of this edge
    cells: np.ndarray
    sides: np.ndarray  #: (C, 3) int8, label of the side opposite each corner
    #: (V,) int32, for a vertex on the TOP bank of a cut the one on the BOTTOM bank at the same
    #: point; for all other vertices the vertex itself
    twin: np.ndarray
    carried_edges: Edges | None = None  #: edges of the mesh, if bisection has already made them

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
        """(V,) bool, vertices of the sides with a label."""
        on_side = np.zeros(len(self.xy), dtype=bool)
        on_side[self.side_ends(self.sides == label)] = True
        return on_side

    def side_ends(self, selected: np.ndarray) -> np.ndarray:
        """(n, 2) vertices at the ends of the selected sides (C, 3) bool."""
        return self.cells.ravel()[end_slots(np.flatnonzero(selected))]

    @property
    def _walls(self) -> list[int]:
        return [ISLAND] if self.periodic else [ISLAND, BOTTOM, TOP]

    def groups(self) -> tuple[tuple[str, np.ndarray], ...]:
        """Names of the boundary groups, each with the vertices (n, 2) of its edges."""
        labels = (("inlet", [INLET]), ("outlet", [OUTLET]), ("wall", self._walls))
        return tuple((name, self.side_ends(np.isin(self.sides, label))) for name, label in labels)

    def wall_ties(self) -> list[np.ndarray]:
        """Pairs (n, 2) of vertices on one wall, where the stream function has one value."""
        return [self.side_ends(self.sides_on_wall())]

    @property
    def rim(self) -> np.ndarray:
        """(V,) bool, vertices where ψ is prescribed, or one unknown with other vertices."""
        on_rim = self.bottom | self.top
        for pairs in self.wall_ties():
            on_rim[pairs] = True
        return on_rim

    def sides_on_wall(self) -> np.ndarray:
        """(C, 3) bool: sides that lie on a wall."""
        return np.isin(self.sides, self._walls)

    def sides_on_top(self) -> np.ndarray:
        """(C, 3) bool: sides on the TOP bank of a cut."""
        return (self.sides == TOP) & self.periodic

    @property
    def blur(self) -> float:
        """Largest coordinate: middles of edges have rounding errors of its size."""
        return float(np.abs(self.xy).max())

    def doubled_areas(self) -> np.ndarray:
        """(C,) float [m^2], twice the area of each triangle, > 0."""
        a, b, c = np.moveaxis(self.xy[self.cells], 1, 0)
        (ux, uy), (vx, vy) = (b - a).T, (c - a).T
        return ux * vy - uy * vx

    @staticmethod
    def midpoints(xy: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Middles (n, 2) [m] of the edges between vertices `ends` (n, 2) with coordinates `xy`.

        TooFine if an edge is so short that rounding would move its middle.
        """
        a, b = xy[ends[:, 0]], xy[ends[:, 1]]
        largest = np.abs(xy).max()
        if (np.abs(a - b).max(axis=1, initial=0.0) < SHORTEST_EDGE * largest).any():
            raise TooFine(f"triangles below 2^-40 of the mesh ({largest:.3g} m) would be needed")
        return (a + b) / 2

    def can_halve_twice(self) -> np.ndarray:
        """(C,) bool, all True: coordinates need not be integers here."""
        return np.ones(len(self.cells), dtype=bool)

    def halved(
        self, xy: np.ndarray, cells: np.ndarray, twin: np.ndarray, edges: Edges, halvings: Halvings
    ) -> Self:
        """Mesh with the arrays that bisection made, and the labels carried to the halves."""
        sides = halvings.carried(self.sides, _halved_labels)
        return replace(self, xy=xy, cells=cells, sides=sides, twin=twin, carried_edges=edges)

    def subset(self, cells: np.ndarray) -> "TriangleMesh":
        """Mesh of the cells (n,) alone, with all vertices."""
        sides = self.sides[cells]
        return replace(self, cells=self.cells[cells], sides=sides, carried_edges=None)

    def first_guess(self) -> tuple[np.ndarray, np.ndarray]:
        """Pressure from the distances to inlet and outlet, and stream function 0, (1, V) each."""
        from scipy.spatial import cKDTree

        to_inlet, to_outlet = (
            cKDTree(self.xy[end]).query(self.xy)[0] for end in (self.inlet, self.outlet)
        )
        return (to_outlet / (to_inlet + to_outlet))[None], np.zeros((1, len(self.xy)))


def _halved_labels(sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Labels (n, 3) of the sides of the first and of the second halves of cells.

    Each half has one side of its parent, half of the side that was cut, and the new inner side.
    """
    cut, b, c = sides.T
    inside = np.full_like(cut, INSIDE)
    return np.stack([c, cut, inside], axis=1), np.stack([b, inside, cut], axis=1)


def longest_edge_first(xy: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Corner (C,) of each triangle opposite its longest edge; the first of equally long ones."""
    corner = xy[cells]
    opposite = corner[:, [2, 0, 1]] - corner[:, [1, 2, 0]]
    length = (opposite**2).sum(axis=2)
    # Edges that are equal up to rounding count as equal, so that rounding cannot decide.
    return np.argmax(length > length.max(axis=1, keepdims=True) * (1 - 1e-9), axis=1)


def turned(values: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Rows (C, 3) rotated cyclically so that entry `first` (C,) comes first."""
    return np.take_along_axis(values, (first[:, None] + np.arange(3)) % 3, axis=1)
