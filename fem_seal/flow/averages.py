"""Area means of the conductivity and of its inverse on the triangles of the nested family.

On a triangle at or below the pixel the gap is linear, and the means are closed forms of its three
vertex values. Above the pixel they are means over the pixel triangles inside, computed once from
fine to coarse: each coarse triangle consists of two finer ones of equal area. (A table of
cumulative sums would not do: the contrast of 1/g³ exceeds the digits of double precision, and
differences of sums would lose small values.)

Without slip the conductivity is g³. With slip α g³ + β g² bounds it on each triangle, and the mean
of its inverse has an upper bound: a harmonic mean of a sum is at least the sum of the harmonic
means.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from fem_seal.film.law import Conductivity
from fem_seal.flow.quarters import thrice_centroids
from fem_seal.grid import diagonal_rises
from fem_seal.memory import slices
from fem_seal.mesh.nested import DEPTH, covering
from fem_seal.parallel import cores

_NEAR_SQUARE = 1.25  # ratio of two gaps below which Gauss points replace the closed form of 1/g²
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
_NODES, _WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2
_STRIP = 16  # columns of pixels, a multiple of four: the diagonals alternate from an even one on


def cube_of_corners(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Mean of g³ for gaps at the corners, (1/10) Σ a^i b^j c^k, i + j + k = 3.

    By Hermite and Genocchi the mean of f'' over a triangle is twice a divided difference of f. The
    arrays broadcast, which costs least for b and c.
    """
    both, squares = b + c, b * b + c * c
    return (a * (a * (a + both) + (squares + b * c)) + both * squares) / 10


