"""Meshes of arbitrary straight triangles: the counterpart of `nested` for any shape.

Refinement is the newest-vertex bisection of the nested family; it starts with the longest edges. A
gap that is linear on the cells is linear on their halves, and the shape keeps its polygonal
boundary.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.mesh.mesh import Mesh
from fem_seal.mesh.nested import TooFine

# Shortest edge to halve, over the largest coordinate, which rounds at 2^-53.
SHORTEST_EDGE = 2.0**-40


@dataclass(frozen=True, eq=False)
class TriangleMesh(Mesh):
    """A mesh of any triangles, counterclockwise, with coordinates in m."""

    @property
    def blur(self) -> float:
        """Largest coordinate: middles of edges have rounding errors of its size."""
        return float(np.abs(self.xy).max())

    def doubled_areas(self) -> np.ndarray:
        """(C,) float [m^2], twice the area of each triangle, > 0."""
        a, b, c = np.moveaxis(self.xy[self.cells], 1, 0)
        (ux, uy), (vx, vy) = (b - a).T, (c - a).T
        return ux * vy - uy * vx

    @staticmethod
    def midpoints(xy: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Middles (n, 2) [m] of the edges between vertices `ends` (n, 2) with coordinates `xy`.

        TooFine if an edge is so short that rounding would move its middle.
        """
        a, b = xy[ends[:, 0]], xy[ends[:, 1]]
        largest = np.abs(xy).max()
        if (np.abs(a - b).max(axis=1, initial=0.0) < SHORTEST_EDGE * largest).any():
            raise TooFine(
                f"edges below {SHORTEST_EDGE:.1e} of the mesh ({largest:.3g} m) would be halved"
            )
        return (a + b) / 2

    def can_halve_twice(self) -> np.ndarray:
        """(C,) bool, all True: coordinates need not be integers here."""
        return np.ones(len(self.cells), dtype=bool)

    def first_guess(self) -> tuple[np.ndarray, np.ndarray]:
        """Pressure from the distances to inlet and outlet, and stream function 0, (1, V) each."""
        from scipy.spatial import cKDTree

        to_inlet, to_outlet = (
            cKDTree(self.xy[end]).query(self.xy)[0] for end in (self.inlet, self.outlet)
        )
        return (to_outlet / (to_inlet + to_outlet))[None], np.zeros((1, len(self.xy)))


def longest_edge_first(xy: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Corner (C,) of each triangle opposite its longest edge; the first of equally long ones."""
    corner = xy[cells]
    opposite = corner[:, [2, 0, 1]] - corner[:, [1, 2, 0]]
    length = (opposite**2).sum(axis=2)
    # Edges that are equal up to rounding count as equal, so that rounding cannot decide.
    return np.argmax(length > length.max(axis=1, keepdims=True) * (1 - 1e-9), axis=1)


def turned(values: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Rows (C, 3) rotated cyclically so that entry `first` (C,) comes first."""
    return np.take_along_axis(values, (first[:, None] + np.arange(3)) % 3, axis=1)
