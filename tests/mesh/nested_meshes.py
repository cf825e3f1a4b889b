"""Areas of meshes, nested ones in pixels; random refinements, and what keeps them conforming."""

import numpy as np

from fem_seal.mesh.bisection import AnyMesh, Refinement, bisect
from fem_seal.mesh.mesh import BOTTOM, INSIDE, TOP, ends_of_sides
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.torus import Torus
from fem_seal.mesh.triangles import TriangleMesh


def areas(mesh: AnyMesh) -> np.ndarray:
    """(C,) area of each triangle by the cross product of two edges; exact where it is dyadic."""
    u, v = np.moveaxis(mesh.corners(1.0, mesh.cells)[:, 1:], 1, 0)
    return np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2


def side_lengths(mesh: TriangleMesh) -> dict[str, float]:
    """Total length of the boundary edges of each group."""
    return {
        name: np.linalg.norm(np.diff(mesh.xy[ends], axis=1), axis=2).sum()
        for name, ends in mesh.groups()
    }


def refined(
    mesh: AnyMesh, seed: int, steps: int = 5, part: float = 0.2
) -> list[tuple[AnyMesh, np.ndarray, Refinement]]:
    """(mesh, marked cells, refinement) of random markings, one after the other."""
    rng = np.random.default_rng(seed)
    history = []
    for _ in range(steps):
        marked = rng.random(len(mesh.cells)) < part
        history.append((mesh, marked, bisect(mesh, marked)))
        mesh = history[-1][2].mesh
    return history


def assert_conforming(mesh: AnyMesh) -> None:
    """Sides have two cells, those on the rim one; a point is one vertex but for copies on seams."""
    on_seam = np.isin(mesh.sides, (BOTTOM, TOP)) & mesh.periodic
    rim, across = (mesh.sides != INSIDE) & ~on_seam, 0
    if isinstance(mesh, NestedMesh):
        ends, seams = mesh.xy[ends_of_sides(mesh.cells)], [isinstance(mesh, Torus), mesh.periodic]
        on_line = [(ends == place).all(axis=2) & ~np.array(seams) for place in (0, mesh.extent)]
        np.testing.assert_array_equal(rim, np.logical_or(*on_line).any(axis=2))
        across = (mesh.xy == mesh.extent) * mesh.extent * seams
    of_cell = mesh.edges.of_cell
    np.testing.assert_array_equal(np.bincount(of_cell.ravel())[of_cell], np.where(rim, 1, 2))
    np.testing.assert_array_equal(mesh.xy - mesh.xy[mesh.twin], across)
    own = np.flatnonzero(mesh.twin == np.arange(len(mesh.xy)))
    assert len(np.unique(mesh.xy[own], axis=0)) == len(own)
    assert np.isin(mesh.twin, own).all()
