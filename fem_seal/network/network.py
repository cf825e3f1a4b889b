"""The network for the fluid's pressure, and how it is joined to the samples of a contact.

On the right isosceles triangles of the nested family (`mesh.nested`) the stiffness matrix of linear
elements is that of a network along the legs: a leg carries half of each triangle beside it. So a
mesh of any mixture of sizes makes a network, on the contact's own grid, a coarser one, or a finer
one where the pressure needs it. A link conducts as one over the mean of 1/g³ between the gaps at
its two ends or, where each sample fills one pixel, as the two triangles beside it.

Where pixels are not square, triangles between those of different sizes have no right angle. Their
longest side is then a link as well. Its weight, half the cotangent of the opposite angle, is
negative where that is obtuse; it conducts as the harmonic mean of the two legs, with which the
matrix stays positive definite (docs/theory/lift.md).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from sys import float_info
from typing import Self

import numpy as np
from scipy import sparse

from fem_seal.errors import Inconsistent
from fem_seal.film.grid_film import GridFilm
from fem_seal.finite_difference.links import LinkRule, arithmetic, harmonic_mean, linear_gap
from fem_seal.mesh.bisection import doerfler, refine, times_halved
from fem_seal.mesh.nested import DEPTH, PIXEL, NestedMesh, triangle_at, uniform_mesh

# Both are far above rounding. A point lies in a triangle if no barycentric coordinate is below
# -OUTSIDE; an angle is a right one if half its cotangent is below RIGHT_ANGLE.
OUTSIDE = 1e-9
RIGHT_ANGLE = 1e-9
# Step of central differences at which their own error, its square, is that of rounding, ε/STEP.
STEP = float_info.epsilon ** (1 / 3)
# Relative error of a link one sample long in a uniform gap, over that of one whose gap varies, by
# representation. The gap of a pixel is uniform, and the pressure in it is bent at its corners.
SMOOTH_ERROR = {"linear": 0.01, "constant": 0.1}


@dataclass(frozen=True, eq=False)
class Network:
    """Links along the legs of a mesh; places are where its gaps are: nodes, or triangles."""

    mesh: NestedMesh
    legs: np.ndarray  #: (C, 2), link along each leg of a triangle
    film: GridFilm  #: a film on the grid of the contact
    #: (2, links), nodes at the two ends of each link: legs first, then longest sides
    ends: np.ndarray
    between: np.ndarray  #: (2, legs), places whose gaps give the conductivity of a leg
    weight: np.ndarray  #: (links,), width of each link over its length
    to_places: sparse.csr_array  #: gap at the places from that at the samples
    to_samples: sparse.csr_array  #: pressure at the samples from that at the nodes
    inlet: np.ndarray  #: (nodes,) bool, nodes with the pressure of the inlet
    free: np.ndarray  #: (nodes,) bool, nodes whose pressure is unknown
    in_series: np.ndarray  #: (2, longest sides), legs that conduct as each longest side, in series

    def __post_init__(self) -> None:
        links = self.between.shape[1] + self.in_series.shape[1]
        if self.ends.shape != (2, links) or self.weight.shape != (links,):
            raise Inconsistent(
                f"a network of {links} links, with ends {self.ends.shape} and "
                f"{len(self.weight)} weights"
            )
        if (self.inlet & self.free).any():
            raise Inconsistent("a network with unknowns at the inlet")

    @property
    def mean_of_cubes(self) -> LinkRule:
        """Conductivity between the gaps at two places: 1/mean(1/g³), or the mean of two pixels."""
        return linear_gap if self.film.representation == "linear" else arithmetic

    def conductances(self, gap: np.ndarray) -> np.ndarray:
        """Conductances (links,) with a gap at the places, times 12 η."""
        of_legs = self.mean_of_cubes(*gap[self.between])
        return self.weight * np.append(of_legs, harmonic_mean(*of_legs[self.in_series]))

    def conductances_by_gap(self, gap: np.ndarray) -> sparse.csr_array:
        """Derivatives (links, places) of the conductances by the gap at the places."""
        rule, (a, b) = self.mean_of_cubes, gap[self.between]
        by_a = (rule(a * (1 + STEP), b) - rule(a * (1 - STEP), b)) / (2 * STEP * a)
        by_b = (rule(a, b * (1 + STEP)) - rule(a, b * (1 - STEP))) / (2 * STEP * b)
        matrix = _sums(self.between.T, np.stack([by_a, by_b], axis=1), len(gap))
        if self.in_series.size:
            one, other = rule(a, b)[self.in_series]
            first, second = (matrix[legs] for legs in self.in_series)
            # Of the harmonic mean 2 u v/(u + v), by u and by v.
            by_first, by_second = 2 * np.stack([other, one]) ** 2 / (one + other) ** 2
            of_longest = _times(by_first, first) + _times(by_second, second)
            matrix = sparse.csr_array(sparse.vstack([matrix, of_longest]))
        return _times(self.weight, matrix)

    @classmethod
    def uniform(cls, film: GridFilm, width: int) -> Self:
        """A network of triangles as wide as so many samples, a divisor of those along each side."""
        return cls.on_mesh(film, uniform_mesh(film.pixels, width, film.sides == "periodic"))

    @classmethod
    def on_mesh(cls, film: GridFilm, mesh: NestedMesh) -> Self:
        """The network of a mesh."""
        linear, cells = film.representation == "linear", mesh.twin[mesh.cells]
        count = len(mesh.xy)
        low, high = np.sort(cells[:, [[0, 1], [0, 2]]].reshape(-1, 2).astype(np.int64), axis=1).T
        key, first, legs = np.unique(low * count + high, return_index=True, return_inverse=True)
        ends = np.stack(np.divmod(key, count))
        last = np.empty(len(key), dtype=np.int64)
        last[legs] = np.arange(len(legs))
        own = np.arange(count) == mesh.twin
        of_legs, of_longest = _half_cotangents(mesh, film.gap.spacing)
        legs = legs.reshape(-1, 2)
        oblique = np.flatnonzero(np.abs(of_longest) > RIGHT_ANGLE)
        return cls(
            mesh=mesh,
            legs=legs,
            film=film,
            ends=np.hstack([ends, cells[oblique, 1:].T]),
            between=ends if linear else np.stack([first, last]) // 2,
            weight=np.append(np.bincount(legs.ravel(), of_legs.ravel()), of_longest[oblique]),
            to_places=_gap_at_vertices(mesh, film) if linear else _gap_of_cells(mesh, film),
            to_samples=_pressure_at_samples(mesh, cells, film.gap.shape, 0.0 if linear else 0.5),
            inlet=mesh.inlet,
            free=own & ~mesh.inlet & ~mesh.outlet,
            in_series=legs[oblique].T,
        )

    def past_legs(self, gap: np.ndarray) -> np.ndarray:
        """Conductances (C,) of triangles along their longest sides, without the legs, times 12 η.

        Where the gap is closed at the right angle, the legs conduct nothing; a film that is open at
        the other two corners leads through all the same. Zero where a sample fills a pixel, whose
        gap is even. The gap is that at the places.
        """
        corners = self.mesh.twin[self.mesh.cells]
        if self.film.representation == "constant":
            return np.zeros(len(corners))
        right, a, b = gap[corners.T]
        # Legs of an even gap conduct half as much as the gap each, one after the other.
        legs = harmonic_mean(linear_gap(right, a), linear_gap(right, b))
        return np.maximum(linear_gap(a, b) - legs, 0) / 4

    def refined(
        self,
        of_links: np.ndarray,
        share: float,
        varies: np.ndarray,
        anyway: np.ndarray | None = None,
        film: GridFilm | None = None,
    ) -> Self:
        """Network whose triangles are half as wide where they hold a share of a sum over links.

        A link's error falls with the square of its length: each triangle counts by its area, and by
        its legs. Where pixels of unlike gaps meet in a corner it falls more slowly: triangles that
        count far more than the others become a quarter as wide (`bisection.times_halved`).

        Parameters
        ----------
        of_links : (links,)
        share
            Part of the sum over triangles that those to be halved hold.
        varies : (legs,)
            Square of the relative variation of the gap along each leg. Triangles within a pixel
            count by its largest value on their legs, which falls with their area where the gap is
            smooth, and hardly where it closes.
        anyway : (C,)
            Bool, triangles that are halved whatever their links tell.
        film
            One of the same patch with as many samples or more; that of this network if None.
        """
        mesh, legs = self.mesh, self.legs
        a, b = (mesh.xy[corner] / PIXEL for corner in mesh.cells.T[:2])
        shared = np.bincount(legs.ravel())
        of_cells = (of_links[: len(shared)] / shared)[legs].sum(axis=1)
        area = ((b - a) ** 2).sum(axis=1)
        inside = varies[legs].max(axis=1) + SMOOTH_ERROR[self.film.representation] * area
        of_cells *= np.where(area > 1, area, inside)
        marked = doerfler(of_cells, share)
        times = np.where(marked, np.maximum(times_halved(of_cells, marked), 2), 0)
        if anyway is not None:
            times[anyway] = np.maximum(times[anyway], 2)
        film = film or self.film
        pixels = film.gap.shape[0] // self.film.gap.shape[0]
        return self.on_mesh(film, refine(mesh, times).mesh.in_pixels(pixels))


def _sums(columns: np.ndarray, shares: np.ndarray, count: int) -> sparse.csr_array:
    """Matrix that sums a few of `count` values for each row (n, k), each times its share (n, k)."""
    rows = np.arange(0, columns.size + 1, columns.shape[1])
    matrix = sparse.csr_array((shares.ravel(), columns.ravel(), rows), (len(columns), count))
    matrix.eliminate_zeros()
    return matrix


def _times(factors: np.ndarray, matrix: sparse.csr_array) -> sparse.csr_array:
    """Matrix with each row times a factor."""
    return sparse.csr_array(sparse.diags(factors) @ matrix)


def _half_cotangents(
    mesh: NestedMesh, spacing: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Width over length that a triangle adds to its legs (C, 2), and to its longest side (C,)."""
    _, b, c = np.moveaxis(mesh.corners(np.array(spacing), mesh.cells), 1, 0)
    double_area = np.abs(b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])[:, None]
    dots = np.stack([((c - b) * c).sum(axis=1), ((b - c) * b).sum(axis=1), (b * c).sum(axis=1)], 1)
    half = dots / (2 * double_area)
    return half[:, :2], half[:, 2]


