"""Seams of a cell that is periodic in both directions, on meshes of the nested family.

The mesh is that of a rectangle. It becomes a torus when opposite sides have vertices at the same
positions (`unmatched` marks the cells to halve until they do) and each such pair is one point
(`seams`).
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.mesh.nested import NestedMesh


@dataclass(frozen=True, eq=False)
class Seams:
    """Vertices that are the same point of the torus.

    Attributes
    ----------
    twin : (V,) int
        For each vertex the one with x < Lx and y < Ly that is the same point.
    copy : (V, 2) int8
        Periodic copy of the cell that the vertex belongs to, along each axis: 1 at x = Lx and at
        y = Ly, else 0.
    """

    twin: np.ndarray
    copy: np.ndarray


def seams(mesh: NestedMesh) -> Seams:
    """Pair the vertices of opposite sides, which must match (see `unmatched`)."""
    twin = np.arange(len(mesh.xy))
    for low, high, along in _sides(mesh):
        order = low[np.argsort(mesh.xy[low, along])]
        twin[high] = order[np.searchsorted(mesh.xy[order, along], mesh.xy[high, along])]
    # The corner (Lx, Ly) is paired with (Lx, 0), and that with (0, 0).
    twin = twin[twin]
    return Seams(twin, np.stack([mesh.outlet, mesh.top], axis=1).astype(np.int8))


def unmatched(mesh: NestedMesh) -> np.ndarray:
    """(C,) bool: cells whose boundary side has a vertex of the opposite side inside it."""
    marked = np.zeros(len(mesh.cells), dtype=bool)
    for low, high, along in _sides(mesh):
        for side, opposite in ((low, high), (high, low)):
            on_side = np.zeros(len(mesh.xy), dtype=bool)
            on_side[side] = True
            touching = np.flatnonzero(on_side[mesh.cells].sum(axis=1) == 2)
            corners = mesh.cells[touching]
            position = np.where(on_side[corners], mesh.xy[corners, along], -1)
            end = position.max(axis=1)
            start = np.where(position < 0, end[:, None], position).min(axis=1)
            facing = np.sort(mesh.xy[opposite, along])
            inside = np.searchsorted(facing, end, "left") - np.searchsorted(facing, start, "right")
            marked[touching[inside > 0]] = True
    return marked


def _sides(mesh: NestedMesh) -> tuple[tuple[np.ndarray, np.ndarray, int], ...]:
    """Vertices of each pair of opposite sides, and the axis along them."""
    left, right, low, high = map(np.flatnonzero, (mesh.inlet, mesh.outlet, mesh.bottom, mesh.top))
    return (left, right, 1), (low, high, 0)


def seam_pairs(mesh: NestedMesh, slots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pair the sides of cells that are the same edge of the torus.

    Parameters
    ----------
    mesh : NestedMesh
        Vertices of opposite sides match.
    slots : (n,) int
        Boundary sides, as 3 cell + side.

    Returns
    -------
    pairs : (m, 2) int
        The slot at x = Lx or y = Ly, and the one at x = 0 or y = 0.
    jump : (m, 2) int
        The seam crossed from the first to the second: (1, 0) or (0, 1).
    """
    corner = mesh.cells[slots // 3]
    side = slots % 3
    rows = np.arange(len(slots))
    ends = np.stack([corner[rows, (side + 1) % 3], corner[rows, (side + 2) % 3]], axis=1)
    pairs, jumps = [np.empty((0, 2), dtype=slots.dtype)], [np.empty((0, 2), dtype=int)]
    for axis, (low, high) in enumerate(((mesh.inlet, mesh.outlet), (mesh.bottom, mesh.top))):
        along = mesh.xy[ends, 1 - axis].min(axis=1)
        first, second = (np.flatnonzero(on[ends].all(axis=1)) for on in (high, low))
        _, a, b = np.intersect1d(along[first], along[second], return_indices=True)
        pairs.append(np.stack([slots[first[a]], slots[second[b]]], axis=1))
        jumps.append(np.tile(np.eye(2, dtype=int)[axis], (len(a), 1)))
    return np.concatenate(pairs), np.concatenate(jumps)


def squares_across(mesh: NestedMesh) -> int:
    """Number of edges along the side of the rectangle that has fewer."""
    return min(len(np.flatnonzero(side)) - 1 for side in (mesh.inlet, mesh.bottom))
