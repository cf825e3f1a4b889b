"""Area means of g³ and 1/g³ on the triangles of the nested family, from the pixel upwards.

On a triangle at or below the pixel the gap is linear and the means are closed forms of its three
vertex values; above the pixel they are means over the pixel triangles inside, summed upwards once:
each coarse triangle is two finer ones of equal area. (Differences of running sums would not do:
the contrast of 1/g³ exceeds what double precision can subtract.)
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.mesh.nested import PIXEL, NestedMesh


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
    squares = a * a + b * b + c * c
    # h3 = (e1³ + 3 e1 Σa² + 2 Σa³) / 6, all terms positive
    return (e1**3 + 3 * e1 * squares + 2 * (a**3 + b**3 + c**3)) / 60


def mean_inverse_cube(gaps: np.ndarray) -> np.ndarray:
    """Mean of 1/g³ over triangles on which the gap is linear: 1/(a b c), infinite at contact.

    Parameters
    ----------
    gaps : (..., 3), vertex values
    """
    product = np.prod(gaps, axis=-1)
    return np.divide(1.0, product, out=np.full(product.shape, np.inf), where=product > 0)


def linear_pixel_means(gap: np.ndarray, mean) -> np.ndarray:
    """`mean` of the two triangles of every pixel, (mx, my, 2), from vertex samples (mx+1, my+1)."""
    sw, se, nw, ne = gap[:-1, :-1], gap[1:, :-1], gap[:-1, 1:], gap[1:, 1:]
    i, j = np.indices(sw.shape, sparse=True)
    even = (i + j) % 2 == 0
    # The diagonal joins sw and ne where i + j is even, se and nw elsewhere.
    low = np.stack([np.where(even, se, sw), np.where(even, sw, se), np.where(even, ne, nw)], -1)
    high = np.stack([np.where(even, nw, ne), np.where(even, sw, se), np.where(even, ne, nw)], -1)
    return np.stack([mean(low), mean(high)], axis=-1)


@dataclass(frozen=True, eq=False)
class Pyramid:
    """Means over all triangles of the nested family from the pixel up to squares 2^k pixels wide.

    diagonal[k] : (mx/2^k, my/2^k, 2), triangles whose hypotenuse is the diagonal of a square 2^k
        pixels wide; last index: right angle at the lower or the upper side
    axial[k] : (mx/2^k, my/2^k, 4), triangles whose hypotenuse is the south, east, north or west
        side of that square and whose right angle is its centre (k ≥ 1; axial[0] is empty)
    """

    diagonal: tuple[np.ndarray, ...]
    axial: tuple[np.ndarray, ...]

    @classmethod
    def from_pixels(cls, pixel_means: np.ndarray, width: int) -> "Pyramid":
        """Sum upwards from (mx, my, 2) pixel triangles to squares `width` pixels wide."""
        diagonal, axial = [pixel_means], [np.empty((0, 0, 4))]
        while (1 << len(diagonal)) <= width:
            d = diagonal[-1]
            sw, se, nw, ne = d[0::2, 0::2], d[1::2, 0::2], d[0::2, 1::2], d[1::2, 1::2]
            south, north = sw[..., 0] + se[..., 0], nw[..., 1] + ne[..., 1]
            west, east = sw[..., 1] + nw[..., 0], se[..., 1] + ne[..., 0]
            quarter = np.stack([south, east, north, west], axis=-1) / 2
            i, j = np.indices(south.shape, sparse=True)
            even = (i + j) % 2 == 0
            south, east, north, west = np.moveaxis(quarter, -1, 0)
            low = south + np.where(even, east, west)
            high = north + np.where(even, west, east)
            axial.append(quarter)
            diagonal.append(np.stack([low, high], axis=-1) / 2)
        return cls(tuple(diagonal), tuple(axial))

    def lookup(self, mesh: NestedMesh, cells: np.ndarray) -> np.ndarray:
        """Means on the cells (indices) of a mesh that are pixel triangles or larger."""
        corner = mesh.xy[mesh.cells[cells]]
        extent = np.abs(corner[:, 1] - corner[:, 2])
        is_diagonal = extent.min(axis=1) > 0
        width = extent.max(axis=1)
        level = np.round(np.log2(width / PIXEL)).astype(int)
        # Six times the centroid, to stay in integers; floor gives the square it lies in.
        square = corner.sum(axis=1) // (3 * width[:, None])
        right_angle, hypotenuse = corner[:, 0], (corner[:, 1] + corner[:, 2]) // 2
        step = np.sign(hypotenuse - right_angle)
        upper = (right_angle[:, 1] > square[:, 1] * width).astype(int)
        side = np.select([step[:, 1] < 0, step[:, 0] > 0, step[:, 1] > 0], [0, 1, 2], 3)
        means = np.empty(len(cells))
        for k in np.unique(level):
            here = (level == k) & is_diagonal
            means[here] = self.diagonal[k][square[here, 0], square[here, 1], upper[here]]
            here = (level == k) & ~is_diagonal
            means[here] = self.axial[k][square[here, 0], square[here, 1], side[here]]
        return means
