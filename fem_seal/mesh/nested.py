"""The nested family: right isosceles triangles on and between the samples of a grid.

Every square of the grid is cut along one diagonal (`grid.diagonal_rises`). Halving every triangle
twice, each time from the right angle to the middle of the hypotenuse, gives the same pattern on
squares half as wide. Therefore the meshes of squares 2^k pixels wide are nested, for k > 0, for the
pixel triangulation (k = 0) and below it, and so are the mixtures of them that bisection makes. A
gap that is linear on the pixel triangles is linear on all triangles at or below pixel size.

Vertices have integer coordinates in units of 2^-DEPTH pixels, so that the pixel of a triangle
follows from integer arithmetic, without a search.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from fem_seal.errors import NotConverged
from fem_seal.grid import diagonal_rises
from fem_seal.mesh.mesh import Edges, Halvings, Mesh

DEPTH = 24  # bisection is possible down to 2^-24 pixels
PIXEL = 1 << DEPTH  # width of a pixel in the whole numbers that coordinates are


class TooFine(NotConverged):
    """Bisection would need triangles narrower than the coordinates can resolve."""


@dataclass(frozen=True, eq=False)
class NestedMesh(Mesh):
    """A mesh of the nested family over a rectangle of (mx, my) pixels."""

    xy: np.ndarray  #: (V, 2) int64, coordinates of the vertices in units of 2^-DEPTH pixels
    #: (C, 3) int32, vertices of the triangles: the right angle first, then the ends of the
    #: hypotenuse; so that the side opposite corner 0 is the hypotenuse
    cells: np.ndarray
    pixels: tuple[int, int]  #: number of pixels (mx, my) along each axis
    #: (V,) int32, with periodic sides, for a vertex at y = my the one at y = 0 that is the same
    #: point; for all other vertices the vertex itself
    twin: np.ndarray
    carried_edges: Edges | None = None  #: edges of the mesh, if bisection has already made them
    unit = PIXEL

    @property
    def extent(self) -> np.ndarray:
        """(2,) int64: coordinates of the corner (mx, my)."""
        return np.array(self.pixels, dtype=np.int64) * PIXEL

    @property
    def inlet(self) -> np.ndarray:
        """(V,) bool, vertices at x = 0."""
        return self.xy[:, 0] == 0

    @property
    def outlet(self) -> np.ndarray:
        """(V,) bool, vertices at x = mx."""
        return self.xy[:, 0] == self.pixels[0] * PIXEL

    @property
    def bottom(self) -> np.ndarray:
        """(V,) bool, vertices at y = 0."""
        return self.xy[:, 1] == 0

    @property
    def top(self) -> np.ndarray:
        """(V,) bool, vertices at y = my."""
        return self.xy[:, 1] == self.pixels[1] * PIXEL

    @property
    def blur(self) -> float:
        """Largest coordinate that may have a rounding error: 0, since all are integers."""
        return 0.0

    @staticmethod
    def midpoints(xy: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Middles (n, 2) of the edges between vertices `ends` (n, 2) with coordinates `xy`.

        TooFine if a middle has no integer coordinates.
        """
        doubled = xy.take(ends[:, 0], axis=0) + xy.take(ends[:, 1], axis=0)
        if (doubled & 1).any():
            raise TooFine(f"triangles below 2^-{DEPTH} pixels would be needed")
        return doubled >> 1

    def can_halve_twice(self) -> np.ndarray:
        """(C,) bool: the middles of all sides have integer coordinates."""
        odd = self.xy & 1
        if not odd.any():
            return np.ones(len(self.cells), dtype=bool)
        a, b, c = (odd[corner] for corner in self.cells.T)
        return ((a == b) & (b == c)).all(axis=1)

    def halved(
        self, xy: np.ndarray, cells: np.ndarray, twin: np.ndarray, edges: Edges, halvings: Halvings
    ) -> Self:
        """Mesh with the arrays that bisection made; its sides have no labels to carry over."""
        return replace(self, xy=xy, cells=cells, twin=twin, carried_edges=edges)

    def in_pixels(self, times: int) -> "NestedMesh":
        """The same mesh on a grid with so many times as many pixels along each axis."""
        mx, my = self.pixels
        return replace(self, xy=times * self.xy, pixels=(times * mx, times * my))

    def subset(self, cells: np.ndarray) -> "NestedMesh":
        """Mesh of the cells (n,) alone, with all vertices."""
        return replace(self, cells=self.cells[cells], carried_edges=None)

    def sides_on_top(self) -> np.ndarray:
        """(C, 3) bool: sides at y = my if the sides are periodic, else none."""
        return self._sides_along(self.top) & self.periodic

    @property
    def rim(self) -> np.ndarray:
        """(V,) bool, vertices where ψ is prescribed, or one unknown with other vertices."""
        return self.bottom | self.top

    def wall_ties(self) -> list[np.ndarray]:
        """Pairs (n, 2) of vertices on one wall, where the stream function has one value."""
        walls = [] if self.periodic else [np.flatnonzero(self.bottom), np.flatnonzero(self.top)]
        return [np.stack([wall[:-1], wall[1:]], 1) for wall in walls]

    def sides_on_wall(self) -> np.ndarray:
        """(C, 3) bool: sides that lie on a side wall."""
        if self.periodic:
            return np.zeros(self.cells.shape, dtype=bool)
        return self._sides_along(self.bottom) | self._sides_along(self.top)

    def _sides_along(self, line: np.ndarray) -> np.ndarray:
        """(C, 3) bool: sides both of whose ends lie on a line (V,) bool."""
        a, b, c = line[self.cells.T]
        return np.stack([b & c, c & a, a & b], axis=1)

    def first_guess(self) -> tuple[np.ndarray, np.ndarray]:
        """Pressure and stream function (1, V) of a uniform gap, to start the first solve from."""
        x, y = (self.xy / self.xy.max(axis=0)).T[:, None]
        return 1 - x, y.copy()


