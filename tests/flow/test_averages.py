"""Area means of conductivity and resistivity: the pyramid above the pixel; cut, floor, ceiling.

Quarters of triangles, of gases too. Their energies: test_hierarchical; rounding: test_energy.
"""

import numpy as np
import pytest
from gaps import everything, meshed, octaves, represented
from nested_meshes import areas
from sample_gaps import rough_gap

from fem_seal.film.slip_bounds import PressureWeight, bounding_law
from fem_seal.flow.averages import Place, Pyramid
from fem_seal.flow.gap_on_mesh import VertexGap
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.mesh.bisection import bisect
from fem_seal.mesh.nested import PIXEL, uniform_mesh
from fem_seal.rarefied import kinetic

EPS = np.finfo(float).eps


def mean_over_triangle(function, gaps) -> float:
    """Mean of function(g) on a triangle where g is linear, from the distribution of g.

    The area where the gap is between g and g + dg grows linearly from the lowest vertex to the
    middle one and falls linearly to the highest.
    """
    a, b, c = sorted(gaps)
    mean = 0.0
    for low, high, end in ((a, b, a), (b, c, c)):
        if high > low:
            g, weight = octaves(low, high)
            density = 2 * np.abs(g - end) / ((high - low) * (c - a))
            mean += weight @ (density * function(g))
    return mean


def pixel_triangles(mx: int, my: int):
    """Centroids (in sixths of a pixel, integers) and place in (mx, my, 2) of pixel triangles."""
    mesh = uniform_mesh((mx, my), 1, periodic_sides=False)
    corner = mesh.xy[mesh.cells] // PIXEL
    square = corner.min(axis=1)
    upper = (corner[:, 0, 1] > square[:, 1]).astype(int)
    return 2 * corner.sum(axis=1), (square[:, 0], square[:, 1], upper)


