"""Topology of both problems: the corner values of cells that are one unknown.

Contact lines across which the pressure jumps, contact spots on which the stream function is
constant, and periodic sides are all expressed by numberings of the corners (`numbering.py`).

**A film between inlet and outlet** has d = 1 jump: the pressure is part + J n with n = 1 at the
inlet and 0 elsewhere; for the stream function n is 1 on the one side wall and 0 on the other, or
counts how often a path has crossed the seam of periodic sides. Only cells that are connected to
both ends carry flow.

**A periodic cell**, whose mesh is a `Torus`, has d = 2, one for each seam. A pressure with mean
gradient e grows by e·(Lx, 0) across the seam x = Lx and by e·(0, Ly) across the seam y = Ly; a
stream function of mean flux f grows by -f_y Lx and f_x Ly. Only clusters of cells that wind around
the torus carry flow. A contact spot that winds by n restricts the jumps J of the stream function
to J·n = 0; so it does for d = 1, where no jump is left.
"""

import numpy as np

from fem_seal.film.winding import unwind
from fem_seal.flow.cell_data import CellContact, CellData
from fem_seal.flow.numbering import Jumps, numbered
from fem_seal.graphs import components
from fem_seal.mesh.bisection import AnyMesh
from fem_seal.mesh.mesh import corner_links, end_slots
from fem_seal.mesh.torus import Torus


def open_cells(mesh: AnyMesh, data: CellData) -> tuple[np.ndarray, Jumps]:
    """Find the cells (C,) bool that can carry flow, and number the pressure on them."""
    return _open_torus(mesh, data) if isinstance(mesh, Torus) else _between_ends(mesh, data)


def passable_sides(mesh: AnyMesh, data: CellData) -> tuple[np.ndarray, np.ndarray]:
    """Slots 3 cell + side of passable sides: K > 0 in the cell, and no zero-gap side.

    Returns those (n, 2) of the two sides of each passable edge between two cells, and those (m,) on
    the boundary.
    """
    slots = mesh.edges.slots()
    passable = ((data.K > 0)[:, None] & ~data.zero_gap).ravel()
    # The appended False makes slot -1, the missing neighbour of a boundary side, impassable.
    first, second = np.append(passable, False).take(slots).T
    alone = slots[:, 1] < 0
    return slots.compress(first & second, axis=0), slots[:, 0].compress(first & alone)


