"""Checks of a mesh that was read from a file; every fault raises one sentence."""

import numpy as np

from fem_seal.digits import number_of
from fem_seal.errors import InvalidInput
from fem_seal.mesh.files import Triangles
from fem_seal.mesh.mesh import INLET, INSIDE, ISLAND, OUTLET, ends_of_sides

FLATTEST = 1e-10  # doubled area of a triangle over the square of its longest edge


def labelled(mesh: Triangles, source: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Check a mesh and label its sides: the arguments of `shape_mesh`, without unused points.

    The messages begin with the name `source`. Clockwise triangles are turned.
    """
    used, cells = np.unique(mesh.cells, return_inverse=True)
    xy, cells = mesh.xy[used], cells.reshape(-1, 3)
    cells = _counterclockwise(xy, cells, source)
    ends = ends_of_sides(cells)
    keys = _keys(ends.reshape(-1, 2), len(xy))
    values, first, of_side, count = np.unique(
        keys, return_index=True, return_inverse=True, return_counts=True
    )
    branching = np.flatnonzero(count > 2)
    if branching.size:
        edge = ends.reshape(-1, 2)[first[branching[0]]]
        raise InvalidInput(
            f"{source}: more than two triangles share {number_of(branching.size, 'edge')}, the "
            f"first at {coordinates(xy[edge].mean(axis=0))}; a film has one sheet: "
            "remove the extra triangles"
        )
    _refuse_folds(xy, ends.reshape(-1, 2), of_side, count, source)
    label = _labels(mesh, used, len(xy), values, count, source)
    unlabelled = np.flatnonzero((count == 1) & (label == INSIDE))
    if unlabelled.size:
        edge = ends.reshape(-1, 2)[first[unlabelled[0]]]
        raise InvalidInput(
            f"{source}: the boundary has {number_of(unlabelled.size, 'edge')} in none of the "
            "groups inlet, outlet and wall, the first at "
            f"{coordinates(xy[edge].mean(axis=0))}; add each to one. If that is inside the film, "
            "triangles are not joined there: merge points that stand twice, and halve a triangle "
            "with a node in the middle of its edge"
        )
    return xy, cells, label[of_side].reshape(-1, 3)


def coordinates(point: np.ndarray) -> str:
    """Coordinates of a point (2,) [m] for a message."""
    return f"x = {point[0]:.6g} m, y = {point[1]:.6g} m"


def _keys(ends: np.ndarray, count: int) -> np.ndarray:
    """One number (n,) for each pair (n, 2) of vertices, whatever their order."""
    ends = np.sort(ends, axis=1).astype(np.int64)
    return ends[:, 0] * count + ends[:, 1]


def _counterclockwise(xy: np.ndarray, cells: np.ndarray, source: str) -> np.ndarray:
    """Cells with counterclockwise corners; InvalidInput if one is flat."""
    corner = xy[cells]
    u, v = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    doubled = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    longest = ((corner - np.roll(corner, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
    flat = np.flatnonzero(np.abs(doubled) <= FLATTEST * longest)
    if flat.size:
        raise InvalidInput(
            f"{source}: {flat.size} of {len(cells)} triangles have no area, the first at "
            f"{coordinates(corner[flat[0]].mean(axis=0))}"
        )
    return np.where(doubled[:, None] < 0, cells[:, [0, 2, 1]], cells)


def _refuse_folds(
    xy: np.ndarray, ends: np.ndarray, of_side: np.ndarray, count: np.ndarray, source: str
) -> None:
    """Raise InvalidInput if two neighbours overlap.

    Counterclockwise neighbours run through their common edge in opposite directions; if they run in
    the same direction they lie on the same side of it.
    """
    direction = np.where(ends[:, 0] < ends[:, 1], 1, -1)
    same = np.flatnonzero((np.bincount(of_side, direction, len(count)) != 0) & (count == 2))
    if same.size:
        edge = ends[np.argmax(of_side == same[0])]
        raise InvalidInput(
            f"{source}: the mesh is folded: two triangles lie on the same side of the edge at "
            f"{coordinates(xy[edge].mean(axis=0))}"
        )


def _labels(
    mesh: Triangles,
    used: np.ndarray,
    count: int,
    values: np.ndarray,
    cells_at: np.ndarray,
    source: str,
) -> np.ndarray:
    """Label (E,) of each edge from the groups of the mesh.

    `used` are the points of the mesh that are vertices of triangles, `values` (E,) the sorted keys
    of the edges, and `cells_at` (E,) the number of triangles at each.
    """
    label = np.full(len(values), INSIDE, dtype=np.int8)
    for name, code in (("inlet", INLET), ("outlet", OUTLET), ("wall", ISLAND)):
        edges = getattr(mesh, name)
        known = np.isin(edges, used).all(axis=1)
        keys = _keys(np.searchsorted(used, edges), count)
        index = np.minimum(np.searchsorted(values, keys), len(values) - 1)
        astray = ~known | (values[index] != keys)
        astray[~astray] = cells_at[index[~astray]] != 1
        if astray.any():
            first = mesh.xy[edges[np.argmax(astray)]].mean(axis=0)
            raise InvalidInput(
                f"{source}: the group {name} has {number_of(np.count_nonzero(astray), 'edge')} off "
                f"the boundary, the first at {coordinates(first)}"
            )
        twice = label[index] != INSIDE
        if twice.any():
            raise InvalidInput(
                f"{source}: the group {name} shares {number_of(np.count_nonzero(twice), 'edge')} "
                "of the boundary with another group, the first at "
                f"{coordinates(mesh.xy[edges[np.argmax(twice)]].mean(axis=0))}"
            )
        label[index] = code
    return label
