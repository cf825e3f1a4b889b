"""The gap as a function on nested meshes, and the averages of g³ and 1/g³ on each cell.

Gaps are in units of the largest one, lengths in pixels (scaled by the aspect of a pixel).
"""

from abc import ABC, abstractmethod
from copy import copy
from functools import partial
from typing import ClassVar, Self

import numpy as np

from fem_seal.film.law import CUBE, FilmLaw
from fem_seal.flow import averages
from fem_seal.flow.cell_data import CellData
from fem_seal.flow.quarters import QuarterData, on_quarters, thrice_centroids, with_middles
from fem_seal.grid import GridField
from fem_seal.mesh.bisection import AnyMesh, Refinement
from fem_seal.mesh.nested import DEPTH, PIXEL, triangle_at

Span = tuple[np.ndarray, np.ndarray]


class GapOnMesh(ABC):
    """Gap at the vertices of a mesh, and averages on its cells: base of the three kinds of gap."""

    aspect: np.ndarray | float  #: (2,) or float, factors that scale the coordinates of a mesh
    cut: float  #: the dual treats gaps below it as contact
    ceiling: float  #: gap with the largest conductivity in the dual
    law: FilmLaw  #: conductivity of a gap

    def with_law(self, law: FilmLaw) -> Self:
        """The same gap under another law."""
        other = copy(self)
        other._use(law)
        return other

    def _use(self, law: FilmLaw) -> None:
        """Take a law, and compute the averages that depend on it."""
        self.law = law

    def plotted_values(self, mesh: AnyMesh, values: np.ndarray) -> np.ndarray:
        """Gap (V,) at the vertices, for pictures."""
        return values[:, 0]

    def cell_data(self, mesh: AnyMesh, values: np.ndarray) -> CellData:
        """Averages, contact and resistivity tensors of all cells.

        The values are the gap (V, 2) at the vertices, raised and lowered; (V, 0) if it jumps there.
        """
        vertices = mesh.cells.T
        return self._data_of(values, vertices, mesh.xy.take(vertices, axis=0))

    @abstractmethod
    def vertex_values(self, mesh: AnyMesh) -> np.ndarray:
        """Gap (raised, lowered) at the vertices (V, 2) of the first mesh."""

    @abstractmethod
    def refined_values(self, values: np.ndarray, step: Refinement) -> np.ndarray:
        """Vertex values (V', 2) of a finer mesh from those (V, 2) of the coarser one."""

    @abstractmethod
    def quarter_data(self, xy: np.ndarray, gaps: np.ndarray) -> QuarterData:
        """Averages on the quarters of n cells with corners and gaps there, (3, n, 2) each."""

    @abstractmethod
    def _data_of(self, values: np.ndarray, vertices: np.ndarray, xy: np.ndarray) -> CellData:
        """Data of n cells with vertices (3, n) at xy (3, n, 2); values as for `cell_data`."""