def _gap_at_vertices(mesh: NestedMesh, film: GridFilm) -> sparse.csr_array:
    """Gap at the vertices, linear on the triangles of the pixels, from that at the samples."""
    (i, j), (x, y) = (mesh.xy >> DEPTH).T, (mesh.xy & (PIXEL - 1)).T / PIXEL
    corners, weights = triangle_at(i, j, x, y)
    columns = np.stack([_sample(film, *corner) for corner in corners], axis=1)
    return _sums(columns, np.stack(weights, axis=1), film.gap.values.size)


def _gap_of_cells(mesh: NestedMesh, film: GridFilm) -> sparse.csr_array:
    """Gap of the pixel in which the centre of each triangle lies."""
    i, j = (mesh.xy[mesh.cells].sum(axis=1) // (3 * PIXEL)).T
    sample = _sample(film, i, j)[:, None]
    return _sums(sample, np.ones(sample.shape), film.gap.values.size)


def _sample(film: GridFilm, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Number of the sample of row i and column j; the first ones follow the last ones."""
    nx, ny = film.gap.shape
    number: np.ndarray = i % nx * ny + j % ny
    return number


def _pressure_at_samples(
    mesh: NestedMesh, nodes: np.ndarray, shape: tuple[int, int], first: float
) -> sparse.csr_array:
    """Pressure at the samples of a shape, linear on each triangle, from that at its nodes (C, 3).

    The first sample has the coordinate `first` [pixels] along both axes. A sample is a vertex, or
    lies in a triangle whose legs are at least a pixel long.
    """
    columns, shares = _corners_of_samples(mesh, nodes, shape, first)
    sample = mesh.xy - int(first * PIXEL)
    own = np.flatnonzero(((sample % PIXEL == 0) & (sample < np.array(shape) * PIXEL)).all(axis=1))
    at_vertices = np.ravel_multi_index(tuple((sample[own] >> DEPTH).T), shape)
    columns[at_vertices, 0], shares[at_vertices] = mesh.twin[own], (1.0, 0.0, 0.0)
    return _sums(columns, shares, len(mesh.xy))


def _corners_of_samples(
    mesh: NestedMesh, nodes: np.ndarray, shape: tuple[int, int], first: float
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n, 3) of the triangle in which each sample of a shape lies, and their shares there.

    The triangles are those with legs of at least a pixel; a sample in none of them has shares of 0.
    They have whole pixels as coordinates, so that all of one form hold samples at the same places,
    in the same shares.
    """
    # Triangles at the end of the grid reach to one row and one column more.
    cell, place = np.zeros((2, shape[0] + 1, shape[1] + 1), dtype=np.int32)
    shares, known = [np.zeros((1, 3))], 1  # row `place` of all shares is that of a sample
    for cells, corner, legs in _forms(mesh):
        offsets, of_corners = _samples_inside(legs, first)
        for number, (i, j) in enumerate(offsets, known):
            at = corner[:, 0] + i, corner[:, 1] + j
            cell[at], place[at] = cells, number
        shares.append(of_corners)
        known += len(offsets)
    inside = slice(shape[0]), slice(shape[1])
    return nodes[cell[inside].ravel()], np.concatenate(shares)[place[inside].ravel()]


def _forms(mesh: NestedMesh) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Triangles with legs of at least a pixel, by their form.

    Yields
    ------
    (n,)
        Triangles of one form.
    (n, 2)
        Their right angles [pixels].
    (2, 2)
        Legs from there to the other corners [pixels].
    """
    corners = mesh.xy[mesh.cells]
    wide = np.flatnonzero(np.abs(corners[:, 1] - corners[:, 0]).max(axis=1) >= PIXEL)
    corners = corners[wide] >> DEPTH
    legs = corners[:, 1:] - corners[:, :1]
    # The second leg is the first one, turned by a right angle to the left or to the right.
    (bx, by), (cx, cy) = np.moveaxis(legs, 0, -1)
    form = 2 * (2 * max(mesh.pixels) * bx + by) + (bx * cy > by * cx)
    for one in np.unique(form):
        alike = np.flatnonzero(form == one)
        yield wide[alike], corners[alike, 0], legs[alike[0]]


def _samples_inside(legs: np.ndarray, first: float) -> tuple[np.ndarray, np.ndarray]:
    """Samples in a triangle of a form: whole pixels (n, 2) from its right angle, and shares (n, 3).

    A function that is linear on the triangle has at a sample the sum of its values at the three
    corners, each times its share (barycentric coordinates).
    """
    reach = np.arange(-np.abs(legs).max(), np.abs(legs).max() + 1)
    offsets = np.stack(np.meshgrid(reach, reach), axis=-1).reshape(-1, 2)
    along = np.linalg.solve(legs.T, (offsets + first).T).T
    shares = np.column_stack([1 - along.sum(axis=1), along])
    inside = (shares >= -OUTSIDE).all(axis=1)
    return offsets[inside], shares[inside]
