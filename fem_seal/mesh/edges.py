"""Edges of triangles and their sides: numbered on the first mesh, then updated by bisection.

A side is an edge seen from one of its cells. Edge e has the sides 2 e and 2 e + 1: the edge of side
s is s >> 1, and its other side is s ^ 1.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.mesh.grouping import parts, stable_order


@dataclass(frozen=True, eq=False)
class Edges:
    """The E edges of C cells."""

    ends: np.ndarray  #: (E, 2) int32, vertices at the ends of each edge
    #: (C, 3) int32, number of the side opposite each corner: 2 e or 2 e + 1 for edge e
    sides: np.ndarray

    @property
    def of_cell(self) -> np.ndarray:
        """(C, 3) int32: the edge opposite each corner."""
        return self.sides >> 1

    def cells(self) -> np.ndarray:
        """(2 E,) int32: the cell of each side, -1 for the outer side of a boundary edge."""
        of_side = np.full(2 * len(self.ends), -1, dtype=np.int32)
        of_side[self.sides] = np.arange(len(self.sides), dtype=np.int32)[:, None]
        return of_side

    def slots(self) -> np.ndarray:
        """(E, 2) int32: both sides of each edge as 3 cell + corner, -1 for an outer side."""
        of_side = np.full(2 * len(self.ends), -1, dtype=np.int32)
        of_side[self.sides.ravel()] = np.arange(self.sides.size, dtype=np.int32)
        return of_side.reshape(-1, 2)


def find_edges(ends: np.ndarray, count: int) -> Edges:
    """Number the edges of triangles, given the vertices at the ends of their sides (C, 3, 2).

    On a seam these are the vertices of the twin at the bottom, so that the two sides of an edge
    have the same vertices.
    """
    low = np.minimum(ends[..., 0], ends[..., 1]).ravel()
    high = np.maximum(ends[..., 0], ends[..., 1]).ravel()
    # Free large arrays after their last use: the coarser mesh still takes memory at this point.
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
    """values[places] in parts, because NumPy converts all indices to 64 bits at once."""
    picked = np.empty(len(places), dtype=values.dtype)
    for part in parts(0, len(places), 1 << 16):
        picked[part] = values[places[part]]
    return picked