def inverse_cube_of_corners(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Mean of 1/g³ for gaps at the corners, 1/(a b c); infinite at contact, and where too large."""
    with np.errstate(divide="ignore", over="ignore"):
        return 1 / (a * (b * c))


def square_of_corners(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Mean of g², (a² + b² + c² + a b + b c + c a)/6."""
    return (a * (a + b + c) + b * (b + c) + c * c) / 6


def inverse_square_of_corners(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Mean of 1/g² for gaps at the corners; infinite at contact.

    By Hermite-Genocchi it is minus twice the second divided difference of ln g. In units of the
    middle gap let the highest gap be 1 + u and the lowest 1 + v: the mean is 2 (f(v) - f(u))/(u -
    v) with f(x) = ln(1 + x)/x. This formula cancels where the gaps are nearly the same. There six
    Gauss points integrate ∫ 2 t dt/(g_1(t) g_2(t)) over 0 ≤ t ≤ 1, where g_1 and g_2 are the gaps
    along the two sides that leave the corner of the lowest gap. The pole of the integrand is four
    intervals away, so that the error is 1e-15.
    """
    low, mid, high = np.sort(np.stack(np.broadcast_arrays(a, b, c)), axis=0)
    mean = np.full(low.shape, np.inf)
    open_, near = low > 0, high < _NEAR_SQUARE * low
    far = open_ & ~near
    v, u = (low[far] - mid[far]) / mid[far], (high[far] - mid[far]) / mid[far]
    # 1 + v rounds to 0 where the gaps differ by more than the digits of a number.
    fall = np.where(v < -0.5, np.log(low[far] / mid[far]), np.log1p(np.maximum(v, -0.5)))
    rises = fall, np.log1p(u)
    f_v, f_u = (
        np.divide(rise, x, out=np.ones_like(x), where=x != 0)
        for rise, x in zip(rises, (v, u), strict=True)
    )
    mean[far] = 2 * (f_v - f_u) / (u - v) / mid[far] ** 2
    t = _NODES[:, None]
    sides = ((1 - t) * low[near] + t * other[near] for other in (mid, high))
    mean[near] = _WEIGHTS @ (2 * t / np.multiply(*sides))
    return mean


def conductivity_of_corners(
    law: Conductivity, a: np.ndarray, b: np.ndarray, c: np.ndarray
) -> np.ndarray:
    """Upper bound of the mean conductivity, exact where the law has no kink inside the triangle."""
    if law.is_cube:
        return cube_of_corners(a, b, c)
    cubic, square = law.upper_line(*extremes(a, b, c))
    return cubic * cube_of_corners(a, b, c) + square * square_of_corners(a, b, c)


def resistivity_of_corners(
    law: Conductivity,
    a: np.ndarray,
    b: np.ndarray,
    c: np.ndarray,
    span: tuple[np.ndarray, np.ndarray] | None = None,
) -> np.ndarray:
    """Upper bound of the mean of 1/conductivity on a triangle.

    Let m be the mean of 1/g². For a conductivity of at least g² (α g + β), α >= 0, the bound is
    1/(α a b c + β/m). For α < 0 the convex function 1/(α g + β) is at most its chord A + D g, and
    the mean of 1/g is at most √m: together A m + D √m.

    With the least and the largest gap of a larger triangle as `span`, α and β are taken from it, so
    that the means over its parts add up to no more than the mean over the whole.
    """
    if law.is_cube:
        return inverse_cube_of_corners(a, b, c)
    low, high = extremes(a, b, c) if span is None else span
    cubic, square = law.lower_line(low, high)
    m = inverse_square_of_corners(a, b, c)
    with np.errstate(divide="ignore", invalid="ignore"):
        rising = 1 / (cubic * (a * (b * c)) + square / m)
        ends = (cubic * low + square) * (cubic * high + square)
        falling = ((cubic * (low + high) + square) * m - cubic * np.sqrt(m)) / ends
        return np.where(cubic < 0, np.where(np.isinf(m), np.inf, falling), rising)


def extremes(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest gap at the corners."""
    return np.minimum(a, np.minimum(b, c)), np.maximum(a, np.maximum(b, c))


def linear_pixel_means(
    gap: np.ndarray, mean: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
) -> np.ndarray:
    """`mean` of the two triangles of every pixel, (mx, my, 2), from vertex samples (mx+1, my+1)."""
    sw, se, nw, ne = gap[:-1, :-1], gap[1:, :-1], gap[:-1, 1:], gap[1:, 1:]
    rises = diagonal_rises(*np.indices(sw.shape, sparse=True))
    first, second = np.where(rises, sw, se), np.where(rises, ne, nw)
    rest = np.where(rises, se, sw), np.where(rises, nw, ne)
    return np.stack([mean(third, first, second) for third in rest], axis=-1)


@dataclass(frozen=True, eq=False)
class Pyramid:
    """Two means over all triangles of the nested family, up to squares 2^k pixels wide.

    Each k has two tables, of squares 2^k pixels wide. The diagonal one (2, mx/2^k, my/2^k, 2) is of
    the triangles whose hypotenuse is the diagonal of a square, with the right angle at its lower or
    its upper side; the axial one (2, mx/2^k, my/2^k, 4) of those whose hypotenuse is its south,
    east, north or west side, with the right angle at its centre. For k = 0, the pixel itself, both
    are empty: the closed forms hold there.
    """

    means: np.ndarray  #: (2, n), all tables, one after the other
    starts: np.ndarray  #: (k, 2), first index of the diagonal and of the axial table in `means`
    columns: np.ndarray  #: (k,), length my/2^k of the rows of both tables

    @classmethod
    def from_pixels(
        cls, pixel_means: Callable[[slice], np.ndarray], pixels: tuple[int, int], width: int
    ) -> "Pyramid":
        """Compute the means from fine to coarse, up to squares `width` pixels wide, a power of two.

        `pixel_means` maps a slice of n columns i to means (2, n, my, 2) on pixel triangles; there
        are (mx, my) pixels. Triangles that reach beyond these have means that nobody may ask for.
        """
        mx, my = covering(pixels, width)
        shapes = [(0, 0), *((mx >> k, my >> k) for k in range(1, width.bit_length()))]
        tables = [(*shape, parts_of) for shape in shapes for parts_of in (2, 4)]
        ends = np.cumsum([np.prod(table) for table in tables])
        means = np.empty((2, ends[-1]))
        views = [
            part.reshape(2, *table)
            for part, table in zip(np.split(means, ends[:-1], axis=1), tables, strict=True)
        ]
        diagonal, axial = views[::2], views[1::2]

        def fill(strip: slice) -> None:
            half = slice(strip.start // 2, strip.stop // 2)
            strip_means = pixel_means(slice(strip.start, min(strip.stop, pixels[0])))
            beyond = strip.stop - strip.start - strip_means.shape[1], my - pixels[1]
            strip_means = np.pad(strip_means, [(0, 0), (0, beyond[0]), (0, beyond[1]), (0, 0)])
            diagonal[1][:, half], axial[1][:, half] = _on_twice_as_wide(strip_means)

        # Work in strips: the means on all pixels would take most of the pyramid's memory.
        with ThreadPoolExecutor(cores()) as pool:
            list(pool.map(fill, slices(0, mx if width > 1 else 0, _STRIP)))
        for k in range(2, len(shapes)):
            diagonal[k][:], axial[k][:] = _on_twice_as_wide(diagonal[k - 1])
        starts = np.append(0, ends[:-1]).reshape(-1, 2)
        return cls(means, starts, np.array([columns for _, columns in shapes]))

    def lookup(self, place: "Place") -> np.ndarray:
        """Means (2, ...) on the cells at given places."""
        kind = np.where(place.is_diagonal, 0, 1)
        square = place.i * self.columns[place.k] + place.j
        row = (square << (1 + kind)) + self.starts[place.k, kind] + place.part
        return self.means.take(row, axis=1)


def _on_twice_as_wide(d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Diagonal and axial means on squares twice as wide as those of `d` (2, mx, my, 2)."""
    west_half, east_half = d[:, 0::2], d[:, 1::2]
    sw, nw, se, ne = (half[:, :, k::2] for half in (west_half, east_half) for k in range(2))
    south, north = sw[..., 0] + se[..., 0], nw[..., 1] + ne[..., 1]
    west, east = sw[..., 1] + nw[..., 0], se[..., 1] + ne[..., 0]
    axial = np.stack([south, east, north, west], axis=-1) / 2
    rises = diagonal_rises(*np.indices(south.shape[1:], sparse=True))
    south, east, north, west = np.moveaxis(axial, -1, 0)
    low = south + np.where(rises, east, west)
    high = north + np.where(rises, west, east)
    return np.stack([low, high], axis=-1) / 2, axial


@dataclass(frozen=True, eq=False)
class Place:
    """Position in a pyramid of n cells, each a pixel triangle or larger."""

    k: np.ndarray  #: (n,) int, of the square, 2^k pixels wide, that contains the cell
    i: np.ndarray  #: (n,) int, column of this square
    j: np.ndarray  #: (n,) int, its row
    is_diagonal: np.ndarray  #: (n,) bool, whether the hypotenuse is a diagonal of the square
    part: np.ndarray  #: (n,) int, last index into the diagonal or the axial means

    @classmethod
    def of(cls, xy: np.ndarray) -> "Place":
        """Places (n,) of cells with corners (3, n, 2), the one with the right angle first."""
        k, is_diagonal, half_widths = _measured(xy)
        return cls._around(half_widths.sum(axis=1) >> 1, k, is_diagonal)

    @classmethod
    def of_quarters(cls, xy: np.ndarray) -> "Place":
        """Places (4, n) of the quarters of such cells, in the order of `quarters`."""
        k, is_diagonal, half_widths = _measured(xy)
        return cls._around(thrice_centroids(half_widths), k - 1, is_diagonal)

    @classmethod
    def _around(cls, thrice: np.ndarray, k: np.ndarray, is_diagonal: np.ndarray) -> "Place":
        """Places from three times the centroids (2, ...) of cells, in widths of their squares."""
        # Cut the square into 3 × 3. The centroids of axial triangles lie at (p, q) = (1, 0),
        # (2, 1), (1, 2) and (0, 1), those of diagonal triangles at q = 1 or q = 2.
        i, j = thrice // 3
        p, q = thrice[0] - 3 * i, thrice[1] - 3 * j
        side = np.where(q == 1, 3 - p, q)
        return cls(k, i, j, is_diagonal, np.where(is_diagonal, q - 1, side))


def _measured(xy: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Measure cells with corners (3, n, 2): k of `Place`, whether they are diagonal, and corners.

    The corners (2, 3, n) are in half widths of the square that contains the cell: small integers.
    """
    width, is_diagonal = extent(xy)
    k = np.frexp(width >> DEPTH)[1] - 1
    corners = np.ascontiguousarray(np.moveaxis(xy, -1, 0))
    return k, is_diagonal, (corners >> (DEPTH - 1 + k)).astype(np.int32)


def extent(xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Width (n,) of the squares that contain cells with corners (3, n, 2); which are diagonal.

    The hypotenuse of a diagonal cell is a diagonal of the square, that of an axial cell a side.
    """
    across, along = np.abs(xy[1] - xy[2]).T
    return np.maximum(across, along), np.minimum(across, along) > 0
