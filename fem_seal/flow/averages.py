"""Area means of g³ and 1/g³ on the triangles of the nested family, from the pixel upwards.

On a triangle at or below the pixel the gap is linear and the means are closed forms of its three
vertex values; above the pixel they are means over the pixel triangles inside, summed upwards once:
each coarse triangle is two finer ones of equal area. (Differences of running sums would not do:
the contrast of 1/g³ exceeds what double precision can subtract.)
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_seal.mesh.grouping import parts
from fem_seal.mesh.nested import PIXEL, NestedMesh

_STRIP = 64  # columns of pixels, a multiple of four: the diagonals alternate from an even one on


def mean_cube(gaps: np.ndarray) -> np.ndarray:
    """Mean of g³ over triangles on which the gap is linear, (1/10) Σ a^i b^j c^k, i + j + k = 3.

    Parameters
    ----------
    gaps : (..., 3), vertex values

    Notes
    -----
    Hermite-Genocchi: the mean of f'' over a triangle is twice a divided difference of f.
    """
    a, b, c = np.moveaxis(gaps, -1, 0)
    e1 = a + b + c
    aa, bb, cc = a * a, b * b, c * c
    # h3 = (e1³ + 3 e1 Σa² + 2 Σa³) / 6, all terms positive
    return (e1 * (e1 * e1 + 3 * (aa + bb + cc)) + 2 * (a * aa + b * bb + c * cc)) / 60


def mean_inverse_cube(gaps: np.ndarray) -> np.ndarray:
    """Mean of 1/g³ over triangles on which the gap is linear: 1/(a b c), infinite at contact.

    Parameters
    ----------
    gaps : (..., 3), vertex values
    """
    a, b, c = np.moveaxis(gaps, -1, 0)
    product = a * b * c
    return np.divide(1.0, product, out=np.full(product.shape, np.inf), where=product > 0)


def linear_pixel_means(gap: np.ndarray, mean) -> np.ndarray:
    """`mean` of the two triangles of every pixel, (mx, my, 2), from vertex samples (mx+1, my+1)."""
    sw, se, nw, ne = gap[:-1, :-1], gap[1:, :-1], gap[:-1, 1:], gap[1:, 1:]
    i, j = np.indices(sw.shape, sparse=True)
    even = (i + j) % 2 == 0
    # The diagonal joins sw and ne where i + j is even, se and nw elsewhere.
    first, second = np.where(even, sw, se), np.where(even, ne, nw)
    rest = np.where(even, se, sw), np.where(even, nw, ne)
    # One corner after the other in memory: twice as fast as the three of a triangle together.
    triangles = (np.moveaxis(np.stack([third, first, second]), 0, -1) for third in rest)
    return np.stack([mean(gaps) for gaps in triangles], axis=-1)


@dataclass(frozen=True, eq=False)
class Pyramid:
    """Means over all triangles of the nested family from the pixel up to squares 2^k pixels wide.

    diagonal[k] : (mx/2^k, my/2^k, 2), triangles whose hypotenuse is the diagonal of a square 2^k
        pixels wide; last index: right angle at the lower or the upper side
    axial[k] : (mx/2^k, my/2^k, 4), triangles whose hypotenuse is the south, east, north or west
        side of that square and whose right angle is its centre

    On the pixel (k = 0) both are empty: there the closed forms hold.
    """

    diagonal: tuple[np.ndarray, ...]
    axial: tuple[np.ndarray, ...]

    @classmethod
    def from_pixels(
        cls, pixel_means: Callable[[slice], np.ndarray], squares: tuple[int, int], width: int
    ) -> "Pyramid":
        """Sum upwards to squares `width` pixels wide.

        Parameters
        ----------
        pixel_means : of a slice of n columns i the means (n, my, 2) on pixel triangles
        squares : (mx, my), pixels along each axis, multiples of `width`, a power of two
        """
        diagonal, axial = [np.empty((0, 0, 2))], [np.empty((0, 0, 4))]
        if width > 1:
            # The means on all pixels would be most of the memory of the pyramid.
            strips = [_summed(pixel_means(strip)) for strip in parts(0, squares[0], _STRIP)]
            for level, of_strips in zip((diagonal, axial), zip(*strips, strict=True), strict=True):
                level.append(np.concatenate(of_strips))
        while (1 << len(diagonal)) <= width:
            for level, means in zip((diagonal, axial), _summed(diagonal[-1]), strict=True):
                level.append(means)
        return cls(tuple(diagonal), tuple(axial))

    def lookup(self, place: "Place") -> np.ndarray:
        """Means (n,) on the cells at some places."""
        means = np.empty(len(place.part))
        for level in range(len(self.diagonal)):
            for table, where in zip((self.diagonal, self.axial), place.on(level), strict=True):
                means[where] = table[level][place.i[where], place.j[where], place.part[where]]
        return means


def _summed(d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Diagonal and axial means on squares twice as wide as those of `d` (mx, my, 2)."""
    sw, se, nw, ne = d[0::2, 0::2], d[1::2, 0::2], d[0::2, 1::2], d[1::2, 1::2]
    south, north = sw[..., 0] + se[..., 0], nw[..., 1] + ne[..., 1]
    west, east = sw[..., 1] + nw[..., 0], se[..., 1] + ne[..., 0]
    axial = np.stack([south, east, north, west], axis=-1) / 2
    i, j = np.indices(south.shape, sparse=True)
    even = (i + j) % 2 == 0
    south, east, north, west = np.moveaxis(axial, -1, 0)
    low = south + np.where(even, east, west)
    high = north + np.where(even, west, east)
    return np.stack([low, high], axis=-1) / 2, axial


@dataclass(frozen=True, eq=False)
class Place:
    """Where some cells (n,) of a mesh, pixel triangles or larger, stand in a pyramid.

    level : k of the square 2^k pixels wide that holds the cell; i, j : its place among the squares
    is_diagonal : bool, whether the hypotenuse is a diagonal of that square
    part : last index of the means, of the diagonal or the axial ones
    """

    level: np.ndarray
    i: np.ndarray
    j: np.ndarray
    is_diagonal: np.ndarray
    part: np.ndarray

    @classmethod
    def of(cls, mesh: NestedMesh, cells: np.ndarray) -> "Place":
        """Places of the cells (indices) of a mesh."""
        (x, y), (x1, y1), (x2, y2) = (mesh.xy[corner].T for corner in mesh.cells[cells].T)
        across, along = np.abs(x1 - x2), np.abs(y1 - y2)
        width = np.maximum(across, along)
        is_diagonal = np.minimum(across, along) > 0
        level = np.frexp(width // PIXEL)[1] - 1
        # Thrice the centroid, to stay in integers; the quotient is the square it lies in.
        i, j = (x + x1 + x2) // (3 * width), (y + y1 + y2) // (3 * width)
        upper = y > j * width
        # Twice the way from the right angle to the middle of an axial hypotenuse.
        to_x, to_y = x1 + x2 - 2 * x, y1 + y2 - 2 * y
        side = np.where(to_y != 0, 1 + np.sign(to_y), 2 - np.sign(to_x))
        return cls(level, i, j, is_diagonal, np.where(is_diagonal, upper, side))

    def on(self, level: int) -> tuple[np.ndarray, np.ndarray]:
        """Indices of the diagonal and of the axial cells of one level."""
        here = self.level == level
        return np.flatnonzero(here & self.is_diagonal), np.flatnonzero(here & ~self.is_diagonal)
