"""Corners and areas of nested meshes in pixels; random refinements of any mesh."""

import numpy as np

from fem_seal.mesh.bisection import AnyMesh, Refinement, bisect
from fem_seal.mesh.nested import PIXEL, NestedMesh


def corners(mesh: NestedMesh) -> np.ndarray:
    """(C, 3, 2) corner coordinates in pixels; exact, the coordinates are dyadic."""
    return mesh.xy[mesh.cells] / PIXEL


def areas(mesh: NestedMesh) -> np.ndarray:
    """(C,) area of each triangle by the cross product of two edges; exact."""
    x = corners(mesh)
    u, v = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    return np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2


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