def _between_ends(mesh: AnyMesh, data: CellData) -> tuple[np.ndarray, Jumps]:
    """Keep the cells connected to both ends through passable sides; p jumps at the inlet.

    p is prescribed on the passable sides of inlet and outlet.
    """
    pairs, alone = passable_sides(mesh, data)
    ends = mesh.cells.ravel()[end_slots(alone)]
    inlet = alone[mesh.inlet[ends].all(axis=1)]
    outlet = alone[mesh.outlet[ends].all(axis=1)]
    piece = components(pairs // 3, len(mesh.cells))
    through = np.zeros(int(piece.max()) + 1, dtype=bool)
    through[np.intersect1d(piece[inlet // 3], piece[outlet // 3])] = True
    kept = through.take(piece) & (data.K > 0)
    label, count = _continuous_labels(mesh, data, kept, pairs)
    at_ends = [label[end_slots(slots[kept[slots // 3]])] for slots in (inlet, outlet)]
    label = label.reshape(-1, 3).compress(kept, axis=0)
    group = _of_one_pressure(label[data.equipotential[kept]], at_ends, count)
    at_inlet, at_outlet = (_marked(group[end], count) for end in at_ends)
    label = group.take(label)
    of_corner, used = numbered(label, ~(at_inlet | at_outlet))
    crossed = at_inlet.take(label).astype(np.int8)[:, :, None]
    return kept, Jumps(of_corner, used, crossed, np.ones((1, 1), dtype=np.int8))


def _open_torus(mesh: Torus, data: CellData) -> tuple[np.ndarray, Jumps]:
    """Keep the cells that wind around the torus.

    One corner of each component has no unknown: its pressure is that of the jumps alone.
    """
    pairs, _ = passable_sides(mesh, data)
    # Sides along x = Lx and along y = Ly, as (1, 0) and (0, 1).
    ends = mesh.cells.ravel()[end_slots(pairs.ravel())]
    far = mesh.on_far_seam[ends].all(axis=1).reshape(-1, 2, 2)
    jump = far[:, 0].astype(int) - far[:, 1]
    inside = ~jump.any(axis=1)
    piece = components(pairs[inside] // 3, len(mesh.cells))
    first, second = piece[pairs[~inside] // 3].T
    unwound = unwind(first, second, jump[~inside], int(piece.max()) + 1)
    component = unwound.root[piece]
    kept = np.isin(component, unwound.winding_roots) & (data.K > 0)
    label, count = _continuous_labels(mesh, data, kept, pairs)
    label = label.reshape(-1, 3)[kept]
    _, first = np.unique(component[kept], return_index=True)
    free = np.ones(count, dtype=bool)
    free[label[first, 0]] = False
    of_corner, used = numbered(label, free)
    crossed = mesh.on_far_seam[mesh.cells[kept]]
    return kept, Jumps(of_corner, used, crossed, jumps_along(unwound.windings))


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


def _continuous_labels(
    mesh: AnyMesh, data: CellContact, kept: np.ndarray, pairs: np.ndarray
) -> tuple[np.ndarray, int]:
    """Label (3 C,) of each corner, and a number above all labels.

    Corners at one point share a label unless contact separates them: the pressure may jump across a
    contact line, through which nothing flows. Corners are joined only through passable sides, so
    that linear pressures do not leak across the line: `pairs` (n, 2) are the slots of the sides of
    passable edges. The cells `kept` (C,) carry flow.
    """
    vertex, vertices = mesh.twin.take(mesh.cells), len(mesh.xy)
    pairs = pairs.compress(kept.take(pairs[:, 0] // 3), axis=0)
    # Labels of a point can differ only at zero-gap sides and next to cells that carry no flow.
    special = np.zeros(vertices, dtype=bool)
    special[vertex[~kept]] = True
    special[vertex.ravel()[end_slots(np.flatnonzero(data.zero_gap))]] = True
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
) -> Jumps:
    """Number the stream function on the kept cells (C,) bool.

    It has one unknown for each contact spot, and is constant on each wall and in all other cells.
    Where spots close every channel, no jump is possible. `merge_blocked`: the corners of a
    blocked cell are one unknown (true dual); otherwise they are free (regularised dual, in which
    blocked cells conduct a little).
    """
    on_walls = mesh.side_ends(mesh.sides_on_wall())
    pairs = [*spot_ties(mesh, data, kept, merge_blocked), on_walls]
    spot = components(np.concatenate(pairs), len(mesh.xy))
    near, far, jump = _across(mesh)
    unwound = unwind(spot[near], spot[far], jump, int(spot.max()) + 1)
    of_cell = spot.take(mesh.cells.compress(kept, axis=0))
    label = unwound.root[of_cell]
    live = np.zeros(len(unwound.root), dtype=bool)
    live[label.compress(~data.blocked[kept], axis=0) if merge_blocked else label] = True
    # ψ is defined up to a constant: pin it on the walls, or on any one spot.
    live[live.argmax() if mesh.periodic else unwound.root[spot[near[0]]]] = False
    of_corner, count = numbered(label, live)
    # Use the smallest integer type that holds the offsets.
    smallest = np.min_scalar_type(-1 - int(np.abs(unwound.offset).max()))
    crossed = unwound.offset.astype(smallest)[of_cell]
    return Jumps(of_corner, count, crossed, jumps_across(unwound.windings))


def _across(mesh: AnyMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (n,) on the near and on the far side of seams or walls; lines crossed (n, d)."""
    if isinstance(mesh, Torus):
        far = np.flatnonzero(mesh.on_far_seam.any(axis=1))
        return mesh.twin[far], far, mesh.on_far_seam[far].astype(int)
    far = np.flatnonzero(mesh.top)
    near = mesh.twin[far]
    if not mesh.periodic:
        near, far = np.flatnonzero(mesh.bottom)[:1], far[:1]
    return near, far, np.ones((len(far), 1), dtype=int)


def spot_ties(
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


def jumps_along(windings: np.ndarray) -> np.ndarray:
    """Jumps (k, 2) of the pressures to solve for: a basis of the jumps that drive different flows.

    With two independent windings every jump drives a flow. With a single primitive winding w only
    J·w matters, and the jump w is enough. Whole numbers: a function that jumps by a fraction across
    a seam could not be stored exactly.
    """
    if not len(windings):
        return np.empty((0, 2))
    if np.linalg.matrix_rank(windings) == 2:
        return np.eye(2)
    return np.array([_primitive(windings)], dtype=float)


def jumps_across(windings: np.ndarray) -> np.ndarray:
    """Jumps (k, d) of stream functions that are constant on contact spots with these windings."""
    d = windings.shape[1]
    if not len(windings):
        return np.eye(d, dtype=np.int8)
    if np.linalg.matrix_rank(windings) == d:
        return np.empty((0, d))
    m, n = _primitive(windings)
    return np.array([[-n, m]], dtype=float)


def _primitive(windings: np.ndarray) -> tuple[int, int]:
    """The shortest winding in the common direction of all windings.

    A cluster that winds in this direction contains it: a closed path that does not cross itself
    never winds twice around a torus.
    """
    m, n = (windings[0] // np.gcd(*windings[0])).tolist()
    return m, n
