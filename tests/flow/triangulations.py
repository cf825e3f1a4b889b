"""Triangulations the tests share: rings, sectors and random points, with labelled boundaries."""

import numpy as np
from scipy.spatial import Delaunay

from fem_seal.film.mesh_film import MeshFilm
from fem_seal.mesh.mesh import INLET, INSIDE, ISLAND, OUTLET
from fem_seal.mesh.shape import shape_mesh
from fem_seal.mesh.triangles import TriangleMesh


def labelled(xy: np.ndarray, cells: np.ndarray, label) -> tuple[np.ndarray, ...]:
    """Sides with one cell get label(middle) of their middle."""
    ends = cells[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)
    keys = np.sort(ends, axis=1) @ (len(xy), 1)
    _, of_side, count = np.unique(keys, return_inverse=True, return_counts=True)
    rim = count[of_side] == 1
    sides = np.full(len(ends), INSIDE, dtype=np.int8)
    sides[rim] = label(xy[ends[rim]].mean(axis=1))
    return xy, cells, sides.reshape(-1, 3)


def ring_parts(nr: int, nt: int, inner: float, outer: float, turn: float = 0.0):
    """Polygons of nt corners on two circles, nr layers between; inlet inside, outlet outside."""
    r = np.linspace(inner, outer, nr + 1)
    t = 2 * np.pi * np.arange(nt) / nt + turn
    xy = np.stack([np.outer(r, np.cos(t)), np.outer(r, np.sin(t))], axis=-1).reshape(-1, 2)
    v = np.arange((nr + 1) * nt).reshape(nr + 1, nt)
    a, b, c, d = v[:-1], v[1:], np.roll(v, -1, 1)[1:], np.roll(v, -1, 1)[:-1]
    cells = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    middle = (inner + outer) / 2
    return labelled(xy, cells, lambda p: np.where(np.hypot(*p.T) < middle, INLET, OUTLET))


def ring(nr: int, nt: int, inner: float = 1.0, outer: float = 2.0, turn: float = 0.0):
    """Mesh of `ring_parts`, cut open."""
    return shape_mesh(*ring_parts(nr, nt, inner, outer, turn))


def scattered_square(count: int, seed: int) -> TriangleMesh:
    """Delaunay triangles of random points in the unit square; inlet x = 0, outlet x = 1."""
    rng = np.random.default_rng(seed)
    n = int(np.sqrt(count)) + 2
    side = np.linspace(0, 1, n)
    rim = [(s, e) for s in side for e in (0, 1)] + [(e, s) for s in side[1:-1] for e in (0, 1)]
    inside = rng.uniform(0.3 / n, 1 - 0.3 / n, (count, 2))
    xy = np.concatenate([np.array(rim), inside])
    cells = Delaunay(xy).simplices.astype(np.int64)
    doubled = _doubled(xy, cells)
    cells[doubled < 0] = cells[doubled < 0][:, [0, 2, 1]]
    return shape_mesh(*labelled(xy, cells[np.abs(doubled) > 1e-9], ends_of_square))


def square_with_hole(n: int, seed: int) -> TriangleMesh:
    """Unit square of n × n shaken squares, n >= 6, without those near its centre."""
    rng = np.random.default_rng(seed)
    i, j = np.indices((n + 1, n + 1))
    inside = (i > 0) & (i < n) & (j > 0) & (j < n)
    xy = np.stack([i, j], axis=-1) / n
    xy += inside[..., None] * rng.uniform(-0.25, 0.25, xy.shape) / n
    v = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    sw, se, nw, ne = v[:-1, :-1], v[1:, :-1], v[:-1, 1:], v[1:, 1:]
    far = (np.maximum(np.abs(2 * i + 1 - n), np.abs(2 * j + 1 - n)) > n / 3)[:-1, :-1]
    cells = np.concatenate([np.stack([sw, se, ne], -1)[far], np.stack([sw, ne, nw], -1)[far]])
    used, cells = np.unique(cells, return_inverse=True)
    return shape_mesh(*labelled(xy.reshape(-1, 2)[used], cells.reshape(-1, 3), ends_of_square))


def ends_of_square(p: np.ndarray) -> np.ndarray:
    """Inlet at x = 0, outlet at x = 1, all else wall."""
    return np.select([p[:, 0] < 1e-9, p[:, 0] > 1 - 1e-9], [INLET, OUTLET], ISLAND)


def _doubled(xy: np.ndarray, cells: np.ndarray) -> np.ndarray:
    u, v = xy[cells[:, 1]] - xy[cells[:, 0]], xy[cells[:, 2]] - xy[cells[:, 0]]
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def random_gap(mesh: TriangleMesh, seed: int, contact: float) -> MeshFilm:
    """Independent gaps at the vertices, a part of them 0."""
    rng = np.random.default_rng(seed)
    values = rng.uniform(0.05, 1, len(mesh.xy)) * (rng.random(len(mesh.xy)) > contact)
    return MeshFilm(mesh, values[mesh.twin])


def grid_mesh(shape: tuple[int, int], size: tuple[float, float]) -> TriangleMesh:
    """The pixel triangulation of a grid, diagonals alternating, as a mesh of any shape."""
    mx, my = shape
    i, j = np.indices((mx + 1, my + 1))
    xy = np.stack([i / mx, j / my], axis=-1).reshape(-1, 2)
    v = np.arange(len(xy)).reshape(mx + 1, my + 1)
    sw, se, nw, ne = v[:-1, :-1], v[1:, :-1], v[:-1, 1:], v[1:, 1:]
    even = ((i + j) % 2 == 0)[:-1, :-1, None]
    low = np.where(even, np.stack([sw, se, ne], -1), np.stack([sw, se, nw], -1))
    high = np.where(even, np.stack([sw, ne, nw], -1), np.stack([se, ne, nw], -1))
    cells = np.concatenate([low, high]).reshape(-1, 3)
    _, cells, sides = labelled(xy, cells, ends_of_square)
    return shape_mesh(xy * size, cells, sides)


def film_on_triangles(values: np.ndarray, spacing: tuple[float, float]) -> MeshFilm:
    """Samples of a gap at the vertices of such a mesh."""
    mx, my = np.array(values.shape) - 1
    mesh = grid_mesh((mx, my), (mx * spacing[0], my * spacing[1]))
    return MeshFilm(mesh, values[tuple(np.rint(mesh.xy / spacing).astype(int).T)])
