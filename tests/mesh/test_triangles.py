"""Meshes of any shape: longest edges first, where a ring is cut, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from nested_meshes import assert_conforming, refined
from triangulations import grid_mesh, labelled, ring, ring_parts, scattered_square

from fem_seal.errors import InvalidInput
from fem_seal.mesh.bisection import bisect
from fem_seal.mesh.mesh import BOTTOM, INLET, ISLAND, OUTLET, TOP
from fem_seal.mesh.nested import TooFine
from fem_seal.mesh.shape import shape_mesh


def test_longest_edges_are_halved_first():
    """The smallest angle then stays bounded from below under refinement (I. G. Rosenberg and
    F. Stenger, Math. Comp. 29, 390 (1975))."""

    def smallest_angle(mesh):
        corner = mesh.xy[mesh.cells]
        u, v = np.roll(corner, -1, 1) - corner, np.roll(corner, 1, 1) - corner
        cos = (u * v).sum(2) / np.sqrt((u**2).sum(2) * (v**2).sum(2))
        return np.arccos(cos.max())

    mesh = scattered_square(30, 4)
    corner = mesh.xy[mesh.cells]
    opposite = ((corner[:, [2, 0, 1]] - corner[:, [1, 2, 0]]) ** 2).sum(axis=2)
    assert (opposite[:, 0] >= opposite.max(axis=1) * (1 - 1e-8)).all()
    first = smallest_angle(mesh)
    for _, _, step in refined(mesh, 3, steps=3, part=1.0):
        mesh = step.mesh
        # Newest-vertex bisection makes triangles of at most four similarity classes.
        assert smallest_angle(mesh) > first / 4


def test_bisection_below_rounding_raises():
    mesh = scattered_square(4, 0)
    tiny = replace(mesh, xy=mesh.xy * 2.0**-45 + 1)
    with pytest.raises(TooFine, match=r"edges below 9\.1e-13 of the mesh"):
        bisect(tiny, np.ones(len(mesh.cells), dtype=bool))


def test_a_ring_is_cut_along_one_path():
    """The path runs from inlet to outlet; the cells on its left keep its vertices."""
    mesh = ring(4, 13)
    assert mesh.periodic
    low = mesh.side_ends(mesh.sides == BOTTOM)
    high = mesh.side_ends(mesh.sides == TOP)
    assert len(low) == len(high) == 4  # the fewest edges that join the circles
    assert sorted(map(sorted, mesh.twin[high].tolist())) == sorted(map(sorted, low.tolist()))
    assert (mesh.inlet & mesh.top).sum() == 1
    assert (mesh.outlet & mesh.top).sum() == 1
    # A BOTTOM side runs, with its cell on the left, from the inlet outwards.
    assert (np.hypot(*mesh.xy[low[:, 1]].T) > np.hypot(*mesh.xy[low[:, 0]].T)).all()
    assert (np.hypot(*mesh.xy[high[:, 1]].T) < np.hypot(*mesh.xy[high[:, 0]].T)).all()


def test_cells_are_halved_until_there_is_a_path_to_cut():
    """A ring of islands without a vertex between them: every path meets vertices of walls."""
    xy, cells, _ = ring_parts(3, 8, 1.0, 4.0)
    radius, angle = np.hypot(*xy[cells].mean(axis=1).T), np.arctan2(*xy[cells].mean(axis=1).T)
    sector = np.floor(angle / (np.pi / 4)).astype(int)
    holes = (radius > 2) & (radius < 3) & (sector % 2 == 0)

    def label(p):
        r = np.hypot(*p.T)
        return np.select([r < 1.05, r > 3.5], [INLET, OUTLET], ISLAND)

    mesh = shape_mesh(*labelled(xy, cells[~holes], label))
    assert mesh.periodic
    assert len(mesh.cells) > 2 * np.count_nonzero(~holes)
    assert_conforming(mesh)


@pytest.mark.parametrize("wall", range(5))
def test_a_wall_edge_never_has_both_ends_on_the_inlet(wall):
    """`flow` takes a boundary edge with both ends on the inlet for an inlet edge."""
    xy, cells, sides = ring_parts(2, 5, 1.0, 2.0)
    sides[tuple(np.argwhere(sides == INLET)[wall])] = ISLAND
    mesh = shape_mesh(xy, cells, sides)
    walls = mesh.side_ends(mesh.sides == ISLAND)
    assert not mesh.inlet[walls].all(axis=1).any()
    assert_conforming(mesh)


def relabelled(label):
    mesh = grid_mesh((4, 4), (1.0, 1.0))
    cells = mesh.cells
    return labelled(mesh.xy, cells, label)


def two_inlets(p):
    return np.select([np.abs(p[:, 0] - 0.5) > 0.4999, p[:, 1] < 1e-9], [INLET, OUTLET], ISLAND)


def corner_touches(p):
    return np.select([p[:, 0] < 1e-9, p[:, 1] < 1e-9], [INLET, OUTLET], ISLAND)


@pytest.mark.parametrize(
    ("label", "words"),
    [
        (two_inlets, "inlet of the mesh is in 2 pieces"),
        (corner_touches, "inlet and outlet of the mesh touch at x = 0 m, y = 0 m"),
        (lambda p: np.where(p[:, 0] < 1e-9, INLET, ISLAND), "no outlet"),
        (lambda p: np.where(p[:, 0] < 1e-9, OUTLET, ISLAND), "no inlet"),
    ],
)
def test_arrangements_without_one_inlet_and_one_outlet(label, words):
    with pytest.raises(InvalidInput, match=words):
        shape_mesh(*relabelled(label))


def test_meshes_in_pieces_or_touching_in_a_point_are_refused():
    xy, cells, sides = relabelled(lambda p: np.where(p[:, 0] < 1e-9, INLET, OUTLET))
    apart = (np.concatenate([xy, xy + 5]), np.concatenate([cells, cells + len(xy)]))
    with pytest.raises(InvalidInput, match="2 pieces that share no vertex"):
        shape_mesh(*apart, np.concatenate([sides, sides]))
    square = np.array([[0, 0], [1, 0], [1, 1], [2, 1], [2, 2.0]])
    bow = np.array([[0, 1, 2], [2, 3, 4]])
    with pytest.raises(InvalidInput, match=r"touches itself in the single point x = 1 m, y = 1 m"):
        shape_mesh(*labelled(square, bow, lambda p: np.full(len(p), ISLAND)))
