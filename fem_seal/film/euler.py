"""Euler characteristic χ = vertices - edges + faces of a mask: its pieces minus their holes."""

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.registry import choose


def euler_characteristic(
    mask: np.ndarray, connectivity: str, periodic: tuple[bool, bool] = (False, False)
) -> int:
    """Vertices minus edges plus faces of the cell complex that a mask spans.

    In the plane it equals the number of connected pieces minus the number of their holes
    (K. R. Mecke, Lect. Notes Phys. 554, 111 (2000)): negative for a "Swiss cheese".

    Parameters
    ----------
    mask : (nx, ny) bool
    connectivity : "4", "8" or "triangulation": see `clusters.label`, for "8" the complex is the
        union of the closed pixels of the mask; for "4" and "triangulation" it consists of the
        points of the mask, the edges between them, and the pixels or triangles whose corners are
        all in the mask
    periodic : along each axis, whether the last sample neighbours the first
    """
    count = choose(_COUNTS, connectivity, "connectivity")
    mask = np.asarray(mask, dtype=bool)
    if mask.ndim != 2:
        raise InvalidInput(f"a mask must be two-dimensional, got shape {mask.shape}")
    for axis, wraps in enumerate(periodic):
        first = mask.take([0], axis)
        mask = np.concatenate([mask, first if wraps else np.zeros_like(first)], axis)
    return count(mask)


def _count(*masks: np.ndarray) -> int:
    """Count the places where all masks are true."""
    return int(np.count_nonzero(np.logical_and.reduce(masks)))


def _of_points(mask: np.ndarray) -> int:
    """Points minus edges between 4-neighbours plus full pixels."""
    a, b, c, d = _corners(mask)
    return _count(a) - _count(a, b) - _count(a, c) + _count(a, b, c, d)


def _of_closed_pixels(mask: np.ndarray) -> int:
    """Euler characteristic of the nerve of the closed pixels.

    The nerve has one simplex for every set of pixels that share a corner, so that χ alternates
    over sets of one, two, three and four pixels; by the nerve theorem it is that of their union.
    """
    a, b, c, d = _corners(mask)
    pairs = _count(a, b) + _count(a, c) + _count(a, d) + _count(b, c)
    triples = _count(a, b, c) + _count(a, b, d) + _count(a, c, d) + _count(b, c, d)
    return _count(a) - pairs + triples - _count(a, b, c, d)


def _of_triangulation(mask: np.ndarray) -> int:
    """Vertices minus edges plus triangles of the alternating triangulation."""
    a, b, c, d = _corners(mask)
    even = np.add.outer(np.arange(a.shape[0]), np.arange(a.shape[1])) % 2 == 0
    edges = _count(a, b) + _count(a, c) + _count(a, d, even) + _count(b, c, ~even)
    rising = _count(a, b, d, even) + _count(a, c, d, even)
    falling = _count(a, b, c, ~even) + _count(b, c, d, ~even)
    return _count(a) - edges + rising + falling


def _corners(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Corners (i, j), (i+1, j), (i, j+1), (i+1, j+1) of every pixel, each an array of pixels."""
    return mask[:-1, :-1], mask[1:, :-1], mask[:-1, 1:], mask[1:, 1:]


_COUNTS = {"4": _of_points, "8": _of_closed_pixels, "triangulation": _of_triangulation}
