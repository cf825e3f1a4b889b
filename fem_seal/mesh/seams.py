"""Seams of a cell that is periodic in both directions, on meshes of the nested family.

The mesh itself is that of a rectangle. What makes it a torus is that opposite sides have vertices
at the same places, which `matched` takes care of, and that these are one point, which `seams` says.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.mesh.nested import NestedMesh


@dataclass(frozen=True, eq=False)
class Seams:
    """Which vertices are one point of the torus.

    twin : (V,) int, the vertex with x < Lx and y < Ly that is the same point
    copy : (V, 2) int8, which copy of the cell the vertex belongs to: 1 at x = Lx, at y = Ly
    """

    twin: np.ndarray
    copy: np.ndarray


def seams(mesh: NestedMesh) -> Seams:
    """Pair the vertices of opposite sides; they must match (see `unmatched`)."""
    twin = np.arange(len(mesh.xy))
    for low, high, along in _sides(mesh):
        order = low[np.argsort(mesh.xy[low, along])]
        twin[high] = order[np.searchsorted(mesh.xy[order, along], mesh.xy[high, along])]
    # A corner has a twin along either axis, which has one along the other.
    twin = twin[twin]
    return Seams(twin, np.stack([mesh.outlet, mesh.top], axis=1).astype(np.int8))


def unmatched(mesh: NestedMesh) -> np.ndarray:
    """Cells (C,) bool whose side on the boundary has vertices opposite where it has none."""
    marked = np.zeros(len(mesh.cells), dtype=bool)
    for low, high, along in _sides(mesh):
        for own, other in ((low, high), (high, low)):
            on_side = np.zeros(len(mesh.xy), dtype=bool)
            on_side[own] = True
            touching = np.flatnonzero(on_side[mesh.cells].sum(axis=1) == 2)
            place = np.where(
                on_side[mesh.cells[touching]], mesh.xy[mesh.cells[touching], along], -1
            )
            end = place.max(axis=1)
            start = np.where(place < 0, end[:, None], place).min(axis=1)
            there = np.sort(mesh.xy[other, along])
            between = np.searchsorted(there, end, "left") - np.searchsorted(there, start, "right")
            marked[touching[between > 0]] = True
    return marked


def _sides(mesh: NestedMesh) -> tuple[tuple[np.ndarray, np.ndarray, int], ...]:
    """Vertices of each pair of opposite sides, and the axis that runs along them."""
    left, right, low, high = map(np.flatnonzero, (mesh.inlet, mesh.outlet, mesh.bottom, mesh.top))
    return (left, right, 1), (low, high, 0)


def seam_pairs(mesh: NestedMesh, slots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Join sides of cells across the seams.

    Parameters
    ----------
    mesh : with matching seams
    slots : (n,) of boundary sides, as 3 cell + side

    Returns
    -------
    pairs : (m, 2), the slot at x = Lx or y = Ly first, then the one at 0
    jump : (m, 2) int, the seam crossed from the first to the second
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
    """Edges along the shorter side, at least so many as vertices allow telling apart."""
    return min(len(np.flatnonzero(side)) - 1 for side in (mesh.inlet, mesh.bottom))
