"""Seams: opposite sides match after any refinement, and pairs of vertices are one point."""

import numpy as np
import pytest

from fem_seal.mesh.bisection import bisect
from fem_seal.mesh.nested import PIXEL, uniform_mesh
from fem_seal.mesh.seams import seam_pairs, seams, squares_across, unmatched


def refined(squares=(6, 4), rounds=4, seed=0):
    """A mesh bisected at random, with matching seams."""
    rng = np.random.default_rng(seed)
    mesh = uniform_mesh(squares, 1, periodic_sides=False)
    for _ in range(rounds):
        mesh = bisect(mesh, rng.random(len(mesh.cells)) < 0.2).mesh
        while (marked := unmatched(mesh)).any():
            mesh = bisect(mesh, marked).mesh
    return mesh


def test_uniform_meshes_match():
    assert not unmatched(uniform_mesh((5, 7), 1, periodic_sides=False)).any()


def test_a_vertex_on_one_side_only_marks_the_opposite_cell():
    mesh = uniform_mesh((4, 4), 1, periodic_sides=False)
    while mesh.xy[mesh.inlet].shape[0] == 5:
        touching = mesh.inlet[mesh.cells].sum(axis=1) == 2
        mesh = bisect(mesh, touching).mesh
    marked = unmatched(mesh)
    assert marked.any()
    assert (mesh.outlet[mesh.cells[marked]].sum(axis=1) == 2).all()


@pytest.mark.parametrize("squares", [(6, 4), (5, 5)])
def test_twins_are_whole_cells_apart(squares):
    mesh = refined(squares)
    torus = seams(mesh)
    distance = mesh.xy - mesh.xy[torus.twin]
    np.testing.assert_array_equal(distance, torus.copy * np.array(squares) * PIXEL)
    assert not torus.copy[torus.twin].any()
    corner = (mesh.outlet & mesh.top).nonzero()[0]
    assert (mesh.xy[torus.twin[corner]] == 0).all()


def test_every_side_on_a_seam_has_a_partner():
    mesh = refined()
    _, of_cell = mesh.edges
    boundary = np.flatnonzero((np.bincount(of_cell.ravel())[of_cell] == 1).ravel())
    pairs, jump = seam_pairs(mesh, boundary)
    np.testing.assert_array_equal(np.sort(pairs.ravel()), boundary)
    # Euler characteristic of a torus: V - E + F = 0, counting vertices and edges of a seam once.
    points = len(np.unique(seams(mesh).twin))
    edges = int(of_cell.max()) + 1 - len(pairs)
    assert points - edges + len(mesh.cells) == 0
    assert set(map(tuple, jump.tolist())) == {(1, 0), (0, 1)}


def test_squares_across():
    assert squares_across(uniform_mesh((6, 4), 2, periodic_sides=False)) == 2
