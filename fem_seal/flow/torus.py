"""Numberings of a cell that is periodic in both directions: who jumps where, and what winds.

A pressure with mean gradient e grows by e·(Lx, 0) across the seam x = Lx and by e·(0, Ly) across
y = Ly; a stream function of mean flux f likewise by -f_y Lx and f_x Ly. Both are a periodic
function plus J·n, where n counts the seams crossed and J are the two jumps. Open cells carry flow
only if they wind around the cell; contact patches that wind by n restrict the jumps of the stream
function to J·n = 0.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.flow.gap_on_mesh import CellData
from fem_seal.flow.numbering import Unknowns, numbered
from fem_seal.flow.unknowns import (
    components,
    continuous_labels,
    passable_sides,
    patch_ties,
)
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.seams import Seams, seam_pairs


@dataclass(frozen=True, eq=False)
class Unwound:
    """Pieces laid out in the plane, joined across the seams.

    root : (n,) int, one piece of each joined cluster
    offset : (n, 2) int, seams crossed from the root to the piece
    windings : (k, 2) int, closed ways around the cell, and `winding_roots` (k,), of which cluster
    """

    root: np.ndarray
    offset: np.ndarray
    windings: np.ndarray
    winding_roots: np.ndarray


def unwind(first: np.ndarray, second: np.ndarray, jump: np.ndarray, count: int) -> Unwound:
    """Join pieces across seams: the copy of `second` next to `first` lies `jump` cells away.

    Parameters
    ----------
    first, second : (m,) pieces; jump : (m, 2) int; count : number of pieces
    """
    neighbours: dict[int, list[tuple[int, tuple[int, int]]]] = {}
    links = np.unique(np.column_stack([first, second, jump]), axis=0)
    for a, b, x, y in links.tolist():
        neighbours.setdefault(a, []).append((b, (x, y)))
        neighbours.setdefault(b, []).append((a, (-x, -y)))
    root, offset = np.arange(count), np.zeros((count, 2), dtype=int)
    placed: dict[int, tuple[int, int]] = {}
    windings: set[tuple[int, int, int]] = set()
    for start in neighbours:
        if start in placed:
            continue
        placed[start] = (0, 0)
        todo = [start]
        while todo:
            here = todo.pop()
            for there, step in neighbours[here]:
                reached = placed[here][0] + step[0], placed[here][1] + step[1]
                if there not in placed:
                    placed[there] = reached
                    root[there], offset[there] = start, reached
                    todo.append(there)
                elif placed[there] != reached:
                    way = reached[0] - placed[there][0], reached[1] - placed[there][1]
                    windings.add((start, *way))
    found = np.array(sorted(windings), dtype=int).reshape(-1, 3)
    return Unwound(root, offset, found[:, 1:], found[:, 0])


def jumps_along(windings: np.ndarray) -> np.ndarray:
    """Jumps (k, 2) of the pressures to solve for: a basis of what differs along the windings.

    Two independent windings let any jump drive a flow; along a single primitive one only
    J·w matters, and one J with J·w = 1 will do.
    """
    if not len(windings):
        return np.empty((0, 2))
    if _rank(windings) == 2:
        return np.eye(2)
    m, n = _primitive(windings)
    return np.array([[m, n]]) / (m * m + n * n)


def jumps_across(windings: np.ndarray) -> np.ndarray:
    """Jumps (k, 2) that stream functions may have, constant on patches with these windings."""
    if not len(windings):
        return np.eye(2)
    if _rank(windings) == 2:
        return np.empty((0, 2))
    m, n = _primitive(windings)
    return np.array([[-n, m]], dtype=float)


def _rank(windings: np.ndarray) -> int:
    a, b = windings[0]
    return 2 if (windings[:, 0] * b != windings[:, 1] * a).any() else 1


def _primitive(windings: np.ndarray) -> tuple[int, int]:
    """The shortest winding along the direction of all; a cluster that winds that way has it.

    A loop that does not cross itself never winds around a torus twice.
    """
    m, n = (windings[0] // np.gcd(*windings[0])).tolist()
    return m, n


@dataclass(frozen=True, eq=False)
class OpenTorus:
    """Cells that wind around the torus, and the sides through which they are joined.

    kept : (C,) bool; pairs : (n, 2) slots; component : (C,) int, joined cells have the same
    windings : (k, 2) int
    """

    kept: np.ndarray
    pairs: np.ndarray
    component: np.ndarray
    windings: np.ndarray


def open_torus(mesh: NestedMesh, data: CellData) -> OpenTorus:
    """Find the cells that can carry flow around the torus."""
    inner, alone = passable_sides(mesh, data)
    across, jump = seam_pairs(mesh, alone)
    piece = components(inner // 3, len(mesh.cells))
    found = unwind(*piece[across // 3].T, jump, int(piece.max()) + 1)
    component = found.root[piece]
    kept = np.isin(component, found.winding_roots) & (data.K > 0)
    pairs = np.concatenate([inner, across])
    return OpenTorus(kept, pairs[kept[pairs[:, 0] // 3]], component, found.windings)


def pressure_unknowns(mesh: NestedMesh, seams: Seams, data: CellData, cells: OpenTorus) -> Unknowns:
    """Periodic part of the pressure: one unknown a point and side of contact, lift 0.

    One corner of each component has no unknown: its pressure is 0.
    """
    vertex = seams.twin[mesh.cells]
    label, count = continuous_labels(vertex, len(mesh.xy), data.shut, cells.kept, cells.pairs)
    label = label.reshape(-1, 3)[cells.kept]
    _, first = np.unique(cells.component[cells.kept], return_index=True)
    free = np.ones(count, dtype=bool)
    free[label[first, 0]] = False
    of_corner, used = numbered(label, free)
    return Unknowns(of_corner, np.zeros(label.shape, dtype=np.int8), used)


@dataclass(frozen=True, eq=False)
class StreamUnknowns:
    """Periodic part of the stream function, and how it may jump.

    unknowns : lift 0; seams_crossed : (C, 3, 2), n of each corner: ψ = periodic part + J·n
    jumps : (k, 2), a basis of the jumps that the patches allow, none if they bar everything
    """

    unknowns: Unknowns
    seams_crossed: np.ndarray
    jumps: np.ndarray


def stream_unknowns(
    mesh: NestedMesh, seams: Seams, data: CellData, kept: np.ndarray, merge_closed: bool
) -> StreamUnknowns:
    """Stream function unknowns on the torus; arguments as in `unknowns.dual_unknowns`."""
    pairs = patch_ties(mesh, data, kept, merge_closed)
    patch = components(np.concatenate(pairs), len(mesh.xy))
    on_seam = np.flatnonzero(seams.copy.any(axis=1))
    twin = seams.twin[on_seam]
    found = unwind(patch[twin], patch[on_seam], seams.copy[on_seam], int(patch.max()) + 1)
    of_cell = patch[mesh.cells[kept]]
    label = found.root[of_cell]
    live = np.zeros(len(found.root), dtype=bool)
    live[label[~data.closed[kept]] if merge_closed else label] = True
    live[live.argmax()] = False
    of_corner, count = numbered(label, live)
    unknowns = Unknowns(of_corner, np.zeros(label.shape, dtype=np.int8), count)
    return StreamUnknowns(unknowns, found.offset[of_cell], jumps_across(found.windings))