def inside(points: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """Which points lie in the triangle with corners in the same integer units."""
    a, b, c = corner

    def cross(u, v, p):
        return (v[0] - u[0]) * (p[:, 1] - u[1]) - (v[1] - u[1]) * (p[:, 0] - u[0])

    turns = np.stack([cross(a, b, points), cross(b, c, points), cross(c, a, points)])
    return (turns > 0).all(axis=0) | (turns < 0).all(axis=0)


@pytest.mark.parametrize("halved", [0, 1])
@pytest.mark.parametrize("width", [2, 8])
@pytest.mark.parametrize("shape", [(16, 24), (72, 8)])  # the latter is summed in strips
def test_pyramid_against_all_pixel_triangles_inside(width, halved, shape):
    """Every coarse cell, diagonal and axial, against the plain mean of what lies in it.

    One quantity spans a decade, the other twelve. Sums of at most 2 · 8² positive terms: 128
    rounding errors at the very worst. One contact makes the mean of 1/K infinite where it lies,
    and nowhere else.
    """
    exponents = np.random.default_rng(width).random((2, *shape, 2))
    pixels = 10 ** (exponents * np.reshape([1, 12], (2, 1, 1, 1)))
    pixels[1, 5, 2, 1] = np.inf
    centroids, (i, j, upper) = pixel_triangles(*shape)
    pyramid = Pyramid.from_pixels(lambda strip: pixels[:, strip], shape, 8)
    mesh = uniform_mesh(shape, width, periodic_sides=False)
    if halved:
        mesh = bisect(mesh, np.ones(len(mesh.cells), dtype=bool)).mesh
    cells = np.flatnonzero(areas(mesh) > 0.5)
    found = pyramid.lookup(Place.of(mesh.xy[mesh.cells[cells].T]))
    for cell, means in zip(cells, found.T, strict=True):
        own = inside(centroids, 6 * (mesh.xy[mesh.cells[cell]] // PIXEL))
        assert own.sum() == 2 * areas(mesh)[cell]
        exact = pixels[:, i[own], j[own], upper[own]].mean(axis=1)
        assert means == pytest.approx(exact, rel=128 * EPS)


@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_raising_and_lowering(representation):
    """The primal sees gaps below the floor raised, the dual those below the cut as contact."""
    samples = np.array([[1.0, 1e-3, 1.0], [0.0, 1.0, 1e-5], [1.0, 1.0, 1e-5]])

    def data(values, **limits):
        gap = represented(GridField(values, (1.0, 1.0)), representation, **limits)
        return gap.cell_data(*meshed(gap))

    raised = np.where(samples > 0, np.maximum(samples, 1e-2), 0)
    lowered = np.where(samples < 1e-4, 0, samples)
    both = data(samples, cut=1e-4, floor=1e-2)
    assert np.array_equal(both.K, data(raised).K)
    assert np.array_equal(both.zero_gap, data(raised).zero_gap)
    for name in ("resistivity", "blocked", "contact_vertex"):
        assert np.array_equal(getattr(both, name), getattr(data(lowered), name))


@pytest.mark.parametrize(("width", "halved"), [(1, 1), (2, 0), (4, 2)])
@pytest.mark.parametrize("highest", [1.0, 100.0])
def test_means_on_the_quarters_of_a_gas_that_slips(width, halved, highest):
    """Neither mean exceeds that of the whole, or the hierarchical correction would take away more
    energy than there is. From the highest gap downwards Kn is 5 to 30, or 0.05 to 0.3."""
    slip = Slip(1.0, 0.1, 30.0, kinetic(1.0))
    field = rough_gap((16, 16), 0.0, 3, smooth=1)
    raised = (field.values + 0.2) / 1.2
    field = GridField(raised, field.spacing, periodic=True)
    weight = PressureWeight.of_gap(slip, highest, 0.3)
    law = bounding_law(slip, highest, weight, weight, 1.0)
    gap = represented(field, "linear", width=8).with_law(law)
    mesh, values = meshed(gap, width, markings=[everything] * halved)
    whole, corner = gap.cell_data(mesh, values), mesh.cells.T
    parts = gap.quarter_data(mesh.xy[corner], values[corner])
    assert (parts.K.mean(axis=0) <= whole.K * (1 + 1e-12)).all()
    resistivity = parts.resistivity.mean(axis=0)
    assert (resistivity <= whole.resistivity[:, 0] * (1 + 1e-12)).all()
    # By Jensen a mean of the resistivity is at least the inverse of that of the conductivity: half
    # of these quarters exceed it by less than 2 % (of the smallest cells) to 37 %.
    assert (parts.resistivity * parts.K >= 1).all()


def test_the_ceiling_does_not_reach_the_quarters():
    """Of resistivities raised to that of the ceiling the mean is not that of the cell. Quarters of
    a shape are those of a grid with the same cells."""
    samples = GridField(np.random.default_rng(0).uniform(0.2, 1, (5, 5)), (1.0, 1.0))
    low, high = (represented(samples, ceiling=ceiling) for ceiling in (0.125, np.inf))
    mesh, values = meshed(low)
    shape = VertexGap(values[:, 0], 1.0, 0.0, 0.0, 0.125)
    for gap in (low, shape):
        assert (gap.cell_data(mesh, values).resistivity[:, 0] == 512).all()
    at_corners = mesh.xy[mesh.cells.T], values[mesh.cells.T]
    found, of_shape, free = (gap.quarter_data(*at_corners) for gap in (low, shape, high))
    for quarters in (found, of_shape):
        assert np.array_equal(quarters.resistivity, free.resistivity)
        assert np.array_equal(quarters.K, free.K)
    assert free.resistivity.max() < 512


@pytest.mark.parametrize("ceiling", [0.1, 0.5, 2.0])
def test_no_open_cell_resists_less_than_the_ceiling(ceiling):
    """Beside contact as well, where the resistivity is that of a power trace: what is next to
    nothing there spoils the contrast that double precision can solve."""
    gap = represented(rough_gap((16, 16), 0.3, 5), ceiling=ceiling)
    data = gap.cell_data(*meshed(gap))
    beside = data.contact_vertex.any(axis=1) & ~data.blocked
    assert np.count_nonzero(beside) > 50
    xx, xy, yy = data.resistivity[~data.blocked].T
    least = (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy)  # the smaller eigenvalue
    assert least.min() >= ceiling**-3 * (1 - 1e-12)
