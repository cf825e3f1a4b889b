"""Which corner values of which cells are one unknown: the topology of both problems in arrays.

Contact that splits the pressure, patches that tie the stream function together, and sides that are
one line are all numberings of the corners (`numbering.py`).
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fem_seal.flow.gap_on_mesh import CellContact, CellData
from fem_seal.flow.numbering import Unknowns, numbered
from fem_seal.mesh.nested import NestedMesh


def components(pairs: np.ndarray, count: int) -> np.ndarray:
    """Component number (count,) of each node of the graph with edges `pairs` (n, 2)."""
    graph = coo_array((np.ones(len(pairs), dtype=np.int8), tuple(pairs.T)), shape=(count, count))
    # Neither their order nor doubles matter, and said to be in order they are not sorted.
    graph.has_canonical_format = True
    return connected_components(graph, directed=False)[1]


@dataclass(frozen=True, eq=False)
class OpenCells:
    """Cells joined to inlet and outlet, and the sides through which they are joined.

    kept : (C,) bool
    pairs : (n, 2) int32, the two (cell, side) slots, as 3 cell + side, of each passable edge
    inlet, outlet : (m,) int32, slots of passable edges on the inlet and the outlet
    """

    kept: np.ndarray
    pairs: np.ndarray
    inlet: np.ndarray
    outlet: np.ndarray


def passable_sides(mesh: NestedMesh, data: CellData) -> tuple[np.ndarray, np.ndarray]:
    """Sides of cells with K > 0 that are not shut, as slots 3 cell + side.

    Returns
    -------
    pairs : (n, 2) int32, the two sides of an edge between two cells
    alone : (m,) int32, sides on the boundary
    """
    slots = mesh.numbered_edges.slots()
    passable = ((data.K > 0)[:, None] & ~data.shut).ravel()
    # A side outside, slot -1, is one that nothing passes.
    first, second = np.append(passable, False).take(slots).T
    alone = slots[:, 1] < 0
    return slots.compress(first & second, axis=0), slots[:, 0].compress(first & alone)


def open_cells(mesh: NestedMesh, data: CellData) -> OpenCells:
    """Find the cells that can carry flow: K > 0, joined to both ends through sides not shut."""
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


def side_ends(slots: np.ndarray) -> np.ndarray:
    """(n, 2) corner slots at the two ends of each side slot."""
    cell, side = slots // 3, slots % 3
    return np.stack([3 * cell + (side + 1) % 3, 3 * cell + (side + 2) % 3], axis=1)


def primal_unknowns(mesh: NestedMesh, data: CellContact, cells: OpenCells) -> Unknowns:
    """Pressure unknowns: prescribed are p = 1 on passable inlet sides and p = 0 on the outlet.

    Numbers refer to the kept cells.
    """
    vertex = mesh.twin.take(mesh.cells)
    label, count = continuous_labels(vertex, len(mesh.xy), data.shut, cells.kept, cells.pairs)
    ends = [label[side_ends(slots)] for slots in (cells.inlet, cells.outlet)]
    label = label.reshape(-1, 3).compress(cells.kept, axis=0)
    group = _of_one_pressure(label[data.stiff[cells.kept]], ends, count)
    at_inlet, at_outlet = (_marked(group[end], count) for end in ends)
    label = group.take(label)
    of_corner, used = numbered(label, ~(at_inlet | at_outlet))
    return Unknowns(of_corner, at_inlet.take(label).astype(np.int8), used)


def _of_one_pressure(stiff: np.ndarray, ends: list[np.ndarray], count: int) -> np.ndarray:
    """Group (count,) of each label: stiff cells that touch have one pressure.

    A function that is constant on some cells is one more admissible function, and so its energy an
    upper bound. Stiff cells that would join inlet and outlet stay as they are.

    Parameters
    ----------
    stiff : (n, 3), labels of the corners of stiff cells
    ends : labels at the inlet and at the outlet
    count : number of labels
    """
    if len(stiff) == 0:
        return np.arange(count, dtype=np.int32)
    group = components(stiff[:, [0, 1, 1, 2]].reshape(-1, 2), count)
    through = _marked(group[ends[0]], count) & _marked(group[ends[1]], count)
    if not through.any():
        return group
    return _of_one_pressure(stiff[~through[group[stiff[:, 0]]]], ends, count)


def _marked(places: np.ndarray, count: int) -> np.ndarray:
    """(count,) bool, true at the places."""
    marked = np.zeros(count, dtype=bool)
    marked[places] = True
    return marked


def continuous_labels(
    vertex: np.ndarray, vertices: int, shut: np.ndarray, kept: np.ndarray, pairs: np.ndarray
) -> tuple[np.ndarray, int]:
    """Label of each corner: corners at one point share theirs unless contact parts them.

    The pressure may jump across a contact line, where nothing flows: corners are joined only
    through sides that are not shut, so that P1 cells do not leak across the line.

    Parameters
    ----------
    vertex : (C, 3), below `vertices`, equal for corners at one point
    shut : (C, 3) bool, sides along which the gap is zero; kept : (C,) bool
    pairs : (n, 2), slots of the sides through which kept cells are joined

    Returns
    -------
    label : (3 C,), and a number above all labels
    """
    # Splitting can only happen at vertices of shut sides or next to cells that are left out.
    special = np.zeros(vertices, dtype=bool)
    special[vertex[~kept]] = True
    special[vertex.ravel()[side_ends(np.flatnonzero(shut))]] = True
    flat = vertex.ravel()
    # A pair of sides without a special vertex ties nothing that is not one unknown anyway.
    near = np.logical_or.reduce(special.take(vertex.T))
    pairs = pairs.compress(near.take(pairs[:, 0] // 3), axis=0)
    first, second = side_ends(pairs[:, 0]), side_ends(pairs[:, 1])
    swap = flat[first[:, 0]] != flat[second[:, 0]]
    second[swap] = second[swap][:, ::-1]
    links = np.stack([first.ravel(), second.ravel()], axis=1)
    links = links.compress(special.take(flat.take(links[:, 0])), axis=0)
    corners = np.flatnonzero(special.take(flat))
    place = np.zeros(len(flat), dtype=np.int32)
    place[corners] = np.arange(len(corners))
    label = flat.copy()
    label[corners] = vertices + components(place[links], len(corners))
    return label, vertices + len(corners)


def dual_unknowns(
    mesh: NestedMesh, data: CellContact, kept: np.ndarray, merge_closed: bool
) -> Unknowns | None:
    """Stream function unknowns: one for each contact patch, given on the side walls.

    Parameters
    ----------
    mesh, data : the mesh and its cells
    kept : (C,) bool, cells that carry flow; in all others the stream function is constant
    merge_closed : tie the corners of closed cells together (the true dual); False leaves them
        free (the regularised dual, in which they conduct a little)

    Returns
    -------
    Unknowns of the kept cells, or None if the patches bar every channel.
    """
    pairs = patch_ties(mesh, data, kept, merge_closed) + mesh.wall_ties()
    patch = components(np.concatenate(pairs), len(mesh.xy))
    if mesh.periodic:
        top = np.flatnonzero(mesh.top)
        found = _winding(patch[mesh.twin[top]], patch[top], int(patch.max()) + 1)
        if found is None:
            return None
        root, offset = found
    else:
        count = int(patch.max()) + 1
        root, offset = np.arange(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
        if patch[mesh.bottom][0] == patch[mesh.top][0]:
            return None
        offset[patch[mesh.top][0]] = 1
    # In as few bytes as hold it.
    offset = offset.astype(np.min_scalar_type(-1 - int(np.abs(offset).max())))
    of_cell = patch.take(mesh.cells.compress(kept, axis=0))
    label = root[of_cell]
    live = np.zeros(len(root), dtype=bool)
    live[label.compress(~data.closed[kept], axis=0) if merge_closed else label] = True
    # Some value must be given: on walls the problem says which, else any one patch is pinned.
    given = live.argmax() if mesh.periodic else patch[[mesh.bottom.argmax(), mesh.top.argmax()]]
    live[given] = False
    of_corner, count = numbered(label, live)
    return Unknowns(of_corner, offset[of_cell], count)


def patch_ties(
    mesh: NestedMesh, data: CellData, kept: np.ndarray, merge_closed: bool
) -> list[np.ndarray]:
    """Pairs (n, 2) of vertices at which the stream function is the same; see `dual_unknowns`."""
    tie = ~kept | data.closed if merge_closed else ~kept
    a, b, c = mesh.cells.compress(tie, axis=0).T
    pairs = [np.stack([a, b], 1), np.stack([b, c], 1)]
    both = data.contact & data.contact[:, [1, 2, 0]]  # contact edges from corner k to k + 1
    edges = ((mesh.cells.compress(both[:, k], axis=0), k) for k in range(3))
    return pairs + [cells[:, [k, (k + 1) % 3]] for cells, k in edges]


def _winding(low: np.ndarray, high: np.ndarray, count: int):
    """Join patches across a periodic side on which the stream function jumps by one.

    Parameters
    ----------
    low, high : (n,) patches that are one point, at y = 0 and at y = Ly: ψ(high) = ψ(low) + 1
    count : number of patches

    Returns
    -------
    root : (count,), offset : (count,) with ψ(patch) = ψ(root) + offset; None if a patch meets
    itself with another offset, that is, winds around the strip and bars it.
    """
    parent, above = list(range(count)), [0] * count

    def find(i: int) -> tuple[int, int]:
        path, total = [], 0
        while parent[i] != i:
            path.append(i)
            i = parent[i]
        for j in reversed(path):
            total = above[j] + (above[parent[j]] if parent[j] != i else 0)
            parent[j], above[j] = i, total
        return i, (above[path[0]] if path else 0)

    for u, v in zip(low.tolist(), high.tolist(), strict=True):
        (ru, ou), (rv, ov) = find(u), find(v)
        if ru == rv:
            if ov != ou + 1:
                return None
        else:
            parent[rv], above[rv] = ru, ou + 1 - ov
    root, offset = np.arange(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
    for i in np.unique(np.concatenate([low, high])).tolist():
        root[i], offset[i] = find(i)
    return root, offset
