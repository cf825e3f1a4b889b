"""Base of the meshes that bisection refines: triangles, their edges, and how they are halved.

A side is an edge seen from one of its cells. Edge e has the sides 2 e and 2 e + 1: the edge of side
s is s >> 1, and its other side is s ^ 1. Edges are numbered on the first mesh, then updated by
bisection.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

# Labels of sides, not of vertices: in a corner an inner edge may have both ends on the same wall.
# BOTTOM and TOP are the two side walls (ψ = 0 and ψ = 1), or both sides of a seam: where the sides
# are periodic, or of the cut that opens a ring. ISLAND is a wall with unknown ψ.
INSIDE, INLET, OUTLET, BOTTOM, TOP, ISLAND = range(6)


@dataclass(frozen=True, eq=False)
class Edges:
    """The E edges of C cells."""

    ends: np.ndarray  #: (E, 2) int32, vertices at the ends of each edge
    #: (C, 3) int32, number of the side opposite each corner: 2 e or 2 e + 1 for edge e
    sides: np.ndarray

    @property
    def of_cell(self) -> np.ndarray:
        """(C, 3) int32: the edge opposite each corner."""
        return self.sides >> 1

    def slots(self) -> np.ndarray:
        """(E, 2) int32: both sides of each edge as 3 cell + corner, -1 for an outer side."""
        of_side = np.full(2 * len(self.ends), -1, dtype=np.int32)
        of_side[self.sides.ravel()] = np.arange(self.sides.size, dtype=np.int32)
        return of_side.reshape(-1, 2)


def find_edges(ends: np.ndarray) -> Edges:
    """Number the edges of triangles, given the vertices at the ends of their sides (C, 3, 2).

    On a seam these are the vertices of the twin at the bottom, so that the two sides of an edge
    have the same vertices.
    """
    low, high = ends.min(axis=2).ravel(), ends.max(axis=2).ravel()
    # The sort is stable: it keeps the order of the two sides of an edge.
    order = np.lexsort((high, low))
    low, high = low[order], high[order]
    first = np.ones(len(order), dtype=bool)
    first[1:] = (low[1:] != low[:-1]) | (high[1:] != high[:-1])
    sides = np.empty(len(order), dtype=np.int32)
    sides[order] = 2 * np.cumsum(first, dtype=np.int32) - 1 - first
    return Edges(np.stack([low[first], high[first]], axis=1), sides.reshape(-1, 3))


def ends_of_sides(cells: np.ndarray) -> np.ndarray:
    """Vertices (C, 3, 2) at the ends of the sides opposite the three corners of cells (C, 3)."""
    return cells[:, [[1, 2], [2, 0], [0, 1]]]


def end_slots(slots: np.ndarray) -> np.ndarray:
    """(n, 2) corner slots at the two ends of each side slot."""
    cell, side = slots // 3, slots % 3
    return np.stack([3 * cell + (side + 1) % 3, 3 * cell + (side + 2) % 3], axis=1)


def corner_links(vertex: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Pairs (2 n, 2) of corner slots at one vertex, from the slots (n, 2) of both sides of edges.

    `vertex` has the vertex of each corner slot.
    """
    first, second = end_slots(pairs[:, 0]), end_slots(pairs[:, 1])
    swap = vertex[first[:, 0]] != vertex[second[:, 0]]
    second[swap] = second[swap][:, ::-1]
    return np.stack([first.ravel(), second.ravel()], axis=1)


@dataclass(frozen=True, eq=False)
class Halvings:
    """How C cells (a, b, c) became C' cells by halving, step by step.

    While the cells are halved, a first half (m, a, b) takes the number of its parent, and a second
    half (m, c, a) gets a new number after those of all cells before it.
    """

    #: ((n,), (n,)) int, for each step the cells that were halved, and the numbers of
    #: their second halves
    steps: tuple[tuple[np.ndarray, np.ndarray], ...]
    #: (C',) int32, for each cell of the new mesh its number while halving. In the new mesh the
    #: parts of a cell take its place, so that neighbours in the mesh are neighbours in memory
    order: np.ndarray

    @classmethod
    def of(cls, steps: Sequence[tuple[np.ndarray, np.ndarray]], count: int) -> "Halvings":
        """Order the parts of `count` cells after all steps."""
        total = count + sum(len(second) for _, second in steps)
        # Number of parts of each cell. The second loop reduces it, step by step, to the number of
        # parts of its first half.
        size = np.ones(total, dtype=np.int32)
        for cut, second in reversed(steps):
            size[cut] += size[second]
        place = np.empty(total, dtype=np.int32)
        place[:count] = np.cumsum(size[:count]) - size[:count]
        for cut, second in steps:
            size[cut] -= size[second]
            place[second] = place[cut] + size[cut]
        order = np.empty(total, dtype=np.int32)
        order[place] = np.arange(total, dtype=np.int32)
        return cls(tuple(steps), order)

    def carried(
        self,
        values: np.ndarray,
        halves: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    ) -> np.ndarray:
        """Carry values (C, ...) of the old cells to the new ones, (C', ...).

        `halves` maps values (n, ...) of cells to those of their first and of their second halves.
        """
        carried = np.empty((len(self.order), *values.shape[1:]), dtype=values.dtype)
        carried[: len(values)] = values
        for cut, second in self.steps:
            carried[cut], carried[second] = halves(carried.take(cut, axis=0))
        return carried.take(self.order, axis=0)


