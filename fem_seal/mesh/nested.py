"""The nested family: right isosceles triangles on and between the samples of a grid.

A square of the grid is cut along one diagonal, and the diagonals alternate like the fields of a
chessboard, so that they join the vertices (i, j) with i + j even. Halving every triangle twice,
each time from the right angle to the middle of the hypotenuse, gives the same pattern on squares
half as wide. Meshes of squares 2^k samples wide, the pixel triangulation itself (k = 0) and all
that lies below it are therefore nested, and so is every mix of them that bisection makes. A gap
that is linear on the pixel triangles is linear on all triangles at or below the pixel.

Vertices carry integer coordinates in units of 2^-DEPTH pixels: which square a triangle belongs to
is index arithmetic, never a search.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fem_seal.errors import FemSealError
from fem_seal.mesh.edges import Edges, find_edges
from fem_seal.mesh.halvings import Halvings

DEPTH = 24  # bisection can go on to 2^-24 pixels
PIXEL = 1 << DEPTH


class TooFine(FemSealError):
    """A triangle would become narrower than the coordinates can hold."""


@dataclass(frozen=True, eq=False)
class NestedMesh:
    """A mesh of the nested family over a rectangle of (mx, my) pixel squares.

    xy : (V, 2) int64, vertex coordinates in units of 2^-DEPTH pixels
    cells : (C, 3) int32, the vertex with the right angle first, then the ends of the hypotenuse
    squares : (mx, my), number of pixel squares along each axis
    twin : (V,) int32; with periodic sides the vertex at y = 0 that is the same point as a vertex
        at y = my, else each vertex itself
    carried_edges : if they are known already
    """

    xy: np.ndarray
    cells: np.ndarray
    squares: tuple[int, int]
    twin: np.ndarray
    carried_edges: Edges | None = None

    @cached_property
    def periodic(self) -> bool:
        """Whether the sides y = 0 and y = my are one line."""
        return not np.array_equal(self.twin, np.arange(len(self.twin)))

    @property
    def inlet(self) -> np.ndarray:
        """(V,) bool, vertices at x = 0."""
        return self.xy[:, 0] == 0

    @property
    def outlet(self) -> np.ndarray:
        """(V,) bool, vertices at x = mx."""
        return self.xy[:, 0] == self.squares[0] * PIXEL

    @property
    def bottom(self) -> np.ndarray:
        """(V,) bool, vertices at y = 0."""
        return self.xy[:, 1] == 0

    @property
    def top(self) -> np.ndarray:
        """(V,) bool, vertices at y = my."""
        return self.xy[:, 1] == self.squares[1] * PIXEL

    def ends_of_sides(self) -> np.ndarray:
        """(C, 3, 2) vertices at the ends of the sides opposite to corner 0 (longest), 1, 2."""
        return self.cells[:, [[1, 2], [2, 0], [0, 1]]]

    @cached_property
    def numbered_edges(self) -> Edges:
        """The edges; one on a periodic side and its twin are one, with the vertices at y = 0."""
        return self.carried_edges or find_edges(self._ends_of_lines(), len(self.xy))

    @property
    def edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (E, 2) of each edge, and the edges (C, 3) opposite to the corners."""
        return self.numbered_edges.ends, self.numbered_edges.of_cell

    def _ends_of_lines(self) -> np.ndarray:
        """(C, 3, 2) ends of the sides, of one on a periodic side those of its twin at y = 0."""
        ends = self.ends_of_sides()
        if self.periodic:
            on_side = self.top[ends].all(axis=2)
            ends[on_side] = self.twin[ends[on_side]]
        return ends

    def points(
        self, spacing: tuple[float, float], vertices: np.ndarray | None = None
    ) -> np.ndarray:
        """Coordinates (V, 2) or (..., 2) [m] of all or some vertices, for the pixel size [m]."""
        xy = self.xy if vertices is None else self.xy.take(vertices, axis=0)
        points = np.empty(xy.shape)
        # NumPy takes three times as long for the two coordinates of a vertex after each other.
        for axis, size in enumerate(spacing):
            np.multiply(xy[..., axis], size / PIXEL, out=points[..., axis])
        return points

    @staticmethod
    def midpoints(xy: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Middles (n, 2) of the edges between `ends` (n, 2), vertices at `xy`.

        Raises
        ------
        TooFine
            If one lies between the integer coordinates.
        """
        doubled = xy.take(ends[:, 0], axis=0) + xy.take(ends[:, 1], axis=0)
        if (doubled & 1).any():
            raise TooFine(f"triangles below 2^-{DEPTH} pixels would be needed")
        return doubled >> 1

    def can_halve_twice(self) -> np.ndarray:
        """(C,) bool: all sides have a middle in integer coordinates."""
        odd = self.xy & 1
        if not odd.any():
            return np.ones(len(self.cells), dtype=bool)
        a, b, c = (odd[corner] for corner in self.cells.T)
        return ((a == b) & (b == c)).all(axis=1)

    def halved(
        self, xy: np.ndarray, cells: np.ndarray, twin: np.ndarray, edges: Edges, halvings: Halvings
    ) -> "NestedMesh":
        """The mesh that bisection has made of this one; `halvings` do not matter here."""
        return NestedMesh(xy, cells, self.squares, twin, edges)

    def part(self, cells: np.ndarray) -> "NestedMesh":
        """Some cells (n,), with all vertices."""
        return replace(self, cells=self.cells[cells], carried_edges=None)

    def sides_on_top(self) -> np.ndarray:
        """(C, 3) bool: sides at y = my, if that is the same line as y = 0."""
        return self.top[self.ends_of_sides()].all(axis=2) & self.periodic

    def wall_ties(self) -> list[np.ndarray]:
        """Pairs (n, 2) of vertices on one wall, where the stream function has one value."""
        walls = [] if self.periodic else [np.flatnonzero(self.bottom), np.flatnonzero(self.top)]
        return [np.stack([wall[:-1], wall[1:]], 1) for wall in walls]

    def sides_on_wall(self) -> np.ndarray:
        """(C, 3) bool: sides that lie on a side wall."""
        on_wall = np.zeros(self.cells.shape, dtype=bool)
        if not self.periodic:
            for wall in (self.bottom, self.top):
                a, b, c = wall[self.cells.T]
                on_wall |= np.stack([b & c, c & a, a & b], axis=1)
        return on_wall

    def first_guess(self) -> tuple[np.ndarray, np.ndarray]:
        """Pressure and stream function (V,) of a uniform gap."""
        x, y = (self.xy / self.xy.max(axis=0)).T
        return 1 - x, y.copy()

    def relative_areas(self) -> np.ndarray:
        """(C,) float: area of each triangle in pixels."""
        start, end = (self.xy.take(self.cells[:, k], axis=0) for k in (1, 2))
        extent = np.abs(start - end) / PIXEL
        # A hypotenuse (s, s) has legs s; a hypotenuse (s, 0) stands s/2 below the right angle.
        diagonal = extent.min(axis=1) > 0
        return np.where(diagonal, extent[:, 0] ** 2 / 2, extent.max(axis=1) ** 2 / 4)


def uniform_mesh(squares: tuple[int, int], width: int, periodic_sides: bool) -> NestedMesh:
    """Squares `width` pixels wide, each cut along its alternating diagonal.

    Parameters
    ----------
    squares : (mx, my), pixel squares along each axis, multiples of `width`
    width : a power of two
    periodic_sides : the sides y = 0 and y = my are one line

    Returns
    -------
    NestedMesh
    """
    nx, ny = squares[0] // width, squares[1] // width
    i, j = np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij")
    xy = np.stack([i, j], axis=-1).reshape(-1, 2).astype(np.int64) * (width * PIXEL)
    vertex = np.arange((nx + 1) * (ny + 1), dtype=np.int32).reshape(nx + 1, ny + 1)
    sw, se, nw, ne = vertex[:-1, :-1], vertex[1:, :-1], vertex[:-1, 1:], vertex[1:, 1:]
    even = ((i + j) % 2 == 0)[:-1, :-1]
    low = np.where(even[..., None], np.stack([se, sw, ne], -1), np.stack([sw, se, nw], -1))
    high = np.where(even[..., None], np.stack([nw, ne, sw], -1), np.stack([ne, nw, se], -1))
    cells = np.stack([low, high], axis=2).reshape(-1, 3)
    twin = vertex.copy()
    if periodic_sides:
        twin[:, -1] = twin[:, 0]
    return NestedMesh(xy, cells, (int(squares[0]), int(squares[1])), twin.ravel())


def coarsest_width(squares: tuple[int, int], at_least: int = 8) -> int:
    """Width in pixels of the coarsest nested squares that leave `at_least` of them on each side.

    Grids whose sides have no factor 2 start at the pixel (width 1).
    """
    width = 1
    while all(m % (2 * width) == 0 and m // (2 * width) >= at_least for m in squares):
        width *= 2
    return width
