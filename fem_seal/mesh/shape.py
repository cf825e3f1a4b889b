"""From labelled triangles to a shape that can be solved: its loops, its side walls, its cut.

Two arrangements of inlet and outlet have one leak rate and a stream function that knows its jump:
both on one boundary, where the two stretches of wall between them are the side walls, ψ = 0 and
ψ = 1; or on two different boundaries, as in a ring, which is cut open along a path of edges from
one to the other, across which ψ jumps by 1. All other walls are islands with an unknown ψ.
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from fem_seal.errors import InvalidInput
from fem_seal.mesh.bisection import bisect
from fem_seal.mesh.triangles import (
    BOTTOM,
    INLET,
    INSIDE,
    ISLAND,
    OUTLET,
    TOP,
    TriangleMesh,
    longest_edge_first,
    turned,
)

NAMES = {INLET: "inlet", OUTLET: "outlet"}


def shape_mesh(xy: np.ndarray, cells: np.ndarray, sides: np.ndarray) -> TriangleMesh:
    """Find the walls of a shape and cut it open if it must be.

    Parameters
    ----------
    xy : (V, 2) float [m], every vertex in some cell
    cells : (C, 3) int, counterclockwise, conforming
    sides : (C, 3) int8, for the side opposite each corner INLET, OUTLET, ISLAND (any wall) or
        INSIDE

    Returns
    -------
    TriangleMesh

    Raises
    ------
    InvalidInput
        If the mesh is not one piece, touches itself in a point, or inlet or outlet are missing,
        in several pieces, or touch each other.
    """
    _require_one_piece(len(xy), cells)
    loops = _Loops(xy, cells, sides)
    inlet, outlet = loops.only_piece(INLET), loops.only_piece(OUTLET)
    touching = np.intersect1d(inlet.vertices, outlet.vertices)
    if touching.size:
        raise InvalidInput(
            f"inlet and outlet of the mesh touch at {_place(xy[touching[0]])}, where the flow "
            "would be infinite; put a stretch of wall between them"
        )
    sides, twin = sides.copy(), np.arange(len(xy))
    if inlet.loop == outlet.loop:
        for first, label in ((inlet, BOTTOM), (outlet, TOP)):
            cell, side = loops.wall_after(first)
            sides[cell, side] = label
    else:
        xy, cells, sides, twin = _cut_open(xy, cells, sides, loops, inlet, outlet)
    first = longest_edge_first(xy, cells)
    cells = turned(cells, first).astype(np.int32)
    mesh = TriangleMesh(xy, cells, turned(sides, first), twin.astype(np.int32))
    return _ends_apart(mesh)


def _place(point: np.ndarray) -> str:
    return f"x = {point[0]:.6g} m, y = {point[1]:.6g} m"


def _require_one_piece(count: int, cells: np.ndarray) -> None:
    pairs = np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]]])
    graph = coo_array((np.ones(len(pairs), dtype=np.int8), tuple(pairs.T)), shape=(count, count))
    pieces, _ = connected_components(graph, directed=False)
    if pieces > 1:
        raise InvalidInput(
            f"the mesh falls into {pieces} pieces that share no vertex; give one connected mesh "
            "(in gmsh, Coherence or BooleanFragments joins neighbouring surfaces)"
        )


class _Piece:
    """An uninterrupted stretch of one label on one loop.

    loop : number of the loop; start : index of its first side; length : sides
    vertices : all its vertices
    """

    def __init__(self, loop: int, start: int, length: int, vertices: np.ndarray):
        self.loop, self.start, self.length, self.vertices = loop, start, length, vertices


class _Loops:
    """The boundary as closed loops of sides, each walked with the shape on the left."""

    def __init__(self, xy: np.ndarray, cells: np.ndarray, sides: np.ndarray):
        cell, side = np.nonzero(sides != INSIDE)
        tail, head = cells[cell, (side + 1) % 3], cells[cell, (side + 2) % 3]
        order = np.argsort(tail)
        twice = np.flatnonzero(np.diff(tail[order]) == 0)
        if twice.size:
            raise InvalidInput(
                f"the mesh touches itself in the single point {_place(xy[tail[order[twice[0]]]])}; "
                "join the two sides by an edge, or part them"
            )
        following = order[np.searchsorted(tail[order], head)]
        self.loops: list[np.ndarray] = []  # indices of sides, in order
        unseen = np.ones(len(tail), dtype=bool)
        for start in range(len(tail)):
            loop, at = [], start
            while unseen[at]:
                unseen[at] = False
                loop.append(at)
                at = following[at]
            if loop:
                self.loops.append(np.array(loop))
        self._cell, self._side, self._tail, self._head = cell, side, tail, head
        self._label = sides[cell, side]

    def vertices(self, loop: int) -> np.ndarray:
        """Vertices of a loop."""
        return self._tail[self.loops[loop]]

    def only_piece(self, label: int) -> _Piece:
        """The stretch of sides with this label; there must be just one."""
        pieces = []
        for number, loop in enumerate(self.loops):
            has = self._label[loop] == label
            starts = np.flatnonzero(has & ~np.roll(has, 1))
            if has.all():
                starts = np.array([0])
            on = loop[has]
            ends = np.concatenate([self._tail[on], self._head[on]])
            pieces += [_Piece(number, start, int(has.sum()), ends) for start in starts]
        if not pieces:
            raise InvalidInput(f"the mesh has no {NAMES[label]}: no boundary edge belongs to it")
        if len(pieces) > 1:
            raise InvalidInput(
                f"the {NAMES[label]} of the mesh is in {len(pieces)} pieces; fem_seal bounds the "
                "leak rate between one connected inlet and one connected outlet"
            )
        return pieces[0]

    def wall_after(self, piece: _Piece) -> tuple[np.ndarray, np.ndarray]:
        """Cells and sides of the wall that follows a piece along its loop."""
        onwards = np.roll(self.loops[piece.loop], -(piece.start + piece.length))
        is_wall = self._label[onwards] == ISLAND
        wall = onwards[: len(onwards) if is_wall.all() else np.argmin(is_wall)]
        return self._cell[wall], self._side[wall]


def _cut_open(
    xy: np.ndarray,
    cells: np.ndarray,
    sides: np.ndarray,
    loops: _Loops,
    inlet: _Piece,
    outlet: _Piece,
):
    """Part the cells along a path from the loop of the inlet to that of the outlet.

    Seen from the inlet the cells on the left keep the vertices of the path (BOTTOM), those on the
    right get copies (TOP), so that ψ grows to the left of the flow as it does in a strip.

    Returns
    -------
    xy, cells, sides, twin : of the mesh with the copies
    """
    path = _path(xy, cells, sides, loops.vertices(inlet.loop), loops.vertices(outlet.loop))
    if path is None:
        # Every way between the two ends runs through vertices of other walls: make room.
        return _cut_open_refined(xy, cells, sides)
    place = np.full(len(xy), -1)
    place[path] = np.arange(len(path))
    near = np.flatnonzero((place[cells] >= 0).any(axis=1))
    of = cells[near]
    slot = np.arange(3 * len(near)).reshape(-1, 3)
    ends = of[:, [[1, 2], [2, 0], [0, 1]]]
    along = place[ends[:, :, 1]] - place[ends[:, :, 0]]
    on_path = (place[ends] >= 0).all(axis=2) & (np.abs(along) == 1)
    left, right = on_path & (along == 1), on_path & (along == -1)
    sides = sides.copy()
    for which, label in ((left, BOTTOM), (right, TOP)):
        cell, side = np.nonzero(which)
        sides[near[cell], side] = label
    bank = _joined_corners(of, slot, ends, on_path)
    corners = slot[np.arange(len(near))[:, None, None], [[1, 2], [2, 0], [0, 1]]]
    to_right = np.isin(bank, bank[corners[right].ravel()]).reshape(-1, 3) & (place[of] >= 0)
    cells = cells.copy()
    cells[near] = np.where(to_right, len(xy) + place[of], of)
    twin = np.concatenate([np.arange(len(xy)), path])
    return np.concatenate([xy, xy[path]]), cells, sides, twin


def _joined_corners(of: np.ndarray, slot: np.ndarray, ends: np.ndarray, on_path: np.ndarray):
    """Component of each corner slot: corners at one vertex, joined through sides off the path."""
    cell, side = np.nonzero(~on_path)
    edge = ends[cell, side]
    pair = np.stack([slot[cell, (side + 1) % 3], slot[cell, (side + 2) % 3]], axis=1)
    swap = edge[:, 0] > edge[:, 1]
    edge[swap], pair[swap] = edge[swap][:, ::-1], pair[swap][:, ::-1]
    order = np.lexsort(edge.T)
    same = (edge[order[1:]] == edge[order[:-1]]).all(axis=1)
    links = np.concatenate(
        [np.stack([pair[order[:-1]][same, k], pair[order[1:]][same, k]], 1) for k in (0, 1)]
    )
    count = slot.size
    graph = coo_array((np.ones(len(links), dtype=np.int8), tuple(links.T)), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def _path(
    xy: np.ndarray, cells: np.ndarray, sides: np.ndarray, start: np.ndarray, end: np.ndarray
) -> np.ndarray | None:
    """Fewest edges inside the mesh from one loop to another, avoiding all other boundaries."""
    cell, side = np.nonzero(sides == INSIDE)
    edges = np.stack([cells[cell, (side + 1) % 3], cells[cell, (side + 2) % 3]], axis=1)
    on_rim = np.zeros(len(xy), dtype=bool)
    rim_cell, rim_side = np.nonzero(sides != INSIDE)
    on_rim[cells[rim_cell, (rim_side + 1) % 3]] = True
    allowed = ~on_rim
    allowed[start], allowed[end] = True, True
    edges = edges[allowed[edges].all(axis=1)]
    # The path leaves from anywhere on the first loop: an extra node stands before all of it.
    source = np.stack([np.full(len(start), len(xy)), start], axis=1)
    links = np.concatenate([edges, source])
    shape = (len(xy) + 1,) * 2
    graph = coo_array((np.ones(len(links), dtype=np.int8), tuple(links.T)), shape=shape).tocsr()
    order, before = breadth_first_order(graph, len(xy), directed=False)
    reached = order[np.isin(order, end)]
    if reached.size == 0:
        return None
    path = [reached[0]]
    while before[path[-1]] != len(xy):
        path.append(before[path[-1]])
    return np.array(path[::-1])


def _cut_open_refined(xy: np.ndarray, cells: np.ndarray, sides: np.ndarray):
    """Halve all cells and cut then; halving puts vertices inside every cell in the end."""
    first = longest_edge_first(xy, cells)
    twin = np.arange(len(xy), dtype=np.int32)
    whole = TriangleMesh(xy, turned(cells, first).astype(np.int32), turned(sides, first), twin)
    mesh = bisect(whole, np.ones(len(cells), dtype=bool)).mesh
    loops = _Loops(mesh.xy, mesh.cells, mesh.sides)
    inlet, outlet = loops.only_piece(INLET), loops.only_piece(OUTLET)
    return _cut_open(mesh.xy, mesh.cells, mesh.sides, loops, inlet, outlet)


def _ends_apart(mesh: TriangleMesh) -> TriangleMesh:
    """Halve wall sides whose two ends lie on the inlet, or on the outlet.

    A boundary edge with both ends on the inlet is then an inlet edge, which the flow relies on.
    """
    while True:
        wall = mesh.sides >= BOTTOM
        cell, side = np.nonzero(wall)
        ends = mesh.cells[cell[:, None], np.stack([(side + 1) % 3, (side + 2) % 3], axis=1)]
        both = mesh.inlet[ends].all(axis=1) | mesh.outlet[ends].all(axis=1)
        marked = np.zeros(len(mesh.cells), dtype=bool)
        marked[cell[both]] = True
        if not marked.any():
            return mesh
        mesh = bisect(mesh, marked).mesh
