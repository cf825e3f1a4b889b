"""Percolation: whether a phase spans from inlet to outlet or winds around a periodic cell.

A gap is sealed, and its leak rate exactly 0, when its open phase does not span.
"""

from collections import deque

import numpy as np

from fem_seal.grid import GridField
from fem_seal.registry import choose
from fem_seal.topology import clusters
from fem_seal.topology.lattice import SIDES, lattice


def spans(mask: np.ndarray, connectivity: str, sides: str = "wall") -> bool:
    """Whether a cluster of the mask joins inlet (row 0) and outlet (last row).

    Parameters
    ----------
    mask : (nx, ny) bool
    connectivity : "4", "8" or "triangulation", see `clusters.label`
    sides : "wall", or "periodic": the last column neighbours the first

    Returns
    -------
    bool

    Raises
    ------
    InvalidInput
        For an unknown connectivity or sides.
    """
    periodic = (False, choose(SIDES, sides, "sides"))
    labels, _ = clusters.label(mask, connectivity, periodic)
    return bool(np.intersect1d(labels[0][labels[0] > 0], labels[-1]).size)


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
    connectivity : "4", "8" or "triangulation", see `clusters.label`
    axis : 0 (along the flow) or 1 (around the seal)
    periodic : (bool, bool)
        Along each axis, whether the last sample neighbours the first.

    Returns
    -------
    bool; False along an axis that is not periodic.

    Raises
    ------
    InvalidInput
        For an unknown connectivity.
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
    neighbours : dict
        For each cluster its linked clusters, each with the step to it: the seams crossed.
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


def is_sealed(gap: GridField, sides: str, representation: str) -> bool:
    """Whether no open path joins inlet and outlet, so that the leak rate is exactly zero.

    Parameters
    ----------
    gap : GridField
        Gap [m], zero in contact.
    sides : "wall" or "periodic"
    representation : "linear" or "constant"
        Linear: open vertices joined along the edges of the triangulation; exact for the piecewise
        linear gap, which is positive on all triangles around an open vertex. Constant: open pixels
        joined through their common sides.

    Returns
    -------
    bool

    Raises
    ------
    InvalidInput
        As in `lattice.lattice`.
    """
    sites = lattice(gap, sides, representation)
    return not spans(sites.open, sites.connectivity, sides)


def carrying(gap: GridField, sides: str, representation: str) -> np.ndarray:
    """Mask of the open samples connected to both inlet and outlet: no others carry flow.

    Parameters
    ----------
    gap, sides, representation : as in `is_sealed`

    Returns
    -------
    bool array of the shape of gap.vertices() (linear) or gap.values (constant); all False if the
    gap is sealed.

    Raises
    ------
    InvalidInput
        As in `lattice.lattice`.
    """
    sites = lattice(gap, sides, representation)
    labels, count = clusters.label(sites.open, sites.connectivity, sites.periodic)
    return sites.on_samples(clusters.touching(labels, count, labels[0], labels[-1]))
