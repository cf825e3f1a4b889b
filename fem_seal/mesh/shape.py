"""From labelled triangles to a shape on which the flow can be solved: loops, side walls, cut.

The stream function ψ needs to know where it is 0 and 1. Two arrangements of inlet and outlet allow
this. On the same boundary loop, the two stretches of wall between them are the side walls, ψ = 0
and ψ = 1. On two different loops, as in a ring, the mesh is cut open along a path of edges from one
to the other, across which ψ jumps by 1. All other walls are islands, on each of which ψ is an
unknown constant.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.graphs import components
from fem_seal.mesh.bisection import bisect
from fem_seal.mesh.checks import coordinates
from fem_seal.mesh.cut import cut_open, shortest_path
from fem_seal.mesh.mesh import BOTTOM, INLET, INSIDE, ISLAND, OUTLET, TOP, end_slots
from fem_seal.mesh.triangles import TriangleMesh, longest_edge_first, turned

NAMES = {INLET: "inlet", OUTLET: "outlet"}


def shape_mesh(xy: np.ndarray, cells: np.ndarray, sides: np.ndarray) -> TriangleMesh:
    """Find the side walls of a shape, or cut it open if it is a ring.

    Parameters
    ----------
    xy : (V, 2)
        Coordinates of the vertices [m]; each belongs to a cell.
    cells : (C, 3) int
        Conforming triangles, counterclockwise.
    sides : (C, 3) int8
        Label of the side opposite each corner: INLET, OUTLET, ISLAND (any wall) or INSIDE.
    """
    return shape_mesh_with_values(xy, cells, sides, np.empty((len(xy), 0)))[0]


def shape_mesh_with_values(
    xy: np.ndarray, cells: np.ndarray, sides: np.ndarray, values: np.ndarray
) -> tuple[TriangleMesh, np.ndarray]:
    """Mesh of `shape_mesh`, and values (V', ...) at its vertices of a piecewise linear function."""
    _require_one_piece(len(xy), cells)
    loops = _Loops(xy, cells, sides)
    inlet, outlet = loops.only_piece(INLET), loops.only_piece(OUTLET)
    touching = np.intersect1d(inlet.vertices, outlet.vertices)
    if touching.size:
        raise InvalidInput(
            f"inlet and outlet of the mesh touch at {coordinates(xy[touching[0]])}, where the flow "
            "would be infinite; put a stretch of wall between them"
        )
    sides, twin = sides.copy(), np.arange(len(xy))
    if inlet.loop == outlet.loop:
        for end, label in ((inlet, BOTTOM), (outlet, TOP)):
            cell, side = loops.wall_after(end)
            sides[cell, side] = label
    else:
        # The cut may not touch other walls. Where all vertices between the ends lie on walls, the
        # triangles are halved until there are enough others for a path.
        while (path := loops.path_between_ends(cells, sides)) is None:
            xy, cells, sides, values = _all_halved(xy, cells, sides, values)
            loops = _Loops(xy, cells, sides)
        xy, cells, sides, twin = cut_open(xy, cells, sides, path)
        values = values[twin]
    first = longest_edge_first(xy, cells)
    cells = turned(cells, first).astype(np.int32)
    mesh = TriangleMesh(xy, cells, turned(sides, first), twin.astype(np.int32))
    return _ends_apart(mesh, values)


def _require_one_piece(count: int, cells: np.ndarray) -> None:
    """Raise InvalidInput if `count` vertices are not all connected by cells."""
    pairs = np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]]])
    pieces = components(pairs, count).max() + 1
    if pieces > 1:
        raise InvalidInput(
            f"the mesh falls into {pieces} pieces that share no vertex; give one connected mesh "
            "(in gmsh, Coherence or BooleanFragments joins neighbouring surfaces)"
        )


@dataclass(frozen=True, eq=False)
class _Piece:
    """Consecutive sides with the same label on a boundary loop."""

    loop: int  #: number of the loop
    start: int  #: index of the first side in the loop
    length: int  #: number of sides
    vertices: np.ndarray  #: (n,) int, vertices of the sides


