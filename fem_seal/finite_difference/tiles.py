"""Square tiles of the stencil's pixels: the links between the nodes on their rims.

The inner nodes of many small blocks are eliminated at a time, up to whole tiles.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from fem_seal.finite_difference.star_mesh import star_mesh, star_mesh_in_step
from fem_seal.finite_difference.stencil import Stencil

# Pixels along the side of a tile, a power of two.
TILE = 32
# Blocks with up to this many inner nodes are eliminated by `star_mesh_in_step`.
IN_STEP = 7
# Number of floats of the blocks eliminated together: they must fit into the processor's cache.
WORKING_SET = 2**19
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
    return Pixels(x, y, stencil.periodic)


def tile_links(pixels: Pixels, rows: tuple[int, int], columns: tuple[int, int]) -> np.ndarray:
    """Links (rows, columns, N, N) between the rim nodes of each tile, its inner nodes eliminated.

    A rectangle of tiles is given by the first tile and the last tile + 1 along each axis. A tile
    has N = 4 TILE rim nodes in the order of `rim`.
    """
    blocks = _pixel_links(pixels, rows, columns)
    size = (1, 1)
    while size[1] < TILE:
        blocks, size = _merge_in_step(blocks, size, 0), (2 * size[0], size[1])
        blocks, size = _merge_in_step(blocks, size, 1), (size[0], 2 * size[1])
    counts = rows[1] - rows[0], columns[1] - columns[0]
    return np.moveaxis(blocks, 2, 0).reshape(*counts, *blocks.shape[:2])


def _pixel_links(pixels: Pixels, rows: tuple[int, int], columns: tuple[int, int]) -> np.ndarray:
    """Links (4, 4, pixels), in the order of `_halves_first`, of each pixel.

    A pixel has its two lower edges; in the last row and column the upper ones too.
    """
    (i0, i1), (j0, j1) = np.multiply(rows, TILE), np.multiply(columns, TILE)
    links = np.zeros((4, 4, i1 - i0, j1 - j0))
    corner = {node: k for k, node in enumerate(rim(1, 1))}

    def add(pixel: tuple, a: tuple[int, int], b: tuple[int, int], values: np.ndarray) -> None:
        """Link two corners of some pixels, both ways."""
        links[(corner[a], corner[b], *pixel)] = values
        links[(corner[b], corner[a], *pixel)] = values

    everywhere = (slice(None), slice(None))
    add(everywhere, (0, 0), (1, 0), pixels.x[i0:i1, j0:j1])
    add(everywhere, (0, 0), (0, 1), pixels.y[i0:i1, j0:j1])
    if j1 == pixels.y.shape[1]:
        add((slice(None), -1), (0, 1), (1, 1), pixels.x[i0:i1, j1])
    if i1 == pixels.x.shape[0]:
        add((-1, slice(None)), (1, 0), (1, 1), pixels.y[i1, j0:j1])
    return _halves_first(links)


def _halves_first(links: np.ndarray) -> np.ndarray:
    """Order pixels (N, N, nx, ny) as (N, N, pixels) with neighbours half the list apart.

    Every merge joins the first half of the list to the second. The highest bit of the index in the
    list is therefore the lowest bit of the row number; the next one is the lowest bit of the column
    number, and so on. The number of the tile comes last.
    """
    halvings = TILE.bit_length() - 1
    nodes, (nx, ny) = links.shape[0], links.shape[2:]
    bits = links.reshape(nodes, nodes, nx // TILE, *[2] * halvings, ny // TILE, *[2] * halvings)
    last_x, last_y = 2 + halvings, 3 + 2 * halvings
    lowest_first = [axis for k in range(halvings) for axis in (last_x - k, last_y - k)]
    order = (0, 1, *lowest_first, 2, 3 + halvings)
    return bits.transpose(order).reshape(nodes, nodes, nx * ny)


def _merge_in_step(blocks: np.ndarray, size: tuple[int, int], axis: int) -> np.ndarray:
    """Join the first half of the blocks to the second and eliminate the nodes between them.

    `blocks` (N, N, batch) become (N', N', batch / 2): links between the rim nodes. Blocks of a size
    in pixels adjoin along an axis.
    """
    first, second, total, inner = _merge_plan(size, axis)
    half = blocks.shape[2] // 2
    one_by_one = inner <= IN_STEP
    outer = total - inner
    merged = np.empty((outer, outer, half) if one_by_one else (half, outer, outer))
    step = max(1, WORKING_SET // total**2)
    for start in range(0, half, step):
        stop = min(start + step, half)
        shape = (total, total, stop - start) if one_by_one else (stop - start, total, total)
        links = np.zeros(shape)
        by_node = links if one_by_one else np.moveaxis(links, 0, 2)
        for runs, shift in ((first, 0), (second, half)):
            part = blocks[:, :, start + shift : stop + shift]
            for a, to_a in runs:
                for b, to_b in runs:
                    by_node[to_a, to_b] += part[a, b]
        if one_by_one:
            merged[:, :, start:stop] = star_mesh_in_step(links, inner)
        else:
            merged[start:stop] = star_mesh(links, inner)
    return merged if one_by_one else np.moveaxis(merged, 0, 2)


_Run = tuple[slice, slice]


@cache
def _merge_plan(
    size: tuple[int, int], axis: int
) -> tuple[tuple[_Run, ...], tuple[_Run, ...], int, int]:
    """Order of the nodes of two joined blocks: inner nodes first, then the rim.

    For each block the runs of consecutive rim nodes: its nodes and their places in the order. Then
    the number of nodes of the joined blocks, and of inner nodes among them.
    """
    step = (size[0], 0) if axis == 0 else (0, size[1])
    outer = rim(size[0] + step[0], size[1] + step[1])
    first = rim(*size)
    second = [(i + step[0], j + step[1]) for i, j in first]
    inner = sorted((set(first) | set(second)) - set(outer))
    place = {node: k for k, node in enumerate((*inner, *outer))}
    first_runs, second_runs = (_runs([place[node] for node in part]) for part in (first, second))
    return first_runs, second_runs, len(place), len(inner)


def _runs(places: list[int]) -> tuple[_Run, ...]:
    """Runs of consecutive places: (slice of the list, slice of the places) for each run."""
    cuts = [k for k in range(1, len(places)) if places[k] != places[k - 1] + 1]
    ends = zip([0, *cuts], [*cuts, len(places)], strict=True)
    return tuple((slice(a, b), slice(places[a], places[a] + b - a)) for a, b in ends)


@cache
def rim(nx: int, ny: int) -> tuple[tuple[int, int], ...]:
    """Nodes (i, j) on the rim of a block of nx × ny pixels, one side after the other."""
    sides = (
        [(i, j) for i in (0, nx) for j in range(ny + 1)],
        [(i, j) for j in (0, ny) for i in range(1, nx)],
    )
    return tuple(node for side in sides for node in side)
