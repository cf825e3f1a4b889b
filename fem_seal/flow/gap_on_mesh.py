"""The gap as a function on nested meshes, and what the two bounds need to know of each cell.

Gaps are in units of the largest one, lengths in pixels (scaled by the aspect of a pixel).
"""

from functools import partial

import numpy as np

from fem_seal.flow import averages
from fem_seal.flow.cell_data import ISOTROPIC, CellContact, CellData
from fem_seal.flow.quarters import QuarterData, middles, on_quarters, thrice_centroids
from fem_seal.grid import GridField
from fem_seal.mesh.nested import PIXEL, NestedMesh
from fem_seal.mesh.triangles import TriangleMesh

__all__ = [
    "ISOTROPIC",
    "REPRESENTATIONS",
    "CellContact",
    "CellData",
    "ConstantGap",
    "LinearGap",
    "VertexGap",
]


class LinearGap:
    """Samples are vertices, the gap is linear on the pixel triangles.

    Parameters
    ----------
    gap : GridField, in units of its maximum
    cut : the dual takes gaps below it for contact (lowering the gap lowers the lower bound)
    floor : the primal raises positive gaps below it (raising the gap raises the upper bound)
    width : pixels, squares of the starting mesh
    ceiling : cells of a higher mean cube are `stiff` in the primal, and in the dual as conductive
        as the ceiling; both err to the safe side
    """

    def __init__(
        self, gap: GridField, cut: float, floor: float, width: int, ceiling: float = np.inf
    ):
        samples = gap.vertices()
        self.squares = (samples.shape[0] - 1, samples.shape[1] - 1)
        self.aspect = np.asarray(gap.spacing) / max(gap.spacing)
        self.cut, self._ceiling = cut, ceiling
        self._samples = np.stack([samples, samples], axis=-1)
        raised, lowered = np.moveaxis(self._samples, -1, 0)
        raised[(raised > 0) & (raised < floor)] = floor
        lowered[lowered < cut] = 0.0
        self._cube, self._inverse_cube = (
            averages.Pyramid.from_pixels(partial(_pixel_means, gaps, mean), self.squares, width)
            for gaps, mean in (
                (raised, averages.mean_cube),
                (lowered, averages.mean_inverse_cube),
            )
        )

    def vertex_values(self, mesh: NestedMesh) -> np.ndarray:
        """Gap (raised, lowered) at the vertices (V, 2) of a mesh of whole pixels."""
        i, j = (mesh.xy // PIXEL).T
        return self._samples[i, j]

    def refined_values(
        self, values: np.ndarray, fine: NestedMesh, edge_ends: np.ndarray
    ) -> np.ndarray:
        """Vertex values (V', 2) of a finer mesh whose new vertices lie midway between `edge_ends`.

        Samples on pixel vertices, linear between them.
        """
        a, b = (values.take(ends, axis=0) for ends in edge_ends.T)
        return np.concatenate([values, self._sampled(fine.xy[len(values) :], (a + b) / 2)])

    def _sampled(self, xy: np.ndarray, linear: np.ndarray) -> np.ndarray:
        """Gap (n, 2) at points of a mesh: the sample there, or what is `linear` between samples."""
        x, y = xy.T
        on_pixel = np.flatnonzero((x | y) % PIXEL == 0)
        i, j = x[on_pixel] // PIXEL, y[on_pixel] // PIXEL
        samples = self._samples.reshape(-1, 2)
        linear[on_pixel] = samples.take(i * self._samples.shape[1] + j, axis=0)
        return linear

    def plotted_values(self, mesh: NestedMesh, values: np.ndarray) -> np.ndarray:
        """Gap (V,) at the vertices, for pictures."""
        return values[:, 0]

    def cell_data(self, mesh: NestedMesh, values: np.ndarray) -> CellData:
        """Averages, shut sides and resistivity tensors of all cells.

        Parameters
        ----------
        mesh, values : the mesh and the gap at its vertices
        """
        return CellData.joined(mesh, partial(self._some, values))

    def _some(self, values: np.ndarray, vertices: np.ndarray, xy: np.ndarray) -> CellData:
        gaps = values.take(vertices, axis=0)
        linear = averages.extent(xy)[0] <= PIXEL
        cube, inverse_cube = _linear_means(np.moveaxis(gaps, -1, 0))
        coarse = np.flatnonzero(~linear)
        place = averages.Place.of(xy.take(coarse, axis=1))
        cube[coarse] = self._cube.lookup(place)
        inverse_cube[coarse] = self._inverse_cube.lookup(place)
        means = cube, inverse_cube
        return CellData.of_gaps(xy * self.aspect, gaps, linear, means, self._ceiling)

    def quarter_data(self, xy: np.ndarray, gaps: np.ndarray) -> QuarterData:
        """Averages on the quarters of some cells.

        Parameters
        ----------
        xy, gaps : (3, n, 2), corners of the cells and the gap there
        """
        middle = middles(gaps)
        width, _ = averages.extent(xy)
        # Of triangles of one or two pixels the middles may be samples.
        two = np.flatnonzero(width == 2 * PIXEL)
        at = middles(xy.take(two, axis=1)).astype(np.int64).reshape(-1, 2)
        samples = self._sampled(at, middle.take(two, axis=1).reshape(-1, 2))
        middle[:, two] = samples.reshape(3, -1, 2)
        cube, inverse_cube = _linear_means(on_quarters(gaps, middle))
        coarse = np.flatnonzero(width > 2 * PIXEL)
        place = averages.Place.of_quarters(xy.take(coarse, axis=1))
        cube[:, coarse] = self._cube.lookup(place)
        inverse_cube[:, coarse] = self._inverse_cube.lookup(place)
        return QuarterData.of(cube, inverse_cube)


def _pixel_means(gaps: np.ndarray, mean, strip: slice) -> np.ndarray:
    """`mean` of the triangles of a strip of pixels, from all vertex samples."""
    return averages.linear_pixel_means(gaps[strip.start : strip.stop + 1], mean)


class VertexGap:
    """The gap is given at the vertices of any triangles and linear on them and on their parts.

    Parameters
    ----------
    values : (V,), gap at the vertices of the first mesh, in units of its maximum
    unit : lengths of the mesh are measured in it [m]
    cut, floor, ceiling : as for LinearGap
    """

    def __init__(
        self, values: np.ndarray, unit: float, cut: float, floor: float, ceiling: float = np.inf
    ):
        self.aspect = 1 / unit
        self.cut, self._ceiling = cut, ceiling
        raised = np.where(values > 0, np.maximum(values, floor), 0.0)
        lowered = np.where(values < cut, 0.0, values)
        self._values = np.stack([raised, lowered], axis=-1)

    def vertex_values(self, mesh: TriangleMesh) -> np.ndarray:
        """Gap (raised, lowered) at the vertices (V, 2) of the first mesh."""
        return self._values

    def refined_values(
        self, values: np.ndarray, fine: TriangleMesh, edge_ends: np.ndarray
    ) -> np.ndarray:
        """Vertex values (V', 2) of a finer mesh whose new vertices lie midway between `edge_ends`.

        The middle of an edge has the mean of its ends: the gap stays the same function.
        """
        return np.concatenate([values, (values[edge_ends[:, 0]] + values[edge_ends[:, 1]]) / 2])

    def plotted_values(self, mesh: TriangleMesh, values: np.ndarray) -> np.ndarray:
        """Gap (V,) at the vertices, for pictures."""
        return values[:, 0]

    def cell_data(self, mesh: TriangleMesh, values: np.ndarray) -> CellData:
        """Averages, shut sides and resistivity tensors, in closed form on every cell."""
        return CellData.joined(mesh, partial(self._some, values))

    def _some(self, values: np.ndarray, vertices: np.ndarray, xy: np.ndarray) -> CellData:
        gaps = values.take(vertices, axis=0)
        means, linear = _linear_means(np.moveaxis(gaps, -1, 0)), np.True_
        return CellData.of_gaps(xy * self.aspect, gaps, linear, means, self._ceiling)

    def quarter_data(self, xy: np.ndarray, gaps: np.ndarray) -> QuarterData:
        """Averages on the quarters of some cells; as of LinearGap."""
        return QuarterData.of(*_linear_means(on_quarters(gaps, middles(gaps))))


def _linear_means(gaps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means (...) of g³, raised, and of 1/g³, lowered, for linear gaps (2, 3, ...) at corners."""
    raised, lowered = np.moveaxis(gaps, 1, -1)
    return averages.mean_cube(raised), averages.mean_inverse_cube(lowered)


class ConstantGap:
    """Each sample fills one square pixel; no vertex carries a gap. Parameters: as for LinearGap."""

    def __init__(
        self, gap: GridField, cut: float, floor: float, width: int, ceiling: float = np.inf
    ):
        self.squares = gap.shape
        self.aspect = np.asarray(gap.spacing) / max(gap.spacing)
        self.cut, self._ceiling = cut, ceiling
        raised = np.where(gap.values > 0, np.maximum(gap.values, floor), 0.0)
        lowered = np.where(gap.values < cut, 0.0, gap.values)
        self._K = raised**3
        with np.errstate(divide="ignore"):
            self._inverse = 1 / lowered**3
        self._cube, self._inverse_cube = (
            averages.Pyramid.from_pixels(partial(_both_triangles, means), self.squares, width)
            for means in (self._K, self._inverse)
        )

    def vertex_values(self, mesh: NestedMesh) -> np.ndarray:
        """Nothing (V, 0): the gap jumps at the vertices."""
        return np.empty((len(mesh.xy), 0))

    def refined_values(
        self, values: np.ndarray, fine: NestedMesh, edge_ends: np.ndarray
    ) -> np.ndarray:
        """Nothing (V', 0)."""
        return np.empty((len(fine.xy), 0))

    def plotted_values(self, mesh: NestedMesh, values: np.ndarray) -> np.ndarray:
        """Gap (V,) of the pixel above and to the right of each vertex, for pictures."""
        i, j = np.minimum(mesh.xy // PIXEL, np.asarray(self.squares) - 1).T
        return np.cbrt(self._K[i, j])

    def cell_data(self, mesh: NestedMesh, values: np.ndarray) -> CellData:
        """Averages of all cells; contact is whole pixels, so no side is shut by itself."""
        return CellData.joined(mesh, self._some)

    def _some(self, vertices: np.ndarray, xy: np.ndarray) -> CellData:
        i, j = np.moveaxis(xy.sum(axis=0), -1, 0) // (3 * PIXEL)
        K, inverse = self._K[i, j], self._inverse[i, j]
        coarse = np.flatnonzero(averages.extent(xy)[0] > PIXEL)
        place = averages.Place.of(xy.take(coarse, axis=1))
        K[coarse] = self._cube.lookup(place)
        inverse[coarse] = self._inverse_cube.lookup(place)
        closed, most = np.isinf(inverse), self._ceiling**3
        isotropic = np.where(closed, 0.0, np.maximum(inverse, 1 / most))
        none = np.zeros((len(K), 3), dtype=bool)
        return CellData(none, closed, none, most < K, K, isotropic[:, None] * ISOTROPIC)

    def quarter_data(self, xy: np.ndarray, gaps: np.ndarray) -> QuarterData:
        """Averages on the quarters of some cells; as of LinearGap, with no gaps (3, n, 0)."""
        i, j = thrice_centroids(xy) // (3 * PIXEL)
        K, inverse = self._K[i, j], self._inverse[i, j]
        coarse = np.flatnonzero(averages.extent(xy)[0] > 2 * PIXEL)
        place = averages.Place.of_quarters(xy.take(coarse, axis=1))
        K[:, coarse] = self._cube.lookup(place)
        inverse[:, coarse] = self._inverse_cube.lookup(place)
        return QuarterData.of(K, inverse)


def _both_triangles(means: np.ndarray, strip: slice) -> np.ndarray:
    """(n, my, 2), the same on both triangles of each pixel of a strip."""
    return np.repeat(means[strip][..., None], 2, axis=-1)


REPRESENTATIONS = {"linear": LinearGap, "constant": ConstantGap}
