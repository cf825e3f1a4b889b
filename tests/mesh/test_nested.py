"""The nested family: every mesh of it tiles the rectangle by right isosceles triangles."""

import numpy as np
import pytest
from nested_meshes import areas, corners

from fem_seal.mesh.bisection import bisect
from fem_seal.mesh.nested import PIXEL, coarsest_width, uniform_mesh


def sorted_triangles(mesh) -> np.ndarray:
    """Triangles as sorted corners, in sorted order, to compare meshes with."""
    x = mesh.xy[mesh.cells]
    keys = np.sort(x[..., 0] * (1 << 40) + x[..., 1], axis=1)
    return keys[np.lexsort(keys.T)]


@pytest.mark.parametrize(("squares", "width"), [((1, 1), 1), ((5, 3), 1), ((8, 12), 4)])
@pytest.mark.parametrize("halvings", [0, 1, 2, 3])
def test_right_isosceles_with_the_right_angle_first(squares, width, halvings):
    mesh = uniform_mesh(squares, width, periodic_sides=False)
    for _ in range(halvings):
        mesh = bisect(mesh, np.ones(len(mesh.cells), dtype=bool)).mesh
    x = corners(mesh)
    u, v = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    # Dyadic coordinates: these identities hold without rounding.
    assert ((u * v).sum(axis=1) == 0).all()
    assert ((u * u).sum(axis=1) == (v * v).sum(axis=1)).all()
    assert areas(mesh).sum() == squares[0] * squares[1]
    assert len(mesh.cells) == 2 * (squares[0] // width) * (squares[1] // width) * 2**halvings


@pytest.mark.parametrize("width", [1, 2, 4])
def test_diagonals_join_even_vertices(width):
    """Pixel (i, j) is cut from (i, j) to (i+1, j+1) if i + j is even, else the other way."""
    mesh = uniform_mesh((4 * width, 5 * width), width, periodic_sides=False)
    ends = mesh.xy[mesh.cells[:, 1:]] // (width * PIXEL)
    assert (ends.sum(axis=2) % 2 == 0).all()
    assert len(np.unique(np.sort(ends[..., 0] * 100 + ends[..., 1], axis=1), axis=0)) == 20


@pytest.mark.parametrize(("squares", "width"), [((4, 8), 4), ((6, 2), 2), ((3, 5), 1)])
def test_two_halvings_give_the_mesh_of_squares_half_as_wide(squares, width):
    """Below pixel size it is the pixel triangulation of a grid with twice the samples."""
    fine = uniform_mesh(squares, width, periodic_sides=False)
    for _ in range(2):
        fine = bisect(fine, np.ones(len(fine.cells), dtype=bool)).mesh
    if width > 1:
        same = uniform_mesh(squares, width // 2, periodic_sides=False)
        assert np.array_equal(sorted_triangles(fine), sorted_triangles(same))
    else:
        doubled = uniform_mesh((2 * squares[0], 2 * squares[1]), 1, periodic_sides=False)
        half = 2 * fine.xy
        assert np.array_equal(np.sort(np.unique(half, axis=0), axis=0), np.sort(doubled.xy, axis=0))
        ends = half[fine.cells[:, 1:]] // PIXEL
        assert (ends.sum(axis=2) % 2 == 0).all()


def test_sides_and_pixels():
    """inlet, outlet, bottom and top are the vertices of their lines; halving halves the areas."""
    mesh = uniform_mesh((4, 8), 2, periodic_sides=True)
    x = mesh.points((3e-6, 1e-6))
    assert x.max(axis=0) == pytest.approx((12e-6, 8e-6), rel=1e-15, abs=0)
    for side, axis, value in [
        (mesh.inlet, 0, 0.0),
        (mesh.outlet, 0, 12e-6),
        (mesh.bottom, 1, 0.0),
        (mesh.top, 1, 8e-6),
    ]:
        assert np.array_equal(side, np.isclose(x[:, axis], value, rtol=1e-12, atol=1e-18))
    assert mesh.periodic
    assert np.array_equal(mesh.xy[mesh.twin[mesh.top]][:, 0], mesh.xy[mesh.top][:, 0])
    assert (mesh.xy[mesh.twin[mesh.top]][:, 1] == 0).all()
    assert np.array_equal(mesh.twin[~mesh.top], np.flatnonzero(~mesh.top))
    # Squares two wide → triangles of area 2; halved twice they are pixel triangles of area 1/2.
    for area in (2.0, 1.0, 0.5, 0.25):
        assert (areas(mesh) == area).all()
        mesh = bisect(mesh, np.ones(len(mesh.cells), dtype=bool)).mesh


@pytest.mark.parametrize(
    ("squares", "at_least", "width"),
    [
        ((256, 256), 32, 8),
        ((256, 64), 32, 2),  # the shorter side decides
        ((96, 96), 8, 8),  # 96 = 32 · 3: 12 squares; 6 would be too few
        ((255, 256), 8, 1),  # an odd side starts at the pixel
        ((24, 40), 3, 8),
        ((1, 7), 8, 1),
    ],
)
def test_coarsest_width(squares, at_least, width):
    assert coarsest_width(squares, at_least) == width
