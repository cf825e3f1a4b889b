"""What a mesh must be before anything is solved on it: each fault is one sentence."""

import numpy as np
from scipy.spatial import cKDTree

from fem_seal.errors import InvalidInput
from fem_seal.mesh.files import Triangles
from fem_seal.mesh.triangles import INLET, INSIDE, ISLAND, OUTLET

COINCIDENT = 1e-9  # of the extent: points closer than this are meant to be one
FLATTEST = 1e-10  # doubled area of a triangle over the square of its longest edge


def labelled(
    mesh: Triangles, source: str, reorient: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Check a mesh and label its sides.

    Parameters
    ----------
    mesh : as read
    source : of the mesh, named first in messages
    reorient : turn clockwise triangles instead of refusing them

    Returns
    -------
    xy, cells, sides : for `shape.shape_mesh`; points that no triangle uses are left out

    Raises
    ------
    InvalidInput
        For clockwise, degenerate or overlapping triangles, edges of more than two triangles,
        hanging nodes, points that stand twice, and boundary edges without or with two groups.
    """
    used, cells = np.unique(mesh.cells, return_inverse=True)
    xy, cells = mesh.xy[used], cells.reshape(-1, 3)
    cells = _counterclockwise(xy, cells, source, reorient)
    ends = cells[:, [[1, 2], [2, 0], [0, 1]]]
    keys = _keys(ends.reshape(-1, 2), len(xy))
    values, first, of_side, count = np.unique(
        keys, return_index=True, return_inverse=True, return_counts=True
    )
    many = np.flatnonzero(count > 2)
    if many.size:
        edge = ends.reshape(-1, 2)[first[many[0]]]
        raise InvalidInput(
            f"{source}: {many.size} edges belong to more than two triangles, the first at "
            f"{place(xy[edge].mean(axis=0))}; a film has one sheet: remove the extra triangles"
        )
    _refuse_folds(xy, ends.reshape(-1, 2), of_side, count, source)
    label = _labels(mesh, used, len(xy), values, count, source)
    bare = np.flatnonzero((count == 1) & (label == INSIDE))
    if bare.size:
        raise InvalidInput(_why_bare(xy, ends.reshape(-1, 2)[first], count == 1, bare, source))
    return xy, cells, label[of_side].reshape(-1, 3)


def place(point: np.ndarray) -> str:
    """Coordinates for a message."""
    return f"x = {point[0]:.6g} m, y = {point[1]:.6g} m"


def _keys(ends: np.ndarray, count: int) -> np.ndarray:
    ends = np.sort(ends, axis=1).astype(np.int64)
    return ends[:, 0] * count + ends[:, 1]


def _counterclockwise(xy: np.ndarray, cells: np.ndarray, source: str, reorient: bool) -> np.ndarray:
    corner = xy[cells]
    u, v = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    doubled = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    longest = ((corner - np.roll(corner, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
    flat = np.flatnonzero(np.abs(doubled) <= FLATTEST * longest)
    if flat.size:
        raise InvalidInput(
            f"{source}: {flat.size} of {len(cells)} triangles have no area, the first at "
            f"{place(corner[flat[0]].mean(axis=0))}"
        )
    clockwise = doubled < 0
    if clockwise.any() and not reorient:
        where = corner[np.argmax(clockwise)].mean(axis=0)
        raise InvalidInput(
            f"{source}: {np.count_nonzero(clockwise)} of {len(cells)} triangles are clockwise, "
            f"the first at {place(where)}; set shape.reorient = true if the mesh is right but for "
            "the order of its points"
        )
    return np.where(clockwise[:, None], cells[:, [0, 2, 1]], cells)


def _refuse_folds(
    xy: np.ndarray, ends: np.ndarray, of_side: np.ndarray, count: np.ndarray, source: str
) -> None:
    """Neighbours run through their common edge in opposite directions, or they overlap."""
    direction = np.where(ends[:, 0] < ends[:, 1], 1, -1)
    same = np.flatnonzero((np.bincount(of_side, direction, len(count)) != 0) & (count == 2))
    if same.size:
        edge = ends[np.argmax(of_side == same[0])]
        raise InvalidInput(
            f"{source}: the mesh is folded: two triangles lie on the same side of the edge at "
            f"{place(xy[edge].mean(axis=0))}"
        )


def _labels(
    mesh: Triangles,
    used: np.ndarray,
    count: int,
    values: np.ndarray,
    cells_at: np.ndarray,
    source: str,
) -> np.ndarray:
    """Label (E,) of each edge from the groups of the mesh."""
    label = np.full(len(values), INSIDE, dtype=np.int8)
    for name, code in (("inlet", INLET), ("outlet", OUTLET), ("wall", ISLAND)):
        edges = getattr(mesh, name)
        known = np.isin(edges, used).all(axis=1)
        keys = _keys(np.searchsorted(used, edges), count)
        at = np.minimum(np.searchsorted(values, keys), len(values) - 1)
        lost = ~known | (values[at] != keys)
        lost[~lost] = cells_at[at[~lost]] != 1
        if lost.any():
            raise InvalidInput(
                f"{source}: {np.count_nonzero(lost)} edges of the group {name} are not on the "
                f"boundary, the first at {place(mesh.xy[edges[np.argmax(lost)]].mean(axis=0))}"
            )
        twice = label[at] != INSIDE
        if twice.any():
            raise InvalidInput(
                f"{source}: {np.count_nonzero(twice)} boundary edges of the group {name} are in "
                f"another group too, the first at "
                f"{place(mesh.xy[edges[np.argmax(twice)]].mean(axis=0))}"
            )
        label[at] = code
    return label


def _why_bare(
    xy: np.ndarray, ends: np.ndarray, on_rim: np.ndarray, bare: np.ndarray, source: str
) -> str:
    """Say why edges of one triangle only are in no group."""
    rim = np.unique(ends[on_rim])
    extent = np.ptp(xy, axis=0).max()
    tree = cKDTree(xy[rim])
    close = tree.query_pairs(COINCIDENT * extent, output_type="ndarray")
    if len(close):
        return (
            f"{source}: {len(close)} points stand twice, the first at {place(xy[rim[close[0, 0]]])}"
            ", so that the triangles around them are not joined; merge duplicate points"
        )
    for a, b in ends[bare]:
        along = xy[b] - xy[a]
        near = rim[tree.query_ball_point((xy[a] + xy[b]) / 2, np.linalg.norm(along) / 2)]
        off = xy[near] - xy[a]
        distance = np.abs(off[:, 0] * along[1] - off[:, 1] * along[0]) / np.linalg.norm(along)
        hanging = near[(distance < COINCIDENT * extent) & (near != a) & (near != b)]
        if hanging.size:
            return (
                f"{source}: a node hangs in the middle of an edge at {place(xy[hanging[0]])}; "
                "halve the larger triangle too, so that edges meet whole edges"
            )
    middle = xy[ends[bare[0]]].mean(axis=0)
    return (
        f"{source}: {bare.size} boundary edges are in none of the groups inlet, outlet and wall, "
        f"the first at {place(middle)}; add them to one"
    )
