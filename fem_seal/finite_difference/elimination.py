"""Conductance of the stencil between inlet and outlet by elimination of its nodes, at any contrast.

Eliminating node a replaces its links c_ab by links between its neighbours,

    c_bd += c_ab c_ad / Σ_e c_ae    for all neighbours b, d of a    (`star_mesh`),

until one link joins inlet and outlet: the conductance. Iterations with incomplete factors or Jacobi
scaling fail on gaps near percolation, where conductances differ by 1e15 and more; this elimination
keeps the relative accuracy of every link. The nodes are ordered by nested dissection (A. George,
SIAM J. Numer. Anal. 10, 345 (1973)): about 10 n³ multiplications for n × n open nodes, nearly all
in matrix products, and the memory of a few n × n matrices.

The stencil is cut into square tiles of pixels. The inner nodes of many small blocks are eliminated
at a time, up to whole tiles; the tiles are then joined, two rectangles of them at a time.
"""

from collections.abc import Callable
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
    levels = TILE.bit_length() - 1
    nodes, (nx, ny) = links.shape[0], links.shape[2:]
    bits = links.reshape(nodes, nodes, nx // TILE, *[2] * levels, ny // TILE, *[2] * levels)
    last_x, last_y = 2 + levels, 3 + 2 * levels
    lowest_first = [axis for k in range(levels) for axis in (last_x - k, last_y - k)]
    order = (0, 1, *lowest_first, 2, 3 + levels)
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
    place = {node: k for k, node in enumerate(inner + outer)}
    first_runs, second_runs = (_runs([place[node] for node in part]) for part in (first, second))
    return first_runs, second_runs, len(place), len(inner)


def _runs(places: list[int]) -> tuple[_Run, ...]:
    """Runs of consecutive places: (slice of the list, slice of the places) for each run."""
    cuts = [k for k in range(1, len(places)) if places[k] != places[k - 1] + 1]
    ends = zip([0, *cuts], [*cuts, len(places)], strict=True)
    return tuple((slice(a, b), slice(places[a], places[a] + b - a)) for a, b in ends)


@cache
def rim(nx: int, ny: int) -> list[tuple[int, int]]:
    """Nodes (i, j) on the rim of a block of nx × ny pixels, one side after the other."""
    sides = (
        [(i, j) for i in (0, nx) for j in range(ny + 1)],
        [(i, j) for j in (0, ny) for i in range(1, nx)],
    )
    return [node for side in sides for node in side]


# Most tiles along the side of a rectangle that is reduced in one batch; limits its memory.
CHUNK = 4
# Numbers of the nodes that stand for the whole inlet and the whole outlet.
INLET_NODE, OUTLET_NODE = -2, -1


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of the stencil after its inner nodes have been eliminated."""

    #: (N,) int, numbers of the outer nodes, sorted, without repetition; INLET_NODE and OUTLET_NODE
    #: come first
    nodes: np.ndarray
    links: np.ndarray  #: (N, N), conductances between them; the diagonal has no meaning


def conductance(stencil: Stencil) -> float:
    """Conductance between inlet and outlet, to a relative accuracy of rounding.

    Exactly 0 if no chain of links joins the ends.
    """
    largest = max(stencil.x.max(initial=0.0), stencil.y.max(initial=0.0))
    if largest == 0:
        return 0.0
    pixels = whole_tiles(stencil, largest)
    tiles_x, tiles_y = pixels.tiles
    piece = _dissect(pixels, (0, tiles_x), (0, tiles_y))
    if pixels.seam:
        columns = pixels.x.shape[1]
        at_seam = (piece.nodes >= 0) & (piece.nodes % columns == columns - 1)
        numbers = np.where(at_seam, piece.nodes - columns + 1, piece.nodes)
        piece = _contract(numbers, piece.links)
    # Joining the piece to an empty one eliminates all nodes but its two ends.
    empty = Piece(piece.nodes[:0], piece.links[:0, :0])
    piece = _join(piece, empty, lambda nodes: nodes < 0)
    return float(piece.links[0, 1] * largest)


def _dissect(
    pixels: Pixels, rows: tuple[int, int], columns: tuple[int, int], tiles: np.ndarray | None = None
) -> Piece:
    """Eliminate the inner nodes of a rectangle of tiles: in each half, then between the halves.

    The rectangle is given by the first tile and the last tile + 1 along each axis. The links (rows,
    columns, N, N) of its tiles are computed when it is at most CHUNK tiles long.
    """
    extent = rows[1] - rows[0], columns[1] - columns[0]
    if tiles is None and max(extent) <= CHUNK:
        tiles = tile_links(pixels, rows, columns)
    if tiles is not None and extent == (1, 1):
        return _tile_piece(pixels, rows[0], columns[0], tiles[0, 0])
    axis = int(extent[1] > extent[0])
    half = extent[axis] // 2
    middle = (rows, columns)[axis][0] + half
    if axis == 0:
        parts = ((rows[0], middle), columns), ((middle, rows[1]), columns)
    else:
        parts = (rows, (columns[0], middle)), (rows, (middle, columns[1]))
    halves = (None, None) if tiles is None else np.split(tiles, [half], axis)
    first, second = (
        _dissect(pixels, *part, of_part) for part, of_part in zip(parts, halves, strict=True)
    )
    return _join(first, second, lambda nodes: _on_rim(pixels, rows, columns, nodes))


def _join(a: Piece, b: Piece, outer: Callable[[np.ndarray], np.ndarray]) -> Piece:
    """Join two pieces and eliminate all but `outer` nodes; links between the same two add up."""
    nodes = np.union1d(a.nodes, b.nodes)
    kept = outer(nodes)
    place = np.empty(nodes.size, dtype=int)
    place[np.argsort(kept, kind="stable")] = np.arange(nodes.size)
    links = np.zeros((nodes.size, nodes.size))
    for piece in (a, b):
        own = place[np.searchsorted(nodes, piece.nodes)]
        links[np.ix_(own, own)] += piece.links
    reduced = star_mesh(links[None], int(np.count_nonzero(~kept)))
    return _without_isolated(nodes[kept], reduced[0])


def _contract(nodes: np.ndarray, links: np.ndarray) -> Piece:
    """Make a piece of nodes (N,) in any order; nodes with the same number become one."""
    order = np.argsort(nodes, kind="stable")
    numbers, first = np.unique(nodes[order], return_index=True)
    rows = np.add.reduceat(links[np.ix_(order, order)], first, axis=0)
    return _without_isolated(numbers, np.add.reduceat(rows, first, axis=1))


def _without_isolated(nodes: np.ndarray, links: np.ndarray) -> Piece:
    """Make a piece without the nodes that have no link: contact, and eliminated pockets."""
    np.fill_diagonal(links, 0.0)
    linked = links.any(axis=1) | (nodes < 0)
    return Piece(nodes[linked], links[np.ix_(linked, linked)])


def _on_rim(
    pixels: Pixels, rows: tuple[int, int], columns: tuple[int, int], nodes: np.ndarray
) -> np.ndarray:
    """(N,) bool: nodes of a rectangle of tiles with links outside it, and inlet and outlet."""
    i, j = np.divmod(nodes, pixels.x.shape[1])
    last = pixels.tiles[1]
    left = (j == columns[0] * TILE) & (columns[0] > 0 or pixels.seam)
    right = (j == columns[1] * TILE) & (columns[1] < last or pixels.seam)
    return (nodes < 0) | (i == rows[0] * TILE) | (i == rows[1] * TILE) | left | right


def _tile_piece(pixels: Pixels, row: int, column: int, links: np.ndarray) -> Piece:
    """Piece of one tile; all its nodes on the inlet become one node, and those on the outlet."""
    i, j = np.array(rim(TILE, TILE)).T
    i, j = i + row * TILE, j + column * TILE
    numbers = i * pixels.x.shape[1] + j
    numbers[i == 0] = INLET_NODE
    numbers[i == pixels.x.shape[0]] = OUTLET_NODE
    return _contract(numbers, links)
