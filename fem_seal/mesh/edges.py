"""Edges of triangles, and the two sides of each: found on the first mesh, then carried along.

A side is an edge seen from one of its cells. Sides 2 e and 2 e + 1 belong to edge e, so that the
edge of a side is half its number, and what is on the other side is one bit away.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.mesh.grouping import parts, stable_order


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of C cells.

    ends : (E, 2) int32, vertices of each edge
    sides : (C, 3) int32, number of the side opposite each corner: 2 e or 2 e + 1 of edge e
    """

    ends: np.ndarray
    sides: np.ndarray

    @property
    def of_cell(self) -> np.ndarray:
        """(C, 3) int32, the edge opposite each corner."""
        return self.sides >> 1

    def cells(self) -> np.ndarray:
        """(2 E,) int32, the cell of each side, -1 of one that lies outside."""
        of_side = np.full(2 * len(self.ends), -1, dtype=np.int32)
        of_side[self.sides] = np.arange(len(self.sides), dtype=np.int32)[:, None]
        return of_side

    def slots(self) -> np.ndarray:
        """(E, 2) int32, the two sides of each edge as 3 cell + corner, -1 for one outside."""
        of_side = np.full(2 * len(self.ends), -1, dtype=np.int32)
        of_side[self.sides.ravel()] = np.arange(self.sides.size, dtype=np.int32)
        return of_side.reshape(-1, 2)


def find_edges(ends: np.ndarray, count: int) -> Edges:
    """Number the edges of triangles.

    Parameters
    ----------
    ends : (C, 3, 2) int, the two vertices of each side of each cell, the same for both cells
    count : number of vertices
    """
    low, high = (some(ends[..., 0], ends[..., 1]).ravel() for some in (np.minimum, np.maximum))
    # Large arrays go as soon as they have been used: while a mesh is made the last one is there.
    del ends
    order = stable_order(high, count)
    order = _picked(order, stable_order(_picked(low, order), count))
    low, high = _picked(low, order), _picked(high, order)
    first = np.ones(len(order), dtype=bool)
    first[1:] = (low[1:] != low[:-1]) | (high[1:] != high[:-1])
    sides = np.empty(len(order), dtype=np.int32)
    sides[order] = 2 * np.cumsum(first, dtype=np.int32) - 1 - first
    return Edges(np.stack([low[first], high[first]], axis=1), sides.reshape(-1, 3))


def _picked(values: np.ndarray, places: np.ndarray) -> np.ndarray:
    """values[places], for which NumPy would first make all the places 64 bits long."""
    found = np.empty(len(places), dtype=values.dtype)
    for part in parts(0, len(places), 1 << 16):
        found[part] = values[places[part]]
    return found
