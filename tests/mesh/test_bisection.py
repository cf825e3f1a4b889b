"""Bisection keeps meshes conforming, nested, and equal on both periodic sides; its edges."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nested_meshes import areas, assert_conforming, refined, side_lengths
from triangulations import ring, scattered_square, square_with_hole

from fem_seal.mesh.bisection import bisect, coarse_mesh, refine
from fem_seal.mesh.nested import DEPTH, TooFine, coarsest_width, uniform_mesh
from fem_seal.mesh.torus import LEAST_SQUARES, squares_across, uniform_torus
from fem_seal.mesh.triangles import TriangleMesh

FAMILIES = {
    "walls": lambda: uniform_mesh((4, 3), 1, periodic_sides=False),
    "one square": lambda: uniform_mesh((1, 1), 1, periodic_sides=False),
    "periodic sides": lambda: uniform_mesh((3, 2), 1, periodic_sides=True),
    "one row": lambda: uniform_mesh((4, 1), 1, periodic_sides=True),
    "torus": lambda: uniform_torus((6, 4), 1),
    "narrow torus": lambda: uniform_torus((1, 3), 1),
    "uneven": lambda: coarse_mesh((11, 14), 8, periodic_sides=False),
    "uneven, periodic sides": lambda: coarse_mesh((13, 10), 4, periodic_sides=True),
    "uneven torus": lambda: uniform_torus((13, 16), 8),
    "ring": lambda: ring(3, 11),
    "square": lambda: scattered_square(30, 1),
    "square with a hole": lambda: square_with_hole(7, 2),
}


def parents(step) -> np.ndarray:
    """For each fine cell the coarse cell that contains it."""
    count = len(step.mesh.cells) - sum(len(second) for _, second in step.halvings.steps)
    return step.halvings.carried(np.arange(count), lambda cells: (cells, cells))


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", range(2))
def test_refined_meshes_are_conforming(family, seed):
    """The two sides of a seam are refined alike, and a shape keeps its labels."""
    first = FAMILIES[family]()
    for mesh, marked, step in refined(first, seed):
        assert_conforming(step.mesh)
        assert areas(step.mesh).sum() == pytest.approx(
            areas(first).sum(), rel=1e-13 * bool(first.blur)
        )
        if isinstance(first, TriangleMesh):
            assert step.mesh.doubled_areas().min() > 0
            assert side_lengths(step.mesh) == pytest.approx(side_lengths(first), rel=1e-13)
        halves = np.bincount(parents(step), minlength=len(mesh.cells))
        assert (halves[marked] >= 2).all()
        # One step halves a triangle and possibly its halves, but no further.
        assert halves.min() >= 1
        assert halves.max() <= 4
        assert np.array_equal(step.mesh.xy[: len(mesh.xy)], mesh.xy)
        assert step.mesh.periodic == mesh.periodic
        if not marked.any():
            assert len(step.mesh.cells) == len(mesh.cells)


@pytest.mark.parametrize("family", FAMILIES)
def test_linear_functions_are_prolonged_exactly(family):
    """Without tolerance where coordinates are integers: the weights are dyadic."""
    for mesh, _, step in refined(FAMILIES[family](), seed=1, steps=3):
        linear, fine = (m.xy @ [3.0, -5.0] + 7 for m in (mesh, step.mesh))
        rounding = {"rtol": 0, "atol": 20 * np.finfo(float).eps * mesh.blur}
        np.testing.assert_allclose(
            step.prolong(linear[mesh.cells]), fine[step.mesh.cells], **rounding
        )
        np.testing.assert_allclose(step.at_vertices(linear), fine, **rounding)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", range(2))
def test_edges_updated_by_bisection_equal_edges_numbered_anew(family, seed):
    """Apart from the order of their numbers, and of twins for each other as ends."""
    for _, _, step in refined(FAMILIES[family](), seed):
        twin, updated = step.mesh.twin, step.mesh.edges
        anew = replace(step.mesh, carried_edges=None).edges
        ends, of_cell = anew.ends, anew.of_cell
        assert np.array_equal(
            np.sort(twin[updated.ends[updated.of_cell]]), np.sort(twin[ends[of_cell]])
        )
        number = np.zeros(len(ends), dtype=np.int32)
        number[of_cell] = updated.of_cell
        assert np.array_equal(np.sort(number), np.arange(len(updated.ends)))
        assert np.array_equal(number[of_cell], updated.of_cell)
        # The number of a side leads back to its cell.
        slots = updated.slots().ravel()
        assert np.array_equal(slots[updated.sides.ravel()], np.arange(updated.sides.size))
        assert np.count_nonzero(slots >= 0) == updated.sides.size


@settings(max_examples=15)
@given(st.tuples(*[st.integers(1, 5)] * 2), st.booleans(), st.integers(0, 10**6))
def test_several_halvings_in_one_call_equal_one_call_for_each(pixels, periodic, seed):
    """They make the same cells in the same order, and carry the same functions to them."""
    rng = np.random.default_rng(seed)
    mesh = refined(uniform_mesh(pixels, 1, periodic), seed, steps=2)[-1][2].mesh
    times = rng.choice(5, len(mesh.cells), p=[0.8, 0.05, 0.05, 0.05, 0.05])
    step = refine(mesh, times)
    assert (np.bincount(parents(step)) >= 2**times).all()
    corner_values, vertex_values = rng.normal(size=mesh.cells.shape), rng.normal(size=len(mesh.xy))
    expected = mesh, corner_values, vertex_values[mesh.cells]
    vertices = vertex_values
    while times.any():
        once = bisect(expected[0], times > 0)
        vertices = once.at_vertices(vertices)
        expected = once.mesh, once.prolong(expected[1]), vertices[once.mesh.cells]
        times = np.maximum(times[parents(once)] - 1, 0)
    fine = expected[0]
    assert np.array_equal(step.mesh.xy[step.mesh.cells], fine.xy[fine.cells])
    assert np.array_equal(
        step.mesh.xy[step.mesh.twin][step.mesh.cells], fine.xy[fine.twin][fine.cells]
    )
    assert np.array_equal(step.prolong(corner_values), expected[1])
    assert np.array_equal(step.at_vertices(vertex_values)[step.mesh.cells], expected[2])


def test_bisection_below_the_resolution_of_coordinates_raises():
    """Coordinates are multiples of 2^-DEPTH pixels, which allows 2 DEPTH halvings of the area."""
    mesh = uniform_mesh((1, 1), 1, periodic_sides=False)
    for _ in range(2 * DEPTH):
        marked = np.zeros(len(mesh.cells), dtype=bool)
        marked[areas(mesh).argmin()] = True
        mesh = bisect(mesh, marked).mesh
    assert areas(mesh).min() == 0.5 / 4.0**DEPTH
    assert areas(mesh).sum() == 1
    marked = np.zeros(len(mesh.cells), dtype=bool)
    marked[areas(mesh).argmin()] = True
    with pytest.raises(TooFine, match="2\\^-24"):
        bisect(mesh, marked)


@pytest.mark.parametrize(
    ("pixels", "at_least", "width"),
    [
        ((256, 256), 32, 8),
        ((256, 64), 32, 2),  # the shorter side decides
        ((96, 96), 8, 8),  # 12 squares; 6 would be too few
        ((255, 256), 8, 16),  # 15.9 squares: they need not fill the side
        ((1, 7), 8, 1),
    ],
)
def test_coarsest_width(pixels, at_least, width):
    assert coarsest_width(pixels, at_least) == width


@pytest.mark.parametrize("pixels", [(16, 24), (16, 23), (25, 24), (90, 70)])
@pytest.mark.parametrize("periodic", [False, True])
def test_a_coarse_mesh_fills_any_rectangle(pixels, periodic):
    """With single pixels at the sides where its squares do not fill it, and few of them inside."""
    mesh = coarse_mesh(pixels, 8, periodic)
    assert areas(mesh).sum() == pixels[0] * pixels[1]
    assert mesh.periodic == periodic
    assert np.array_equal(np.unique(mesh.cells), np.arange(len(mesh.xy)))
    if any(m % 8 for m in pixels):
        assert areas(mesh).min() == 0.5
        # Two triangles a square, beside each pixel of a side its own, and half as many in each of
        # the layers in which they grow.
        assert len(mesh.cells) < 2 * pixels[0] * pixels[1] / 64 + 16 * sum(pixels)
    else:
        assert (areas(mesh) == 32).all()


@pytest.mark.parametrize("pixels", [(1, 1), (1, 3), (4, 8)])
def test_squares_of_the_first_mesh_of_a_torus(pixels):
    """At least LEAST_SQUARES, and never wider than asked for; they fill the cell."""
    mesh = uniform_torus(pixels, 1)
    assert squares_across(mesh) == max(LEAST_SQUARES, min(pixels))
    assert areas(mesh).sum() == pixels[0] * pixels[1]


def test_the_first_guess_on_a_torus_jumps_by_one():
    """Of unit jumps in x and in y: at a copy of a vertex each is larger by the seams crossed."""
    mesh = refined(uniform_torus((5, 5), 1), seed=2)[-1][2].mesh
    for functions in mesh.first_guess():
        np.testing.assert_allclose(
            functions - functions[:, mesh.twin], mesh.on_far_seam.T, atol=1e-15
        )
