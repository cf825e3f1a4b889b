"""The network cut into square tiles of pixels, all brought down to their rim in step."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from fem_seal.finite_difference.star_mesh import star_mesh
from fem_seal.finite_difference.stencil import Network

# Pixels along the side of a tile, a power of two.
TILE = 32
# Links that stand for "the same point": relative to the largest, far below rounding.
SHORT_CIRCUIT = 1e20


@dataclass(frozen=True, eq=False)
class Pixels:
    """A network on whole tiles of pixels, each link standing on one edge.

    x : (tiles TILE, ny + 1), y : (nx + 1, ny) conductances of the edges along x and y
    seam : whether the first and the last column of nodes are the same
    """

    x: np.ndarray
    y: np.ndarray
    seam: bool

    @property
    def tiles(self) -> tuple[int, int]:
        """Number of tiles along each axis."""
        return self.x.shape[0] // TILE, self.y.shape[1] // TILE


def whole_tiles(network: Network, largest: float) -> Pixels:
    """Scale the links to at most 1 and pad the grid to whole tiles.

    The outlet, and the seam of periodic sides, are carried to the padded edge by short circuits.
    """
    x, y = network.x / largest, network.y / largest
    if network.periodic:
        x = np.pad(x, ((0, 0), (0, 1)))
    pad_x = -x.shape[0] % TILE
    pad_y = -y.shape[1] % TILE if y.shape[1] else TILE
    across = SHORT_CIRCUIT if network.periodic else 0.0
    x = np.pad(x, ((0, pad_x), (0, 0)), constant_values=SHORT_CIRCUIT)
    x = np.pad(x, ((0, 0), (0, pad_y)))
    y = np.pad(y, ((0, pad_x), (0, 0)))
    y = np.pad(y, ((0, 0), (0, pad_y)), constant_values=across)
    return Pixels(x, y, network.periodic)


def tile_links(pixels: Pixels, rows: tuple[int, int], columns: tuple[int, int]) -> np.ndarray:
    """Links between the rim nodes of each tile, all tiles in step.

    Returns
    -------
    (rows, columns, N, N), N = 4 TILE
    """
    blocks = _pixel_links(pixels, rows, columns)
    size = [1, 1]
    while size[0] < TILE:
        for axis in (0, 1):
            blocks = _merge_in_step(blocks, tuple(size), axis)
            size[axis] *= 2
    return blocks


def _pixel_links(pixels: Pixels, rows: tuple[int, int], columns: tuple[int, int]) -> np.ndarray:
    """Links of each pixel: its two lower edges, and the upper ones on the last row and column."""
    (i0, i1), (j0, j1) = np.multiply(rows, TILE), np.multiply(columns, TILE)
    links = np.zeros((i1 - i0, j1 - j0, 4, 4))
    corner = {node: k for k, node in enumerate(rim(1, 1))}

    def add(pixel: tuple, a: tuple[int, int], b: tuple[int, int], values: np.ndarray) -> None:
        links[(*pixel, corner[a], corner[b])] = values
        links[(*pixel, corner[b], corner[a])] = values

    everywhere = (slice(None), slice(None))
    add(everywhere, (0, 0), (1, 0), pixels.x[i0:i1, j0:j1])
    add(everywhere, (0, 0), (0, 1), pixels.y[i0:i1, j0:j1])
    if j1 == pixels.y.shape[1]:
        add((slice(None), -1), (0, 1), (1, 1), pixels.x[i0:i1, j1])
    if i1 == pixels.x.shape[0]:
        add((-1, slice(None)), (1, 0), (1, 1), pixels.y[i1, j0:j1])
    return links


def _merge_in_step(blocks: np.ndarray, size: tuple[int, int], axis: int) -> np.ndarray:
    """Join neighbouring blocks along an axis and eliminate what becomes inner.

    Parameters
    ----------
    blocks : (bx, by, N, N) links between rim nodes of blocks of `size` pixels
    """
    first, second, total, inner = _merge_plan(size, axis)
    a, b = (blocks[0::2], blocks[1::2]) if axis == 0 else (blocks[:, 0::2], blocks[:, 1::2])
    links = np.zeros((a.shape[0] * a.shape[1], total, total))
    for part, place in ((a, first), (b, second)):
        links[:, place[:, None], place] += part.reshape(-1, *part.shape[2:])
    left = star_mesh(links, inner)
    return np.ascontiguousarray(left).reshape(*a.shape[:2], total - inner, total - inner)


@cache
def _merge_plan(size: tuple[int, int], axis: int) -> tuple[np.ndarray, np.ndarray, int, int]:
    """Places of the two blocks' rim nodes in the joint list, its length, and how many are inner."""
    step = (size[0], 0) if axis == 0 else (0, size[1])
    outer = rim(size[0] + step[0], size[1] + step[1])
    first = rim(*size)
    second = [(i + step[0], j + step[1]) for i, j in first]
    inner = sorted((set(first) | set(second)) - set(outer))
    place = {node: k for k, node in enumerate(inner + outer)}
    places = [np.array([place[node] for node in part]) for part in (first, second)]
    return places[0], places[1], len(place), len(inner)


def rim(nx: int, ny: int) -> list[tuple[int, int]]:
    """Nodes on the rim of a block of nx by ny pixels, in order."""
    return [(i, j) for i in range(nx + 1) for j in range(ny + 1) if i in (0, nx) or j in (0, ny)]
