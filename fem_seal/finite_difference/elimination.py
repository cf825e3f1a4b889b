"""Conductance of the grid between inlet and outlet by eliminating its nodes, at any contrast.

Iterations with incomplete factors or Jacobi scaling fail on gaps near percolation, where links
differ by 1e15 and more; star-mesh elimination keeps the relative accuracy of every link. The order
is nested dissection (A. George, SIAM J. Numer. Anal. 10, 345 (1973)): some 10 n^3 multiplications
for n x n open nodes, nearly all of them in matrix products, and memory for a few n x n matrices.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_seal.finite_difference.star_mesh import star_mesh
from fem_seal.finite_difference.stencil import Network
from fem_seal.finite_difference.tiles import TILE, Pixels, rim, tile_links, whole_tiles

# Tiles along the side of a chunk, which bounds the memory of the batch.
CHUNK = 4
# Node numbers of the two ends, whatever their position.
INLET, OUTLET = -2, -1


@dataclass(frozen=True, eq=False)
class Piece:
    """What is left of a part of the network: its outer nodes and the links between them.

    nodes : (N,) int, sorted, without repetition; INLET and OUTLET come first
    links : (N, N) float; the diagonal has no meaning
    """

    nodes: np.ndarray
    links: np.ndarray


def conductance(network: Network) -> float:
    """Conductance between inlet and outlet, to a relative accuracy of rounding.

    Parameters
    ----------
    network : links of the grid, >= 0

    Returns
    -------
    float, in the unit of the links; exactly 0 if no chain of links joins the ends.
    """
    largest = max(network.x.max(initial=0.0), network.y.max(initial=0.0))
    if largest == 0:
        return 0.0
    pixels = whole_tiles(network, largest)
    tiles_x, tiles_y = pixels.tiles
    piece = _dissect(pixels, (0, tiles_x), (0, tiles_y))
    if pixels.seam:
        columns = pixels.x.shape[1]
        at_seam = (piece.nodes >= 0) & (piece.nodes % columns == columns - 1)
        names = np.where(at_seam, piece.nodes - columns + 1, piece.nodes)
        piece = _contract(names, piece.links)
    # Joined to nothing, it keeps its two ends alone.
    nothing = Piece(piece.nodes[:0], piece.links[:0, :0])
    piece = _join(piece, nothing, lambda nodes: nodes < 0)
    return float(piece.links[0, 1] * largest)


def _dissect(
    pixels: Pixels, rows: tuple[int, int], columns: tuple[int, int], tiles: np.ndarray | None = None
) -> Piece:
    """Eliminate all inner nodes of a rectangle of tiles, halves first, separator last.

    Parameters
    ----------
    pixels : the network
    rows, columns : first and last + 1 tile along each axis
    tiles : (rows, columns, N, N) links of the tiles, once the rectangle is small enough
    """
    extent = rows[1] - rows[0], columns[1] - columns[0]
    if tiles is None and max(extent) <= CHUNK:
        tiles = tile_links(pixels, rows, columns)
    if extent == (1, 1):
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
    """Put two pieces side by side, where links between the same nodes add up.

    Parameters
    ----------
    outer : tells of nodes (N,) which are to stay (N,) bool; the others are eliminated
    """
    nodes = np.union1d(a.nodes, b.nodes)
    kept = outer(nodes)
    place = np.empty(nodes.size, dtype=int)
    place[np.argsort(kept, kind="stable")] = np.arange(nodes.size)
    links = np.zeros((nodes.size, nodes.size))
    for piece in (a, b):
        own = place[np.searchsorted(nodes, piece.nodes)]
        links[np.ix_(own, own)] += piece.links
    left = star_mesh(links[None], int(np.count_nonzero(~kept)))
    return _linked(nodes[kept], left[0])


def _contract(nodes: np.ndarray, links: np.ndarray) -> Piece:
    """Make a piece of nodes (N,) in any order; those of one name become one."""
    order = np.argsort(nodes, kind="stable")
    names, first = np.unique(nodes[order], return_index=True)
    rows = np.add.reduceat(links[np.ix_(order, order)], first, axis=0)
    return _linked(names, np.add.reduceat(rows, first, axis=1))


def _linked(nodes: np.ndarray, links: np.ndarray) -> Piece:
    """Make a piece without the nodes that have no link left, contact and dried-up pockets."""
    np.fill_diagonal(links, 0.0)
    alive = links.any(axis=1) | (nodes < 0)
    return Piece(nodes[alive], links[np.ix_(alive, alive)])


def _on_rim(
    pixels: Pixels, rows: tuple[int, int], columns: tuple[int, int], nodes: np.ndarray
) -> np.ndarray:
    """Which nodes of a rectangle of tiles have links outside it, or are an end."""
    i, j = np.divmod(nodes, pixels.x.shape[1])
    last = pixels.tiles[1]
    left = (j == columns[0] * TILE) & (columns[0] > 0 or pixels.seam)
    right = (j == columns[1] * TILE) & (columns[1] < last or pixels.seam)
    return (nodes < 0) | (i == rows[0] * TILE) | (i == rows[1] * TILE) | left | right


def _tile_piece(pixels: Pixels, row: int, column: int, links: np.ndarray) -> Piece:
    """Name the nodes of one tile; those at the ends become one each."""
    i, j = np.array(rim(TILE, TILE)).T
    i, j = i + row * TILE, j + column * TILE
    names = i * pixels.x.shape[1] + j
    names[i == 0] = INLET
    names[i == pixels.x.shape[0]] = OUTLET
    return _contract(names, links)