Corner = tuple[np.ndarray, np.ndarray]


def triangle_at(
    i: np.ndarray, j: np.ndarray, x: np.ndarray, y: np.ndarray
) -> tuple[list[Corner], list[np.ndarray]]:
    """Corners (i, j) of the pixel triangles of n points, and their weights in linear functions.

    The points lie in the pixels (i, j) at (x, y), from 0 to 1. The weights are exact if these are
    binary fractions.
    """
    # Mirror the pixels whose diagonal does not begin at their first vertex. Each point then lies in
    # the triangle of the first vertex, the opposite one and a third.
    mirrored = ~diagonal_rises(i, j)
    x = np.where(mirrored, 1 - x, x)
    near, far = np.where(mirrored, (i + 1, i), (i, i + 1))
    third = np.where(x > y, far, near), np.where(x > y, j, j + 1)
    weights = [1 - np.maximum(x, y), np.minimum(x, y), np.abs(x - y)]
    return [(near, j), (far, j + 1), third], weights


def uniform_mesh(pixels: tuple[int, int], width: int, periodic_sides: bool) -> NestedMesh:
    """Mesh of squares `width` pixels wide, a power of two, cut along their alternating diagonals.

    There are (mx, my) pixels, multiples of `width`. With periodic sides y = 0 and y = my are the
    same line.
    """
    nx, ny = pixels[0] // width, pixels[1] // width
    i, j = np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij")
    xy = np.stack([i, j], axis=-1).reshape(-1, 2).astype(np.int64) * (width * PIXEL)
    vertex = np.arange((nx + 1) * (ny + 1), dtype=np.int32).reshape(nx + 1, ny + 1)
    sw, se, nw, ne = vertex[:-1, :-1], vertex[1:, :-1], vertex[:-1, 1:], vertex[1:, 1:]
    rises = diagonal_rises(i, j)[:-1, :-1, None]
    low = np.where(rises, np.stack([se, sw, ne], -1), np.stack([sw, se, nw], -1))
    high = np.where(rises, np.stack([nw, ne, sw], -1), np.stack([ne, nw, se], -1))
    cells = np.stack([low, high], axis=2).reshape(-1, 3)
    twin = vertex.copy()
    if periodic_sides:
        twin[:, -1] = twin[:, 0]
    return NestedMesh(xy, cells, (int(pixels[0]), int(pixels[1])), twin.ravel())


def coarsest_width(pixels: tuple[int, int], at_least: int) -> int:
    """Width in pixels, a power of two, of the squares of the coarsest mesh of (mx, my) pixels.

    At least `at_least` squares lie along each axis, unless there are fewer pixels.
    """
    return 1 << max(0, (min(pixels) // at_least).bit_length() - 1)


def covering(pixels: tuple[int, int], width: int) -> tuple[int, int]:
    """The fewest pixels, multiples of a width along each axis, that cover (mx, my) pixels."""
    mx, my = (-(-m // width) * width for m in pixels)
    return mx, my


def opposite(mesh: NestedMesh, axis: int) -> np.ndarray:
    """(V,) the opposite vertex of each vertex on the far side of an axis; itself for the others.

    The vertices of both sides must lie at the same positions.
    """
    far = np.flatnonzero(mesh.xy[:, axis] == mesh.extent[axis])
    near = np.flatnonzero(mesh.xy[:, axis] == 0)
    vertices, along = np.arange(len(mesh.xy), dtype=mesh.twin.dtype), 1 - axis
    order = [side[np.argsort(mesh.xy[side, along])] for side in (far, near)]
    vertices[order[0]] = order[1]
    return vertices
