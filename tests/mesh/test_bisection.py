"""Bisection keeps meshes conforming, nested, and equal on both periodic sides; its edges."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nested_meshes import areas, refined
from triangulations import ring, scattered_square, square_with_hole

from fem_seal.mesh.bisection import TooFine, bisect, refine
from fem_seal.mesh.nested import DEPTH, PIXEL, NestedMesh, uniform_mesh
from fem_seal.mesh.torus import uniform_torus

FAMILIES = {
    "walls": lambda: uniform_mesh((4, 3), 1, periodic_sides=False),
    "periodic sides": lambda: uniform_mesh((3, 2), 1, periodic_sides=True),
    "torus": lambda: uniform_torus((6, 4), 1),
    "ring": lambda: ring(3, 11),
    "square": lambda: scattered_square(30, 1),
    "square with a hole": lambda: square_with_hole(7, 2),
}


def parents(step) -> np.ndarray:
    """For each fine cell the coarse cell that contains it."""
    count = len(step.mesh.cells) - sum(len(second) for _, second in step.halvings.steps)
    return step.halvings.carried(np.arange(count), lambda cells: (cells, cells))


def edge_table(mesh: NestedMesh) -> tuple[np.ndarray, np.ndarray]:
    """Edges as pairs of coordinates (E, 4), and the number of cells (E,) at each."""
    ends = mesh.xy[mesh.cells[:, [[1, 2], [2, 0], [0, 1]]]].reshape(-1, 2, 2)
    swap = (ends[:, 0, 0] > ends[:, 1, 0]) | (
        (ends[:, 0, 0] == ends[:, 1, 0]) & (ends[:, 0, 1] > ends[:, 1, 1])
    )
    ends[swap] = ends[swap][:, ::-1]
    return np.unique(ends.reshape(-1, 4), axis=0, return_counts=True)


def assert_conforming(mesh: NestedMesh) -> None:
    """Every inner edge has two cells; boundary edges have one and cover the boundary once."""
    assert len(np.unique(mesh.xy, axis=0)) == len(mesh.xy)
    table, cells = edge_table(mesh)
    mx, my = (m * PIXEL for m in mesh.squares)
    on_boundary = np.zeros(len(table), dtype=bool)
    for axis, value in [(0, 0), (0, mx), (1, 0), (1, my)]:
        on_boundary |= (table[:, axis] == value) & (table[:, axis + 2] == value)
    assert (cells[on_boundary] == 1).all()
    assert (cells[~on_boundary] == 2).all()
    length = np.abs(table[on_boundary, 2:] - table[on_boundary, :2]).sum()
    assert length == 2 * (mx + my)  # integers: no tolerance
    assert areas(mesh).sum() == mesh.squares[0] * mesh.squares[1]  # dyadic: exact


SHAPES = st.tuples(st.integers(1, 5), st.integers(1, 5))
MANY = settings(max_examples=30, deadline=None)


@MANY
@given(SHAPES, st.booleans(), st.integers(0, 10**6))
def test_refined_meshes_are_conforming(squares, periodic, seed):
    for mesh, marked, step in refined(uniform_mesh(squares, 1, periodic), seed):
        assert_conforming(step.mesh)
        halves = np.bincount(parents(step), minlength=len(mesh.cells))
        assert (halves[marked] >= 2).all()
        # One step halves a triangle and possibly its halves, but no further.
        assert halves.min() >= 1
        assert halves.max() <= 4
        assert np.array_equal(step.mesh.xy[: len(mesh.xy)], mesh.xy)
        if not marked.any():
            assert len(step.mesh.cells) == len(mesh.cells)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", range(3))
def test_linear_functions_are_prolonged_exactly(family, seed):
    """Without tolerance where coordinates are integers: the weights are dyadic."""
    for mesh, _, step in refined(FAMILIES[family](), seed, steps=3):
        linear, fine = (m.xy @ [3.0, -5.0] + 7 for m in (mesh, step.mesh))
        rounding = {"rtol": 0, "atol": 20 * np.finfo(float).eps * mesh.blur}
        np.testing.assert_allclose(
            step.prolong(linear[mesh.cells]), fine[step.mesh.cells], **rounding
        )
        np.testing.assert_allclose(step.at_vertices(linear), fine, **rounding)


@pytest.mark.parametrize("squares", [(4, 1), (3, 2), (5, 3), (2, 4), (1, 1)])
@pytest.mark.parametrize("seed", range(5))
def test_periodic_sides_are_refined_alike(squares, seed):
    """The two sides have the same vertices and edges, and each edge there has two cells."""
    for mesh, _, step in refined(uniform_mesh(squares, 1, True), seed, steps=6, part=0.15):
        fine = step.mesh
        top, bottom = fine.xy[fine.top, 0], fine.xy[fine.bottom, 0]
        assert np.array_equal(np.sort(top), np.sort(bottom))
        assert np.array_equal(fine.xy[fine.twin[fine.top], 0], top)
        assert (fine.xy[fine.twin[fine.top], 1] == 0).all()
        assert np.array_equal(fine.twin[~fine.top], np.flatnonzero(~fine.top))
        ends, of_cell = fine.edges
        number = np.bincount(of_cell.ravel(), minlength=len(ends))
        at_end = (fine.inlet[ends] | fine.outlet[ends]).all(axis=1)
        x = fine.xy[ends][..., 0]
        at_end &= x[:, 0] == x[:, 1]
        assert np.array_equal(number, np.where(at_end, 1, 2))
        assert not fine.top[ends].all(axis=1).any()
        assert step.mesh.periodic == mesh.periodic


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", range(5))
def test_edges_updated_by_bisection_equal_edges_numbered_anew(family, seed):
    """Apart from the order of their numbers, and of twins for each other as ends."""
    for _, _, step in refined(FAMILIES[family](), seed):
        twin, updated = step.mesh.twin, step.mesh.numbered_edges
        ends, of_cell = replace(step.mesh, carried_edges=None).edges
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


@MANY
@given(SHAPES, st.booleans(), st.integers(0, 10**6))
def test_several_halvings_in_one_call_equal_one_call_for_each(squares, periodic, seed):
    """They make the same cells in the same order, and carry the same functions to them."""
    rng = np.random.default_rng(seed)
    mesh = refined(uniform_mesh(squares, 1, periodic), seed, steps=2)[-1][2].mesh
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
