"""Conductance of the stencil between inlet and outlet by elimination of its nodes, at any contrast.

Eliminating node a replaces its links c_ab by links between its neighbours,

    c_bd += c_ab c_ad / Σ_e c_ae    for all neighbours b, d of a    (`star_mesh`),

until one link joins inlet and outlet: the conductance. Iterations with incomplete factors or Jacobi
scaling fail on gaps next to closing, where conductances differ by 1e15 and more; this elimination
keeps the relative accuracy of every link. The nodes are ordered by nested dissection (A. George,
SIAM J. Numer. Anal. 10, 345 (1973)): about 10 n³ multiplications for n × n open nodes, nearly all
in matrix products, and the memory of a few n × n matrices.

The stencil is cut into square tiles of pixels (`tiles`), which are joined, two rectangles of them
at a time.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_seal.finite_difference.star_mesh import star_mesh
from fem_seal.finite_difference.stencil import Stencil
from fem_seal.finite_difference.tiles import ON_RIM, TILE, Pixels, tile_links, whole_tiles

# Most tiles along the side of a rectangle that is reduced in one batch; limits its memory.
CHUNK = 8
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
    i, j = (np.argwhere(ON_RIM) + TILE * np.array([row, column])).T
    numbers = i * pixels.x.shape[1] + j
    numbers[i == 0] = INLET_NODE
    numbers[i == pixels.x.shape[0]] = OUTLET_NODE
    return _contract(numbers, links)
