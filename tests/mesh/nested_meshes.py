"""Corners and areas of nested meshes in pixels."""

import numpy as np

from fem_seal.mesh.nested import PIXEL, NestedMesh


def corners(mesh: NestedMesh) -> np.ndarray:
    """(C, 3, 2) corner coordinates in pixels; exact, the coordinates are dyadic."""
    return mesh.xy[mesh.cells] / PIXEL


def areas(mesh: NestedMesh) -> np.ndarray:
    """(C,) area of each triangle by the cross product of two edges; exact."""
    x = corners(mesh)
    u, v = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    return np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