@dataclass(frozen=True, eq=False)
class Mesh:
    """A conforming mesh of triangles whose sides are opposite their corners."""

    xy: np.ndarray  #: (V, 2), coordinates of the vertices, over `unit`
    #: (C, 3) int32, vertices of the triangles: first that opposite the edge that is halved next,
    #: then the ends of this edge
    cells: np.ndarray
    sides: np.ndarray  #: (C, 3) int8, label of the side opposite each corner
    #: (V,) int32, for a vertex on the far side of a seam, the vertex on the near side that is the
    #: same point; for all others the vertex itself
    twin: np.ndarray
    #: edges of the mesh, if bisection has already made them
    carried_edges: Edges | None = field(default=None, kw_only=True)
    unit = 1  # of the coordinates: points and corners are xy/unit times a scale

    @cached_property
    def inlet(self) -> np.ndarray:
        """(V,) bool, vertices of inlet sides."""
        return self._vertices_of(self.sides == INLET)

    @cached_property
    def outlet(self) -> np.ndarray:
        """(V,) bool, vertices of outlet sides."""
        return self._vertices_of(self.sides == OUTLET)

    @cached_property
    def bottom(self) -> np.ndarray:
        """(V,) bool, vertices of BOTTOM sides."""
        return self._vertices_of(self.sides == BOTTOM)

    @cached_property
    def top(self) -> np.ndarray:
        """(V,) bool, vertices of TOP sides."""
        return self._vertices_of(self.sides == TOP)

    @property
    def rim(self) -> np.ndarray:
        """(V,) bool, vertices where ψ is prescribed, or one unknown with other vertices."""
        return self._vertices_of(self.sides >= BOTTOM)

    def _vertices_of(self, selected: np.ndarray) -> np.ndarray:
        """(V,) bool, vertices of the selected sides (C, 3) bool."""
        on_side = np.zeros(len(self.xy), dtype=bool)
        on_side[self.side_ends(selected)] = True
        return on_side

    def side_ends(self, selected: np.ndarray) -> np.ndarray:
        """(n, 2) vertices at the ends of the selected sides (C, 3) bool."""
        return self.cells.ravel()[end_slots(np.flatnonzero(selected))]

    def groups(self) -> tuple[tuple[str, np.ndarray], ...]:
        """Names of the boundary groups, each with the vertices (n, 2) of its edges."""
        inlet, outlet, wall = self.sides == INLET, self.sides == OUTLET, self.sides_on_wall()
        groups = ("inlet", inlet), ("outlet", outlet), ("wall", wall)
        return tuple((name, self.side_ends(sides)) for name, sides in groups)

    def sides_on_wall(self) -> np.ndarray:
        """(C, 3) bool: sides that lie on a wall."""
        return self.sides >= (ISLAND if self.periodic else BOTTOM)

    def sides_on_top(self) -> np.ndarray:
        """(C, 3) bool: sides on the far side of a seam."""
        return (self.sides == TOP) & self.periodic

    @cached_property
    def periodic(self) -> bool:
        """Whether the mesh has a seam, whose two sides are the same line."""
        return not np.array_equal(self.twin, np.arange(len(self.twin)))

    @cached_property
    def edges(self) -> Edges:
        """Edges; the edges on the far side of a seam are those on the near side."""
        return self.carried_edges or find_edges(self._ends_of_edges())

    def _ends_of_edges(self) -> np.ndarray:
        """(C, 3, 2) ends of the sides; on the far side of a seam those of the twin."""
        ends = ends_of_sides(self.cells)
        on_top = self.sides_on_top()
        ends[on_top] = self.twin[ends[on_top]]
        return ends

    def subset(self, cells: np.ndarray) -> Self:
        """Mesh of the cells (n,) alone, with all vertices."""
        sides = self.sides[cells]
        return replace(self, cells=self.cells[cells], sides=sides, carried_edges=None)

    def points(self, scale: float | np.ndarray) -> np.ndarray:
        """Coordinates (V, 2) of the vertices, along each axis times a scale, as the pixel size."""
        return self.xy * (np.asarray(scale) / self.unit)

    def corners(self, scale: float | np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Corners (n, 3, 2) of cells (n, 3), relative to the first of each, times `scale`.

        Subtract before scaling: differences of integers are exact. Coordinates in metres would
        cancel, since cells may be as small as 2^-24 pixels.
        """
        first, *others = (self.xy.take(corner, axis=0) for corner in cells.T)
        corners = np.zeros((len(cells), 3, 2))
        for k, other in enumerate(others, start=1):
            np.multiply(other - first, np.asarray(scale) / self.unit, out=corners[:, k])
        return corners
