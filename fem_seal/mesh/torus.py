"""Meshes of the nested family on a cell that is periodic in both directions."""

from functools import cached_property

import numpy as np

from fem_seal.mesh.bisection import coarse_mesh, refine
from fem_seal.mesh.mesh import ends_of_sides
from fem_seal.mesh.nested import NestedMesh, opposite

# Squares across the smallest first mesh. With one square, both ends of a side on a seam would be
# the same point of the torus.
LEAST_SQUARES = 4


class Torus(NestedMesh):
    """A nested mesh of a rectangle whose opposite sides are one line each, its two seams.

    The sides of cells along x = mx are those along x = 0, and likewise along y, so that bisection
    keeps opposite sides alike. There are neither ends nor walls: all sides are INSIDE. `twin` is,
    for a vertex at x = mx or y = my, the one at x < mx and y < my that is the same point.
    """

    @cached_property
    def on_far_seam(self) -> np.ndarray:
        """(V, 2) bool: vertices at x = mx, and vertices at y = my."""
        return self.xy == self.extent

    @property
    def rim(self) -> np.ndarray:
        """(V,) bool, vertices on both sides of both seams."""
        return ((self.xy == 0) | self.on_far_seam).any(axis=1)

    def _ends_of_edges(self) -> np.ndarray:
        """(C, 3, 2) ends of the sides; at x = mx and at y = my those of the same edge opposite."""
        ends = ends_of_sides(self.cells)
        for axis in (0, 1):
            on_side = self.on_far_seam[:, axis][ends].all(axis=2)
            ends[on_side] = opposite(self, axis)[ends[on_side]]
        return ends

    def first_guess(self) -> tuple[np.ndarray, np.ndarray]:
        """Pressures and stream functions (2, V) of a uniform gap, with unit jumps in x and in y."""
        unit = (self.xy / self.extent).T
        return unit, unit.copy()


def uniform_torus(pixels: tuple[int, int], width: int) -> Torus:
    """Torus of squares `width` pixels wide, a power of two, or smaller if too few fit across."""
    mesh = coarse_mesh(pixels, width, periodic_sides=False)
    while squares_across(mesh) < LEAST_SQUARES:
        # Two halvings make squares half as wide.
        mesh = refine(mesh, np.full(len(mesh.cells), 2, dtype=np.int8)).mesh
    twin = opposite(mesh, 1)[opposite(mesh, 0)]
    return Torus(mesh.xy, mesh.cells, np.zeros_like(mesh.sides), twin, mesh.pixels)


def squares_across(mesh: NestedMesh) -> int:
    """Number of edges along the side of the rectangle that has fewer."""
    return min(np.count_nonzero(mesh.xy[:, axis] == 0) - 1 for axis in (0, 1))
