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

import numpy as np

from fem_seal.errors import NotConverged
from fem_seal.grid import diagonal_rises
from fem_seal.mesh.mesh import BOTTOM, INLET, OUTLET, TOP, Mesh, ends_of_sides

DEPTH = 24  # bisection is possible down to 2^-24 pixels
PIXEL = 1 << DEPTH  # width of a pixel in the whole numbers that coordinates are


class TooFine(NotConverged):
    """Bisection would need triangles narrower than the coordinates can resolve."""


@dataclass(frozen=True, eq=False)
class NestedMesh(Mesh):
    """A mesh of the nested family over a rectangle of (mx, my) pixels.

    Coordinates are int64. The first corner of a cell is its right angle.
    """

    pixels: tuple[int, int]  #: number of pixels (mx, my) along each axis
    unit = PIXEL

    @property
    def extent(self) -> np.ndarray:
        """(2,) int64: coordinates of the corner (mx, my)."""
        return np.array(self.pixels, dtype=np.int64) * PIXEL

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

    def in_pixels(self, times: int) -> "NestedMesh":
        """The same mesh on a grid with so many times as many pixels along each axis."""
        mx, my = self.pixels
        return replace(self, xy=times * self.xy, pixels=(times * mx, times * my))

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
    sides = rectangle_sides(xy, cells)
    return NestedMesh(xy, cells, sides, twin.ravel(), (int(pixels[0]), int(pixels[1])))


def rectangle_sides(xy: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Labels (C, 3) of the sides of cells (C, 3) that fill a rectangle from (0, 0) on."""
    ends, sides = ends_of_sides(cells), np.zeros(cells.shape, dtype=np.int8)
    for axis, labels in enumerate([(INLET, OUTLET), (BOTTOM, TOP)]):
        for label, at in zip(labels, (0, xy[:, axis].max()), strict=True):
            sides[(xy[:, axis] == at)[ends].all(axis=2)] = label
    return sides


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
