"""Paths around a periodic cell: which clusters wind around it, and the widest such path.

A cluster of the cell cut open at its seams gets a winding number: the seams crossed, with sign, on
the way to it. A cluster reached with two different numbers closes a path around the cell
(J. Machta, Y. S. Choi, A. Lucke, T. Schweizer, L. M. Chayes, Phys. Rev. E 54, 1332 (1996)).
"""

from dataclasses import dataclass
from operator import add, sub

import numpy as np

from fem_seal.arguments import require_known
from fem_seal.errors import InvalidInput
from fem_seal.film import clusters
from fem_seal.film.constriction import highest_spanning
from fem_seal.film.lattice import OPEN_CONNECTIVITY
from fem_seal.grid import GridField, require_grid_field


@dataclass(frozen=True, eq=False)
class Unwound:
    """Pieces of clusters laid out in the plane, joined across the seams."""

    root: np.ndarray  #: (n,) int32, one piece of each joined cluster
    offset: np.ndarray  #: (n, d) int32, seams crossed from the root to the piece
    windings: np.ndarray  #: (k, d) int, closed paths around the cell, as numbers of seams crossed
    winding_roots: np.ndarray  #: (k,) int, root of the cluster of each winding


def unwind(first: np.ndarray, second: np.ndarray, jump: np.ndarray, count: int) -> Unwound:
    """Join `count` pieces across seams by a search along the links between them.

    The links (m,) join two pieces each; `jump` (m, d) is the distance, in cells, of the copy of the
    second one that touches the first. There are d seams.
    """
    neighbours: dict[int, list[tuple[int, tuple[int, ...]]]] = {}
    links = np.unique(np.column_stack([first, second, jump]), axis=0)
    for a, b, *step in links.tolist():
        neighbours.setdefault(a, []).append((b, tuple(step)))
        neighbours.setdefault(b, []).append((a, tuple(-x for x in step)))
    d = jump.shape[1]
    root, offset = np.arange(count, dtype=np.int32), np.zeros((count, d), dtype=np.int32)
    placed: dict[int, tuple[int, ...]] = {}
    windings: set[tuple[int, ...]] = set()
    for start in neighbours:
        if start in placed:
            continue
        placed[start] = (0,) * d
        todo = [start]
        while todo:
            piece = todo.pop()
            for neighbour, step in neighbours[piece]:
                reached = tuple(map(add, placed[piece], step))
                if neighbour not in placed:
                    placed[neighbour] = reached
                    root[neighbour], offset[neighbour] = start, reached
                    todo.append(neighbour)
                elif placed[neighbour] != reached:
                    windings.add((start, *map(sub, reached, placed[neighbour])))
    table = np.array(sorted(windings), dtype=int).reshape(-1, 1 + d)
    return Unwound(root, offset, table[:, 1:], table[:, 0])


def winds(mask: np.ndarray, connectivity: str, axis: int) -> bool:
    """Whether a closed path inside the mask goes around the periodic cell along an axis.

    The axis is 0 along the flow or 1 around the seal. For the connectivity see `clusters.label`.
    """
    return bool(_windings(mask, connectivity)[:, axis].any())


def _windings(mask: np.ndarray, connectivity: str) -> np.ndarray:
    """Closed paths inside the mask around the periodic cell, (k, 2), as of `Unwound`."""
    labels, count = clusters.label(mask, connectivity)
    links = clusters.seam_links(labels, connectivity, (True, True))
    return unwind(links.first, links.second, links.shift, count + 1).windings


def periodic_sites(gap: GridField, representation: str) -> np.ndarray:
    """Gap (nx, ny) [m] at the sites of a cell periodic both ways; every point is one site."""
    require_known(OPEN_CONNECTIVITY, representation, "representation")
    require_grid_field(gap, "gap")
    if gap.periodic:
        return gap.values
    values = gap.values
    repeats = np.array_equal(values[0], values[-1]) and np.array_equal(values[:, 0], values[:, -1])
    if representation == "linear" and repeats and min(values.shape) > 1:
        return values[:-1, :-1]
    raise InvalidInput(
        "a conductivity tensor needs a gap that is periodic in both directions: set periodic on it "
        "or repeat the first row and column of a linear gap at its end"
    )


def widest_winding(gap: GridField, representation: str, axis: int) -> float:
    """Tightest gap [m] of the widest closed path around the cell along an axis; 0 if there is none.

    It is the largest h at which the sites with g >= h wind around the cell.
    """
    sites = periodic_sites(gap, representation)
    connectivity = OPEN_CONNECTIVITY[representation]
    return highest_spanning(sites[sites > 0], lambda h: winds(sites >= h, connectivity, axis))


def widest_both_ways(gap: GridField, representation: str) -> float:
    """Tightest gap [m] of the widest closed paths in two directions; 0 if there is one at most.

    A path that goes around the cell along both axes, such as an oblique channel, is only one.
    """
    sites = periodic_sites(gap, representation)
    connectivity = OPEN_CONNECTIVITY[representation]

    def both(h: float) -> bool:
        windings = _windings(sites >= h, connectivity)
        return len(windings) > 1 and bool(np.linalg.matrix_rank(windings) == 2)

    return highest_spanning(sites[sites > 0], both)
