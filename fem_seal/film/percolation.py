"""Percolation: whether a phase spans from inlet to outlet or winds around a periodic cell."""

from collections import deque

import numpy as np

from fem_seal.film import clusters
from fem_seal.film.lattice import SIDES
from fem_seal.registry import choose


def spans(mask: np.ndarray, connectivity: str, sides: str = "wall") -> bool:
    """Whether a cluster of the mask joins inlet (row 0) and outlet (last row).

    Parameters
    ----------
    mask : (nx, ny) bool
    connectivity : "4", "8" or "triangulation": see `clusters.label`
    sides : "wall", or "periodic": the last column neighbours the first
    """
    periodic = (False, choose(SIDES, sides, "sides"))
    return clusters.joins_ends(mask, connectivity, periodic)


def winds(
    mask: np.ndarray, connectivity: str, axis: int, periodic: tuple[bool, bool] = (True, True)
) -> bool:
    """Whether a closed path inside the mask goes around the periodic cell along an axis.

    Every cluster of the cell cut open at its seams gets a winding number: the seams crossed, with
    sign, on the way to it. A cluster reached with two different numbers closes a path around the
    cell (J. Machta, Y. S. Choi, A. Lucke, T. Schweizer, L. M. Chayes, Phys. Rev. E 54, 1332
    (1996)).

    Parameters
    ----------
    mask : (nx, ny) bool
    connectivity : "4", "8" or "triangulation": see `clusters.label`
    axis : 0 (along the flow) or 1 (around the seal)
    periodic : along each axis, whether the last sample neighbours the first

    Returns
    -------
    False along an axis that is not periodic.
    """
    labels, _ = clusters.label_inside(mask, connectivity)
    links = clusters.seam_links(labels, connectivity, periodic)
    neighbours: dict[int, list[tuple[int, int]]] = {}
    steps = links.shift[:, axis].tolist()
    for a, b, step in zip(links.first.tolist(), links.second.tolist(), steps, strict=True):
        neighbours.setdefault(a, []).append((b, step))
        neighbours.setdefault(b, []).append((a, -step))
    return _has_inconsistent_loop(neighbours)


def _has_inconsistent_loop(neighbours: dict[int, list[tuple[int, int]]]) -> bool:
    """Whether the steps along some loop of a graph do not add up to zero.

    Parameters
    ----------
    neighbours : for each cluster its linked clusters, each with the step to it: the seams crossed
    """
    winding: dict[int, int] = {}
    for root in neighbours:
        if root in winding:
            continue
        winding[root] = 0
        queue = deque([root])
        while queue:
            cluster = queue.popleft()
            for neighbour, step in neighbours[cluster]:
                if neighbour not in winding:
                    winding[neighbour] = winding[cluster] + step
                    queue.append(neighbour)
                elif winding[neighbour] != winding[cluster] + step:
                    return True
    return False
