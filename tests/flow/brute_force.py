"""Bounds of the leak rate that share nothing with the package but the two principles.

Every pixel is cut into `parts`² squares along its own diagonal. The energies use no closed form:
g³ and 1/g³ are convex. On a triangle where g is linear their means are therefore at most those of
the three corner values, and too large an energy is on the safe side in both principles. The
pressure stays continuous across contact lines, the stream function is constant on every triangle
that contact touches, and a direct solver finds the minima.
"""

import numpy as np
from scipy.sparse import coo_matrix, identity
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve


def bounds_by_brute_force(
    samples: np.ndarray,
    spacing: tuple[float, float],
    representation: str,
    sides: str,
    parts: int,
) -> tuple[float, float]:
    """Lower and upper bound for K = g³ and unit pressure drop; `parts` of a pixel along each axis.

    `samples` are the gap at the vertices ("linear") or on the pixels ("constant").
    """
    pixels = np.array(samples.shape) - (representation == "linear")
    nx, ny = pixels * parts
    cells, pixel = _triangles(nx, ny, parts)
    if representation == "linear":
        g = _between(samples, cells, pixel, parts, ny)
    else:
        g = np.repeat(samples[tuple(pixel.T)][:, None], 3, axis=1)
    local = stiffness(np.stack(np.divmod(cells, ny + 1), axis=2) * spacing / parts)
    i, j = np.divmod(np.arange((nx + 1) * (ny + 1)), ny + 1)
    seam = np.flatnonzero(j == ny), np.flatnonzero(j == 0)

    node = np.arange(len(i))
    if sides == "periodic":
        node[seam[0]] = node[seam[1]]
    prescribed = (i == 0) | (i == nx)
    upper = least_energy(local * _mean(g**3), cells, node, 1.0 * (i == 0), prescribed)

    open_cells = (g > 0).all(axis=1)
    closed = cells[~open_cells]
    ties = [closed[:, :2], closed[:, 1:]]
    if sides == "wall":
        ties += [np.stack([wall[1:], wall[:-1]], axis=1) for wall in seam]
    patch = _components(np.concatenate(ties), len(i))
    if sides == "wall":
        offset = 1.0 * (patch == patch[seam[0][0]])
        prescribed = (offset == 1) | (patch == patch[seam[1][0]])
        sealed = patch[seam[0][0]] == patch[seam[1][0]]
    else:
        patch, offset, sealed = _potentials(patch, *seam)
        prescribed = patch == patch[0]
    if sealed:
        return 0.0, upper
    dual = local[open_cells] * _mean(g[open_cells] ** -3.0)
    return 1 / least_energy(dual, cells[open_cells], patch, offset, prescribed), upper


def _mean(of_corners: np.ndarray) -> np.ndarray:
    return of_corners.mean(axis=1)[:, None, None]


def _triangles(nx: int, ny: int, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (C, 3) of the triangles and the pixel (C, 2) each lies in."""
    i, j = (a.ravel() for a in np.indices((nx, ny)))
    sw = i * (ny + 1) + j
    se, nw, ne = sw + ny + 1, sw + 1, sw + ny + 2
    rising = (i // parts + j // parts) % 2 == 0
    one = np.where(rising, [sw, se, ne], [sw, se, nw]).T
    other = np.where(rising, [sw, ne, nw], [se, ne, nw]).T
    return np.concatenate([one, other]), np.tile(np.stack([i, j], axis=1) // parts, (2, 1))


def _between(samples, cells, pixel, parts: int, ny: int) -> np.ndarray:
    """Gap (C, 3) at the corners: barycentric in the pixel triangle in which the cell lies."""
    place = np.stack(np.divmod(cells, ny + 1), axis=2)
    s, t = np.moveaxis((place - pixel[:, None] * parts) / parts, 2, 0)
    (i, j), middle = pixel.T, np.stack([s.mean(axis=1), t.mean(axis=1)])
    sw, se, nw, ne = (samples[i + a, j + b][:, None] for a, b in [(0, 0), (1, 0), (0, 1), (1, 1)])
    below_rising = (middle[1] < middle[0])[:, None]
    below_falling = (middle.sum(axis=0) < 1)[:, None]
    rising = np.where(
        below_rising, sw * (1 - s) + se * (s - t) + ne * t, sw * (1 - t) + nw * (t - s) + ne * s
    )
    falling = np.where(
        below_falling,
        sw * (1 - s - t) + se * s + nw * t,
        ne * (s + t - 1) + nw * (1 - s) + se * (1 - t),
    )
    # Rounding must neither open contact nor close what is open.
    return np.maximum(np.where(((i + j) % 2 == 0)[:, None], rising, falling), 0.0)


def stiffness(x: np.ndarray) -> np.ndarray:
    """∫∇λ_k·∇λ_l (C, 3, 3) from the edges e_k opposite to the corners (C, 3, 2): e_k·e_l / 4|T|."""
    e = x[:, [2, 0, 1]] - x[:, [1, 2, 0]]
    area = abs(e[:, 0, 0] * e[:, 1, 1] - e[:, 0, 1] * e[:, 1, 0]) / 2
    return e @ e.transpose(0, 2, 1) / (4 * area[:, None, None])


def _components(pairs: np.ndarray, count: int) -> np.ndarray:
    graph = coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def _potentials(patch: np.ndarray, top: np.ndarray, bottom: np.ndarray):
    """Walk over the spots on the seam, where ψ(top) = ψ(bottom) + 1: root and height of each."""
    steps: dict[int, list[tuple[int, int]]] = {}
    for low, high in zip(patch[bottom].tolist(), patch[top].tolist(), strict=True):
        steps.setdefault(low, []).append((high, 1))
        steps.setdefault(high, []).append((low, -1))
    root, height = np.arange(patch.max() + 1), np.zeros(patch.max() + 1)
    seen: set[int] = set()
    for start in steps:
        todo = [start] if start not in seen else []
        seen.add(start)
        while todo:
            here = todo.pop()
            for there, step in steps[here]:
                if there not in seen:
                    seen.add(there)
                    root[there], height[there] = root[here], height[here] + step
                    todo.append(there)
                elif height[there] != height[here] + step:
                    return root[patch], height[patch], True
    return root[patch], height[patch], False


def least_energy(local, cells, node, offset, prescribed) -> float:
    """Energy of offset + x, by a direct solver; x is a number for each node not prescribed."""
    free = node[~prescribed]
    number = np.full(node.max() + 1, -1)
    used = np.intersect1d(free, node[cells])
    number[used] = np.arange(len(used))
    of_corner = np.where(prescribed, -1, number[node])[cells]
    v = offset[cells]
    push = np.einsum("ckl,cl->ck", local, v)
    rows, columns = np.repeat(of_corner, 3, axis=1).ravel(), np.tile(of_corner, 3).ravel()
    both = (rows >= 0) & (columns >= 0)
    A = coo_matrix((local.ravel()[both], (rows[both], columns[both]))).tocsr()
    b = -np.bincount(of_corner[of_corner >= 0], push[of_corner >= 0], len(used))
    # Pockets belong to neither end: what their numbers are does not matter.
    scale = A.diagonal()
    alive = scale > 0
    A = A[alive][:, alive] + 1e-14 * scale.max() * identity(alive.sum())
    x = np.zeros(len(used) + 1)
    x[:-1][alive] = spsolve(A.tocsc(), b[alive])
    v = v + np.where(of_corner >= 0, x[of_corner], 0)
    v -= v[:, :1].copy()
    return float(np.einsum("ck,ckl,cl->c", v, local, v).sum())