class GridGap(GapOnMesh):
    """A gap by its samples on a grid.

    Parameters
    ----------
    gap
        Gap in units of its maximum.
    cut
        The dual treats gaps below it as contact: a smaller gap lowers the lower bound.
    floor
        The primal raises positive gaps to it: a larger gap raises the upper bound.
    width
        Width of the squares of the first mesh, in pixels.
    ceiling
        Cells with a mean conductivity above that of such a gap are equipotential in the primal, and
        have its conductivity in the dual. Both bounds stay valid.
    law
        Conductivity of a gap.
    """

    linear: ClassVar[bool]  #: whether the gap is linear between samples; else each fills a pixel

    def __init__(
        self,
        gap: GridField,
        cut: float,
        floor: float,
        width: int,
        ceiling: float = np.inf,
        law: FilmLaw = CUBE,
    ):
        samples = gap.vertices() if self.linear else gap.values
        nx, ny = samples.shape
        self.pixels = (nx - self.linear, ny - self.linear)
        self.aspect = np.asarray(gap.spacing) / max(gap.spacing)
        self.cut, self.ceiling, self._floor = cut, ceiling, floor
        self._width = width
        # Samples of the gap for the primal and for the dual, not yet raised or lowered.
        self._samples = samples, samples
        self._use(law)

    def _use(self, law: FilmLaw) -> None:
        self.law = law
        self._above_pixel = averages.Pyramid.from_pixels(
            self._pixel_means, self.pixels, self._width
        )

    @abstractmethod
    def _pixel_means(self, strip: slice) -> np.ndarray:
        """Means (2, n, my, 2) of conductivity and inverse on the triangles of some pixels."""

    def _raised_and_lowered(
        self, index: slice | tuple[np.ndarray, np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Gap for the primal and for the dual at some samples."""
        for_primal, for_dual = self._samples
        return _raised(for_primal[index], self._floor), _lowered(for_dual[index], self.cut)


class LinearGap(GridGap):
    """The samples are vertices, and the gap is linear on the pixel triangles."""

    linear = True

    def with_samples(self, gap: GridField) -> "LinearGap":
        """Another gap on the same grid, in the same unit, with at least the contact of this one.

        For the dual, contact stays contact even where the other gap is open.
        """
        other, samples = copy(self), gap.vertices()
        other._samples = samples, np.where(self._samples[1] < self.cut, 0.0, samples)
        other._use(self.law)
        return other

    def _pixel_means(self, strip: slice) -> np.ndarray:
        raised, lowered = self._raised_and_lowered(np.s_[strip.start : strip.stop + 1])
        conductivity = partial(averages.conductivity_of_corners, self.law.upper)
        resistivity = partial(averages.resistivity_of_corners, self.law.lower)
        return np.stack(
            [
                averages.linear_pixel_means(raised, conductivity),
                averages.linear_pixel_means(lowered, resistivity),
            ]
        )

    def vertex_values(self, mesh: AnyMesh) -> np.ndarray:
        """Gap (raised, lowered) at the vertices (V, 2) of any mesh of the nested family."""
        (i, j), (x, y) = (mesh.xy >> DEPTH).T, (mesh.xy & (PIXEL - 1)).T / PIXEL
        last = np.array(self.pixels)
        values = np.zeros((len(mesh.xy), 2))
        for (a, b), weight in zip(*triangle_at(i, j, x, y), strict=True):
            # A vertex on the last row or column has no weight beyond it.
            place = np.minimum(a, last[0]), np.minimum(b, last[1])
            values += weight[:, None] * np.stack(self._raised_and_lowered(place), axis=-1)
        return values

    def refined_values(self, values: np.ndarray, step: Refinement) -> np.ndarray:
        """Vertex values (V', 2): samples on pixel vertices, linear between them."""
        for edge_ends in step.rounds:
            a, b = (values.take(ends, axis=0) for ends in edge_ends.T)
            x, y = step.mesh.xy[len(values) : len(values) + len(edge_ends)].T
            values = np.concatenate([values, self._sampled(x, y, (a + b) / 2)])
        return values

    def _sampled(self, x: np.ndarray, y: np.ndarray, linear: np.ndarray) -> np.ndarray:
        """Gap (n, 2) at points of a mesh: `linear`, replaced by the samples at pixel vertices."""
        on_pixel = np.flatnonzero((x | y) & (PIXEL - 1) == 0)
        place = x[on_pixel] >> DEPTH, y[on_pixel] >> DEPTH
        linear[on_pixel] = np.stack(self._raised_and_lowered(place), axis=-1)
        return linear

    def _sampled_middles(self, xy: np.ndarray, linear: np.ndarray) -> np.ndarray:
        """Gap (2, 3, n) as of `_sampled` at the midpoints of n triangles with corners (3, n, 2)."""
        x, y = with_middles(xy)[:, 3:].astype(np.int64).reshape(2, -1)
        return self._sampled(x, y, linear.reshape(2, -1).T).T.reshape(linear.shape)

    def _data_of(self, values: np.ndarray, vertices: np.ndarray, xy: np.ndarray) -> CellData:
        gaps = values.take(vertices, axis=0)
        linear = averages.extent(xy)[0] <= PIXEL
        mean_K, mean_inverse_K = _linear_means(gaps, self.law)
        coarse = np.flatnonzero(~linear)
        place = averages.Place.of(xy.take(coarse, axis=1))
        mean_K[coarse], mean_inverse_K[coarse] = self._above_pixel.lookup(place)
        means = mean_K, mean_inverse_K
        return CellData.of_gaps(xy, self.aspect, gaps, linear, means, self.ceiling, self.law)

    def quarter_data(self, xy: np.ndarray, gaps: np.ndarray) -> QuarterData:
        """Averages on the quarters of cells; see `GapOnMesh.quarter_data`."""
        six, (width, is_diagonal) = with_middles(gaps), averages.extent(xy)
        # Triangles two pixels wide have midpoints that are samples.
        two = np.flatnonzero(width == 2 * PIXEL)
        six[:, 3:, two] = self._sampled_middles(xy.take(two, axis=1), six[:, 3:, two])
        mean_K, mean_inverse_K = _quarter_means(six, self.law)
        if not self.law.lower.is_cube:
            mean_inverse_K[:, two] = _resistivity_of_two(six[1][:, two], is_diagonal[two], self.law)
        coarse = np.flatnonzero(width > 2 * PIXEL)
        place = averages.Place.of_quarters(xy.take(coarse, axis=1))
        mean_K[:, coarse], mean_inverse_K[:, coarse] = self._above_pixel.lookup(place)
        return QuarterData.of(mean_K, mean_inverse_K)


class VertexGap(GapOnMesh):
    """The gap is prescribed at the vertices of a mesh, and linear on its triangles.

    Parameters
    ----------
    values : (V,)
        Gap at the vertices of the first mesh, in units of its maximum.
    unit
        Unit of the lengths of the mesh [m].
    cut, floor, ceiling, law
        As for GridGap.
    """

    def __init__(
        self,
        values: np.ndarray,
        unit: float,
        cut: float,
        floor: float,
        ceiling: float = np.inf,
        law: FilmLaw = CUBE,
    ):
        self.aspect = 1 / unit
        self.cut, self.ceiling, self.law = cut, ceiling, law
        self._values = np.stack([_raised(values, floor), _lowered(values, cut)], axis=-1)

    def vertex_values(self, mesh: AnyMesh) -> np.ndarray:
        """Gap (raised, lowered) at the vertices (V, 2) of the first mesh."""
        return self._values

    def refined_values(self, values: np.ndarray, step: Refinement) -> np.ndarray:
        """Vertex values (V', 2): midpoints get the mean of the ends, so the function stays."""
        return step.at_vertices(values)

    def _data_of(self, values: np.ndarray, vertices: np.ndarray, xy: np.ndarray) -> CellData:
        gaps = values.take(vertices, axis=0)
        means, linear = _linear_means(gaps, self.law), np.True_
        return CellData.of_gaps(xy, self.aspect, gaps, linear, means, self.ceiling, self.law)

    def quarter_data(self, xy: np.ndarray, gaps: np.ndarray) -> QuarterData:
        """Averages on the quarters of cells; see `GapOnMesh.quarter_data`."""
        return QuarterData.of(*_quarter_means(with_middles(gaps), self.law))


def _raised(gap: np.ndarray, floor: float) -> np.ndarray:
    """A gap with its positive values raised to the floor, for the primal."""
    return np.where((gap > 0) & (gap < floor), floor, gap)


def _lowered(gap: np.ndarray, cut: float) -> np.ndarray:
    """A gap that is 0, contact, where it was below the cut, for the dual."""
    return np.where(gap < cut, 0.0, gap)


def _linear_means(gaps: np.ndarray, law: FilmLaw) -> tuple[np.ndarray, np.ndarray]:
    """Means (n,) of the conductivity, raised, and of its inverse, lowered, for gaps (3, n, 2)."""
    raised, lowered = np.moveaxis(gaps, -1, 0)
    return (
        averages.conductivity_of_corners(law.upper, *raised),
        averages.resistivity_of_corners(law.lower, *lowered),
    )


def _resistivity_of_two(gaps: np.ndarray, diagonal: np.ndarray, law: FilmLaw) -> np.ndarray:
    """`_quarter_resistivity` (4, n) of cells two pixels wide, some of them diagonal (n,) bool.

    The mean of such a cell is the mean over pixel triangles: its quarters if the cell is diagonal,
    its halves if it is axial. The law is bounded on the same triangles.
    """
    mean, of_axial = np.empty((4, len(diagonal))), gaps[:, ~diagonal]
    mean[:, diagonal] = _quarter_resistivity(gaps[:, diagonal], law, None)
    mean[:, ~diagonal] = _quarter_resistivity(of_axial, law, _span_of_halves(of_axial))
    return mean


def _span_of_halves(gaps: np.ndarray) -> Span:
    """Least and largest gap (2, n) of the halves m a b and m c a, each for every other quarter."""
    a, b, c, m, _, _ = gaps
    return averages.extremes(np.stack([m, m]), np.stack([a, c]), np.stack([b, a]))


def _quarter_means(six: np.ndarray, law: FilmLaw) -> tuple[np.ndarray, np.ndarray]:
    """Means (4, n) as of `_linear_means` on the quarters, for gaps (2, 6, n) of `with_middles`."""
    raised, lowered = six
    mean_K = averages.conductivity_of_corners(law.upper, *on_quarters(raised)).reshape(4, -1)
    return mean_K, _quarter_resistivity(lowered, law, averages.extremes(*lowered[:3]))


def _quarter_resistivity(gaps: np.ndarray, law: FilmLaw, span: Span | None) -> np.ndarray:
    """Mean (4, n) of the inverse conductivity on the quarters, for lowered gaps (6, n).

    The hierarchical correction needs means on the quarters that add up to no more than the mean of
    the cell. So the law is bounded on the same triangles as there: `span` is their least and
    largest gap; None for those of each quarter.
    """
    return averages.resistivity_of_corners(law.lower, *on_quarters(gaps), span).reshape(4, -1)


class ConstantGap(GridGap):
    """Each sample fills one square pixel; no vertex carries a gap."""

    linear = False

    def _means_in(self, pixels: slice | tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """Conductivity and its inverse (2, ...) in some pixels."""
        raised, lowered = self._raised_and_lowered(pixels)
        with np.errstate(divide="ignore"):
            return np.stack([self.law.upper.of_gap(raised), 1 / self.law.lower.of_gap(lowered)])

    def _pixel_means(self, strip: slice) -> np.ndarray:
        return np.stack([self._means_in(strip)] * 2, axis=-1)

    def vertex_values(self, mesh: AnyMesh) -> np.ndarray:
        """No values (V, 0): the gap jumps at the vertices."""
        return np.empty((len(mesh.xy), 0))

    def refined_values(self, values: np.ndarray, step: Refinement) -> np.ndarray:
        """No values (V', 0)."""
        return self.vertex_values(step.mesh)

    def plotted_values(self, mesh: AnyMesh, values: np.ndarray) -> np.ndarray:
        """Gap (V,) of the pixel above and to the right of each vertex, for pictures."""
        i, j = np.minimum(mesh.xy // PIXEL, np.asarray(self.pixels) - 1).T
        return self._raised_and_lowered((i, j))[0]

    def _data_of(self, values: np.ndarray, vertices: np.ndarray, xy: np.ndarray) -> CellData:
        i, j = np.moveaxis(xy.sum(axis=0), -1, 0) // (3 * PIXEL)
        mean_K, mean_inverse_K = self._means_in((i, j))
        coarse = np.flatnonzero(averages.extent(xy)[0] > PIXEL)
        place = averages.Place.of(xy.take(coarse, axis=1))
        mean_K[coarse], mean_inverse_K[coarse] = self._above_pixel.lookup(place)
        # Contact consists of whole pixels: no gap at a corner counts, so no side has a gap of 0.
        gaps, means = np.zeros((3, len(mean_K), 2)), (mean_K, mean_inverse_K)
        return CellData.of_gaps(xy, self.aspect, gaps, np.False_, means, self.ceiling, self.law)

    def quarter_data(self, xy: np.ndarray, gaps: np.ndarray) -> QuarterData:
        """Averages on the quarters of cells; see `GapOnMesh.quarter_data`; gaps are (3, n, 0)."""
        i, j = thrice_centroids(np.moveaxis(xy, -1, 0)) // (3 * PIXEL)
        mean_K, mean_inverse_K = self._means_in((i, j))
        coarse = np.flatnonzero(averages.extent(xy)[0] > 2 * PIXEL)
        place = averages.Place.of_quarters(xy.take(coarse, axis=1))
        mean_K[:, coarse], mean_inverse_K[:, coarse] = self._above_pixel.lookup(place)
        return QuarterData.of(mean_K, mean_inverse_K)


REPRESENTATIONS: dict[str, type[GridGap]] = {"linear": LinearGap, "constant": ConstantGap}
