"""Euler characteristic of a mask: pieces minus holes."""

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.topology.lattice import choose


def euler_characteristic(
    mask: np.ndarray, connectivity: str, periodic: tuple[bool, bool] = (False, False)
) -> int:
    """Vertices minus edges plus faces of the complex that a mask spans.

    On a plane domain it equals the number of connected pieces minus the number of their holes
    (K. R. Mecke, Lect. Notes Phys. 554, 111 (2000)); "Swiss cheese" is negative.

    Parameters
    ----------
    mask : (nx, ny) bool
    connectivity : "4", "8" or "triangulation", see `clusters.label`
        "8" takes the union of closed pixels, "4" and "triangulation" the points of the mask with
        the edges, full pixels and triangles between them.
    periodic : along each axis, whether the last sample neighbours the first

    Returns
    -------
    int

    Raises
    ------
    InvalidInput
        For an unknown connectivity or a mask that is not two-dimensional.
    """
    count = choose(_COUNTS, connectivity, "connectivity")
    mask = np.asarray(mask, dtype=bool)
    if mask.ndim != 2:
        raise InvalidInput(f"a mask must be two-dimensional, got shape {mask.shape}")
    for axis, wraps in enumerate(periodic):
        mask = np.concatenate([mask, mask.take([0], axis) if wraps else _void(mask, axis)], axis)
    return count(mask)


def _void(mask: np.ndarray, axis: int) -> np.ndarray:
    return np.zeros_like(mask.take([0], axis))


def _count(*ends: np.ndarray) -> int:
    """Count the places where all the given masks hold."""
    return int(np.count_nonzero(np.logical_and.reduce(ends)))


def _of_points(mask: np.ndarray) -> int:
    """Points, 4-neighbour edges, full pixels; the last row and column only close these."""
    a, b, c, d = _corners(mask)
    return _count(a) - _count(a, b) - _count(a, c) + _count(a, b, c, d)


def _of_closed_pixels(mask: np.ndarray) -> int:
    """Nerve of the closed pixels: a simplex for every set of them that shares a corner."""
    a, b, c, d = _corners(mask)
    pairs = _count(a, b) + _count(a, c) + _count(a, d) + _count(b, c)
    triples = _count(a, b, c) + _count(a, b, d) + _count(a, c, d) + _count(b, c, d)
    return _count(a) - pairs + triples - _count(a, b, c, d)


def _of_triangulation(mask: np.ndarray) -> int:
    """Vertices, edges and triangles of the alternating triangulation."""
    a, b, c, d = _corners(mask)
    even = np.add.outer(np.arange(a.shape[0]), np.arange(a.shape[1])) % 2 == 0
    edges = _count(a, b) + _count(a, c) + _count(a, d, even) + _count(b, c, ~even)
    rising = _count(a, b, d, even) + _count(a, c, d, even)
    falling = _count(a, b, c, ~even) + _count(b, c, d, ~even)
    return _count(a) - edges + rising + falling


def _corners(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return samples (i, j), (i+1, j), (i, j+1), (i+1, j+1) of every pixel."""
    return mask[:-1, :-1], mask[1:, :-1], mask[:-1, 1:], mask[1:, 1:]


_COUNTS = {"4": _of_points, "8": _of_closed_pixels, "triangulation": _of_triangulation}
