"""Topology of both problems: the corner values of cells that are one unknown.

Contact lines across which the pressure jumps, contact patches on which the stream function is
constant, and periodic sides are all expressed by numberings of the corners (`numbering.py`).
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.flow.cell_data import CellContact, CellData
from fem_seal.flow.numbering import Numbering, numbered
from fem_seal.mesh.bisection import AnyMesh
from fem_seal.mesh.grouping import components
from fem_seal.mesh.mesh import corner_links, side_ends


@dataclass(frozen=True, eq=False)
class OpenCells:
    """Cells connected to inlet and outlet, and the sides through which they are connected."""

    kept: np.ndarray  #: (C,) bool, cells that carry flow
    pairs: np.ndarray  #: (n, 2) int32, slots 3 cell + side of the two sides of each passable edge
    inlet: np.ndarray  #: (m,) int32, slots of passable sides on the inlet
    outlet: np.ndarray  #: (m,) int32, slots of passable sides on the outlet


def passable_sides(mesh: AnyMesh, data: CellData) -> tuple[np.ndarray, np.ndarray]:
    """Slots 3 cell + side of passable sides: K > 0 in the cell, and no zero-gap side.

    Returns those (n, 2) of the two sides of each passable edge between two cells, and those (m,) on
    the boundary.
    """
    slots = mesh.numbered_edges.slots()
    passable = ((data.K > 0)[:, None] & ~data.zero_gap).ravel()
    # The appended False makes slot -1, the missing neighbour of a boundary side, impassable.
    first, second = np.append(passable, False).take(slots).T
    alone = slots[:, 1] < 0
    return slots.compress(first & second, axis=0), slots[:, 0].compress(first & alone)


def open_cells(mesh: AnyMesh, data: CellData) -> OpenCells:
    """Find the cells that can carry flow: connected to both ends through passable sides."""
    pairs, alone = passable_sides(mesh, data)
    ends = mesh.cells.ravel()[side_ends(alone)]
    inlet = alone[mesh.inlet[ends].all(axis=1)]
    outlet = alone[mesh.outlet[ends].all(axis=1)]
    piece = components(pairs // 3, len(mesh.cells))
    through = np.zeros(int(piece.max()) + 1, dtype=bool)
    through[np.intersect1d(piece[inlet // 3], piece[outlet // 3])] = True
    kept = through.take(piece) & (data.K > 0)
    keep = [slots[kept[slots // 3]] for slots in (inlet, outlet)]
    return OpenCells(kept, pairs.compress(kept.take(pairs[:, 0] // 3), axis=0), *keep)


def primal_numbering(mesh: AnyMesh, data: CellContact, cells: OpenCells) -> Numbering:
    """Number the pressure on the kept cells; p = 1 on passable inlet sides, 0 on outlet sides."""
    vertex = mesh.twin.take(mesh.cells)
    label, count = continuous_labels(vertex, len(mesh.xy), data.zero_gap, cells.kept, cells.pairs)
    ends = [label[side_ends(slots)] for slots in (cells.inlet, cells.outlet)]
    label = label.reshape(-1, 3).compress(cells.kept, axis=0)
    group = _of_one_pressure(label[data.equipotential[cells.kept]], ends, count)
    at_inlet, at_outlet = (_marked(group[end], count) for end in ends)
    label = group.take(label)
    of_corner, used = numbered(label, ~(at_inlet | at_outlet))
    return Numbering(of_corner, at_inlet.take(label).astype(np.int8), used)


def _of_one_pressure(equipotential: np.ndarray, ends: list[np.ndarray], count: int) -> np.ndarray:
    """Group (count,) of each label: equipotential cells that touch share one pressure.

    Pressures that are constant on these cells, of corners with labels (n, 3), are admissible, so
    their energy is still an upper bound. Groups that would join inlet and outlet are left out.
    """
    if len(equipotential) == 0:
        return np.arange(count, dtype=np.int32)
    group = components(equipotential[:, [0, 1, 1, 2]].reshape(-1, 2), count)
    through = _marked(group[ends[0]], count) & _marked(group[ends[1]], count)
    if not through.any():
        return group
    return _of_one_pressure(equipotential[~through[group[equipotential[:, 0]]]], ends, count)


def _marked(places: np.ndarray, count: int) -> np.ndarray:
    """(count,) bool, true at the places."""
    marked = np.zeros(count, dtype=bool)
    marked[places] = True
    return marked


def continuous_labels(
    vertex: np.ndarray, vertices: int, zero_gap: np.ndarray, kept: np.ndarray, pairs: np.ndarray
) -> tuple[np.ndarray, int]:
    """Label (3 C,) of each corner, and a number above all labels.

    Corners at one point share a label unless contact separates them: the pressure may jump across a
    contact line, through which nothing flows. Corners are joined only through passable sides, so
    that linear pressures do not leak across the line.

    Parameters
    ----------
    vertex : (C, 3) int
        Point of each corner, below `vertices`.
    zero_gap : (C, 3) bool
        Sides along which the gap is zero.
    kept : (C,) bool
        Cells that carry flow.
    pairs : (n, 2) int
        Slots of the sides through which kept cells are joined.
    """
    # Labels of a point can differ only at zero-gap sides and next to cells that carry no flow.
    special = np.zeros(vertices, dtype=bool)
    special[vertex[~kept]] = True
    special[vertex.ravel()[side_ends(np.flatnonzero(zero_gap))]] = True
    flat = vertex.ravel()
    # Pairs of sides without a special vertex join corners that have one label anyway.
    near = np.logical_or.reduce(special.take(vertex.T))
    pairs = pairs.compress(near.take(pairs[:, 0] // 3), axis=0)
    links = corner_links(flat, pairs)
    links = links.compress(special.take(flat.take(links[:, 0])), axis=0)
    corners = np.flatnonzero(special.take(flat))
    place = np.zeros(len(flat), dtype=np.int32)
    place[corners] = np.arange(len(corners))
    label = flat.copy()
    label[corners] = vertices + components(place[links], len(corners))
    return label, vertices + len(corners)


def dual_numbering(
    mesh: AnyMesh, data: CellContact, kept: np.ndarray, merge_blocked: bool
) -> Numbering | None:
    """Number the stream function on the kept cells (C,) bool; None if patches close every channel.

    It has one unknown for each contact patch, and is prescribed on side walls and constant in all
    other cells. `merge_blocked`: the corners of a blocked cell are one unknown (true dual);
    otherwise they are free (regularised dual, in which blocked cells conduct a little).
    """
    pairs = patch_ties(mesh, data, kept, merge_blocked) + mesh.wall_ties()
    patch = components(np.concatenate(pairs), len(mesh.xy))
    if mesh.periodic:
        top = np.flatnonzero(mesh.top)
        joined = _winding(patch[mesh.twin[top]], patch[top], int(patch.max()) + 1)
        if joined is None:
            return None
        root, offset = joined
    else:
        count = int(patch.max()) + 1
        root, offset = np.arange(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
        if patch[mesh.bottom][0] == patch[mesh.top][0]:
            return None
        offset[patch[mesh.top][0]] = 1
    # Use the smallest integer type that holds the offsets.
    offset = offset.astype(np.min_scalar_type(-1 - int(np.abs(offset).max())))
    of_cell = patch.take(mesh.cells.compress(kept, axis=0))
    label = root[of_cell]
    live = np.zeros(len(root), dtype=bool)
    live[label.compress(~data.blocked[kept], axis=0) if merge_blocked else label] = True
    # ψ is prescribed on the walls. Between periodic sides it is defined up to a constant: pin it
    # on any one patch.
    walls = patch[[mesh.bottom.argmax(), mesh.top.argmax()]]
    live[live.argmax() if mesh.periodic else walls] = False
    of_corner, count = numbered(label, live)
    return Numbering(of_corner, offset[of_cell], count)


def patch_ties(
    mesh: AnyMesh, data: CellContact, kept: np.ndarray, merge_blocked: bool
) -> list[np.ndarray]:
    """Pairs (n, 2) of vertices with the same stream function; see `dual_numbering`."""
    tie = ~kept | data.blocked if merge_blocked else ~kept
    a, b, c = mesh.cells.compress(tie, axis=0).T
    pairs = [np.stack([a, b], 1), np.stack([b, c], 1)]
    # Contact edges from corner k to corner k + 1.
    both = data.contact_vertex & data.contact_vertex[:, [1, 2, 0]]
    edges = ((mesh.cells.compress(both[:, k], axis=0), k) for k in range(3))
    return pairs + [cells[:, [k, (k + 1) % 3]] for cells, k in edges]


def _winding(low: np.ndarray, high: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Join patches across a periodic side on which the stream function jumps by one.

    Low and high (n,) are the patches of the same point at y = 0 and at y = Ly: ψ(high) = ψ(low) +
    1. Returns root and offset (count,) of each with ψ(patch) = ψ(root) + offset; None if a patch
    meets itself with another offset, that is, winds around the strip and bars it.
    """
    parent, above = list(range(count)), [0] * count

    def root_of(i: int) -> tuple[int, int]:
        """Root of a patch and its offset; the patches on the way then point to the root."""
        path, total = [], 0
        while parent[i] != i:
            path.append(i)
            i = parent[i]
        for j in reversed(path):
            total = above[j] + (above[parent[j]] if parent[j] != i else 0)
            parent[j], above[j] = i, total
        return i, (above[path[0]] if path else 0)

    for u, v in zip(low.tolist(), high.tolist(), strict=True):
        (ru, ou), (rv, ov) = root_of(u), root_of(v)
        if ru == rv:
            if ov != ou + 1:
                return None
        else:
            parent[rv], above[rv] = ru, ou + 1 - ov
    root, offset = np.arange(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
    for i in np.unique(np.concatenate([low, high])).tolist():
        root[i], offset[i] = root_of(i)
    return root, offset
