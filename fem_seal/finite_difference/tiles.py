"""Square tiles of the stencil's pixels: the links between the nodes on their rims.

The inner nodes of many tiles are eliminated at a time.
"""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from fem_seal.finite_difference.star_mesh import star_mesh
from fem_seal.finite_difference.stencil import Stencil

TILE = 8  # pixels along the side of a tile
ON_RIM = np.pad(np.zeros((TILE - 1, TILE - 1), dtype=bool), 1, constant_values=True)
# Order in which the nodes of a tile, (TILE + 1, TILE + 1), are eliminated: the rim is left.
ORDER = np.argsort(np.argsort(ON_RIM, axis=None, kind="stable")).reshape(ON_RIM.shape)
# Conductance of a link that makes two nodes one, over the largest of the stencil: its resistance is
# far below rounding.
SHORT_CIRCUIT = 1e20


@dataclass(frozen=True, eq=False)
class Pixels:
    """A stencil of nx × ny pixels, both multiples of TILE, with a link on every edge of a pixel."""

    x: np.ndarray  #: (nx, ny + 1), conductances of the edges along x, relative to the largest
    y: np.ndarray  #: (nx + 1, ny), conductances of the edges along y
    seam: bool  #: whether the first and the last column of nodes are the same

    @property
    def tiles(self) -> tuple[int, int]:
        """Number of tiles along each axis."""
        return self.x.shape[0] // TILE, self.y.shape[1] // TILE


def whole_tiles(stencil: Stencil, largest: float) -> Pixels:
    """Scale the links to at most 1 and pad the grid to whole tiles.

    Links of no resistance join the outlet, and the seam of periodic sides, to the padded boundary.
    """
    x, y = stencil.x / largest, stencil.y / largest
    if stencil.periodic:
        x = np.pad(x, ((0, 0), (0, 1)))
    pad_x = -x.shape[0] % TILE
    pad_y = -y.shape[1] % TILE if y.shape[1] else TILE
    across = SHORT_CIRCUIT if stencil.periodic else 0.0
    x = np.pad(x, ((0, pad_x), (0, 0)), constant_values=SHORT_CIRCUIT)
    x = np.pad(x, ((0, 0), (0, pad_y)))
    y = np.pad(y, ((0, pad_x), (0, 0)))
    y = np.pad(y, ((0, 0), (0, pad_y)), constant_values=across)
    # Two tiles that share an edge have half of it each.
    x[:, TILE:-1:TILE] /= 2
    y[TILE:-1:TILE] /= 2
    return Pixels(x, y, stencil.periodic)


def tile_links(pixels: Pixels, rows: tuple[int, int], columns: tuple[int, int]) -> np.ndarray:
    """Links (rows, columns, N, N) between the rim nodes of each tile, its inner nodes eliminated.

    A rectangle of tiles is given by the first tile and the last tile + 1 along each axis. The N
    nodes are those `ON_RIM`, row by row.
    """
    tiles = slice(*rows), slice(*columns)
    x = sliding_window_view(pixels.x, (TILE, TILE + 1))[::TILE, ::TILE][tiles]
    y = sliding_window_view(pixels.y, (TILE + 1, TILE))[::TILE, ::TILE][tiles]
    links = np.zeros((*x.shape[:2], ORDER.size, ORDER.size))
    for a, b, values in (ORDER[:-1], ORDER[1:], x), (ORDER[:, :-1], ORDER[:, 1:], y):
        links[:, :, a, b] = links[:, :, b, a] = values
    reduced = star_mesh(links.reshape(-1, ORDER.size, ORDER.size), np.count_nonzero(~ON_RIM))
    return reduced.reshape(*x.shape[:2], *reduced.shape[1:])