class _Loops:
    """The boundary as closed loops of sides, in the direction that has the shape on its left."""

    def __init__(self, xy: np.ndarray, cells: np.ndarray, sides: np.ndarray):
        cell, side = np.nonzero(sides != INSIDE)
        tail, head = cells.ravel()[end_slots(3 * cell + side)].T
        order = np.argsort(tail)
        twice = np.flatnonzero(np.diff(tail[order]) == 0)
        if twice.size:
            raise InvalidInput(
                f"the mesh touches itself in the single point "
                f"{coordinates(xy[tail[order[twice[0]]]])}; join the two sides by an edge, or part "
                "them"
            )
        successor = order[np.searchsorted(tail[order], head)]
        self.loops: list[np.ndarray] = []  # for each loop its sides in order, as indices
        unvisited = np.ones(len(tail), dtype=bool)
        for start in range(len(tail)):
            loop, current = [], start
            while unvisited[current]:
                unvisited[current] = False
                loop.append(current)
                current = successor[current]
            if loop:
                self.loops.append(np.array(loop))
        self._cell, self._side, self._tail, self._head = cell, side, tail, head
        self._label = sides[cell, side]

    def path_between_ends(self, cells: np.ndarray, sides: np.ndarray) -> np.ndarray | None:
        """Shortest path from the loop of the inlet to that of the outlet; see `shortest_path`."""
        loops = (self.loops[self.only_piece(label).loop] for label in (INLET, OUTLET))
        start, end = (self._tail[loop] for loop in loops)
        return shortest_path(cells, sides, start, end)

    def only_piece(self, label: int) -> _Piece:
        """Consecutive sides with this label; InvalidInput if there are none or several pieces."""
        pieces = []
        for number, loop in enumerate(self.loops):
            labelled = self._label[loop] == label
            starts = np.flatnonzero(labelled & ~np.roll(labelled, 1))
            if labelled.all():
                starts = np.array([0])
            sides = loop[labelled]
            ends = np.concatenate([self._tail[sides], self._head[sides]])
            pieces += [_Piece(number, start, int(labelled.sum()), ends) for start in starts]
        if not pieces:
            raise InvalidInput(f"the mesh has no {NAMES[label]}: no boundary edge belongs to it")
        if len(pieces) > 1:
            raise InvalidInput(
                f"the {NAMES[label]} of the mesh is in {len(pieces)} pieces; fem_seal bounds the "
                "leak rate between one connected inlet and one connected outlet"
            )
        return pieces[0]

    def wall_after(self, piece: _Piece) -> tuple[np.ndarray, np.ndarray]:
        """Cells and sides of the wall that follows a piece on its loop."""
        onwards = np.roll(self.loops[piece.loop], -(piece.start + piece.length))
        is_wall = self._label[onwards] == ISLAND
        wall = onwards[: len(onwards) if is_wall.all() else np.argmin(is_wall)]
        return self._cell[wall], self._side[wall]


def _all_halved(
    xy: np.ndarray, cells: np.ndarray, sides: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, triangles, labels of their sides, and values at the vertices, of all halves."""
    first, twin = longest_edge_first(xy, cells), np.arange(len(xy), dtype=np.int32)
    whole = TriangleMesh(xy, turned(cells, first).astype(np.int32), turned(sides, first), twin)
    mesh, values = _halved(whole, np.ones(len(cells), dtype=bool), values)
    return mesh.xy, mesh.cells, mesh.sides, values


def _halved(
    mesh: TriangleMesh, marked: np.ndarray, values: np.ndarray
) -> tuple[TriangleMesh, np.ndarray]:
    """Halve the marked triangles (C,), and carry values (V, ...) at the vertices along."""
    fine = bisect(mesh, marked)
    return fine.mesh, fine.at_vertices(values)


def _ends_apart(mesh: TriangleMesh, values: np.ndarray) -> tuple[TriangleMesh, np.ndarray]:
    """Halve wall sides with both ends on the inlet, or both on the outlet.

    Afterwards a boundary edge with both ends on the inlet is an inlet edge, as `flow` assumes.
    """
    while True:
        wall = mesh.sides >= BOTTOM
        ends = mesh.side_ends(wall)
        both = mesh.inlet[ends].all(axis=1) | mesh.outlet[ends].all(axis=1)
        marked = np.zeros(len(mesh.cells), dtype=bool)
        marked[np.nonzero(wall)[0][both]] = True
        if not marked.any():
            return mesh, values
        mesh, values = _halved(mesh, marked, values)
