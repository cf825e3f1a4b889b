"""Connected clusters of a mask, also across periodic seams and on the pixel triangulation."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fem_seal.graphs import components
from fem_seal.grid import diagonal_rises


@dataclass(frozen=True, eq=False)
class SeamLinks:
    """Pairs of clusters that neighbour each other across a periodic seam."""

    first: np.ndarray  #: (m,) int, label of one cluster, > 0
    second: np.ndarray  #: (m,) int, label of the other, > 0
    #: (m, 2) int, seams crossed along each axis on the way from `first` to `second`: -1, 0 or 1
    shift: np.ndarray


def label(
    mask: np.ndarray, connectivity: str, periodic: tuple[bool, bool] = (False, False)
) -> tuple[np.ndarray, int]:
    """Number the connected clusters of a mask: labels 1 to count (0 outside), and count.

    Parameters
    ----------
    connectivity
        "4", "8" or "triangulation": the triangulation has the 4 neighbours and the diagonals of the
        pixels (`grid.diagonal_rises`).
    periodic
        Along each axis, whether the last sample neighbours the first.
    """
    labels, number, count = _pieces(mask, connectivity, periodic)
    return number[labels], count


def joins_ends(
    mask: np.ndarray, connectivity: str, periodic: tuple[bool, bool] = (False, False)
) -> bool:
    """Whether a cluster of the mask has sites in the first and in the last row; see `label`."""
    labels, number, _ = _pieces(mask, connectivity, periodic)
    first, last = (np.unique(number[row[row > 0]]) for row in (labels[0], labels[-1]))
    return bool(np.intersect1d(first, last, assume_unique=True).size)


def _pieces(
    mask: np.ndarray, connectivity: str, periodic: tuple[bool, bool]
) -> tuple[np.ndarray, np.ndarray, int]:
    """Label the pieces of the clusters that neither diagonals nor seams join.

    Returns the labels (nx, ny), 0 outside the mask; the cluster of each piece, 0 for label 0; and
    the number of clusters.
    """
    from scipy import ndimage

    structure = np.ones((3, 3)) if connectivity == "8" else None
    labels, count = ndimage.label(mask, structure=structure)
    seams = seam_links(labels, connectivity, periodic)
    joins = [(seams.first, seams.second)]
    if connectivity == "triangulation":
        joins += _diagonals(labels)
    return labels, *_merged(labels.dtype, count, joins)


def largest(labels: np.ndarray, count: int) -> np.ndarray:
    """Mask of the largest cluster, the first one if several are equally large; empty if none."""
    sites = np.bincount(labels.ravel(), minlength=count + 1)
    sites[0] = 0  # outside the mask
    return (labels == np.argmax(sites)) & (labels > 0)


def on_all_lines(labels: np.ndarray, count: int, *lines: np.ndarray) -> np.ndarray:
    """Mask of the clusters that have a site on each of several lines; lines hold labels."""
    touches_all = np.ones(count + 1, dtype=bool)
    for line in lines:
        touches = np.zeros(count + 1, dtype=bool)
        touches[line] = True
        touches_all &= touches
    touches_all[0] = False
    return touches_all[labels]


def _diagonals(labels: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Labels at the two ends of the diagonals that join clusters of the triangulation.

    Where one of the other two corners of the pixel is inside as well, it has joined them already.
    """
    inside = labels > 0
    for (i, j), rises in np.ndenumerate(diagonal_rises(*np.indices((2, 2)))):
        left, right = slice(i, -1, 2), slice(i + 1, None, 2)
        below, above = slice(j, -1, 2), slice(j + 1, None, 2)
        rising, falling = ((left, below), (right, above)), ((right, below), (left, above))
        ends, others = (rising, falling) if rises else (falling, rising)
        joins = inside[ends[0]] & inside[ends[1]] & ~(inside[others[0]] | inside[others[1]])
        yield labels[ends[0]][joins], labels[ends[1]][joins]


def _merged(
    dtype: np.dtype, count: int, joins: list[tuple[np.ndarray, np.ndarray]]
) -> tuple[np.ndarray, int]:
    """Number (count + 1,) of the cluster of each piece, from pairs of joined pieces; 0 stays 0."""
    pairs = np.concatenate([np.stack(ends, axis=1) for ends in joins])
    if not len(pairs):
        return np.arange(count + 1, dtype=dtype), count
    merged = components(pairs - 1, count)
    return np.append(0, merged + 1).astype(dtype), int(merged.max()) + 1


def seam_links(labels: np.ndarray, connectivity: str, periodic: tuple[bool, bool]) -> SeamLinks:
    """Pairs of clusters that neighbour each other across the periodic seams; see `label`.

    The labels are those without seams. Links of a cluster to itself are included: such a cluster
    winds around the cell.
    """
    shape, (nx, ny) = np.array(labels.shape), labels.shape
    # Pixels (i, j) of the last row and column. Row nx stands for row 0 across the seam.
    i = np.concatenate([np.full(ny, nx - 1), np.arange(nx - 1)])
    j = np.concatenate([np.arange(ny), np.full(nx - 1, ny - 1)])
    corner, rises, every = np.stack([i, j], axis=1), diagonal_rises(i, j), np.ones(i.size, bool)
    rising, falling = {
        "4": (~every, ~every),
        "8": (every, every),
        "triangulation": (rises, ~rises),
    }[connectivity]
    edges = (
        (every, (0, 0), (1, 0)),
        (every, (0, 0), (0, 1)),
        (rising, (0, 0), (1, 1)),
        (falling, (1, 0), (0, 1)),
    )
    start = np.concatenate([corner[pixels] + a for pixels, a, _ in edges])
    stop = np.concatenate([corner[pixels] + b for pixels, _, b in edges])
    wraps = (start == shape) | (stop == shape)
    shift = (stop == shape).astype(int) - (start == shape)
    keep = wraps.any(axis=1) & shift.any(axis=1) & (~wraps | np.array(periodic)).all(axis=1)
    first = labels[tuple((start[keep] % shape).T)]
    second = labels[tuple((stop[keep] % shape).T)]
    in_mask = (first > 0) & (second > 0)
    return SeamLinks(first[in_mask], second[in_mask], shift[keep][in_mask])
