"""Percolation and critical constriction of a gap that is linear on the triangles of any mesh.

As on a grid (`film.constriction`), g_c is the largest h at which the vertices with g >= h join
inlet and outlet, here along the edges of the mesh: the set {g >= h} of a gap that is linear on
every triangle is connected in the same way as the vertices it contains.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.film.constriction import CriticalConstriction, highest_spanning
from fem_seal.mesh.grouping import components


@dataclass(frozen=True, eq=False)
class VertexGraph:
    """The vertices of a mesh as a graph along its edges."""

    gap: np.ndarray  #: (V,), gap at the vertices [m], zero in contact
    #: (E, 2) int, vertices at the ends of each edge. Vertices at one point (on a seam) must share
    #: one number
    edges: np.ndarray
    inlet: np.ndarray  #: (V,) bool, vertices on the inlet
    outlet: np.ndarray  #: (V,) bool, vertices on the outlet

    def constriction(self, points: np.ndarray) -> CriticalConstriction | None:
        """Tightest place of the widest path from inlet to outlet; None if there is no path."""
        critical = highest_spanning(self.gap[self.gap > 0], lambda h: bool(self._spanning(h).any()))
        if critical == 0:
            return None
        x, y = points[np.argmax(self._spanning(critical) & (self.gap == critical))]
        return CriticalConstriction(critical, (float(x), float(y)))

    def pockets(self) -> np.ndarray:
        """(V,) bool: open vertices that no path of open vertices joins to inlet or outlet."""
        is_open = self.gap > 0
        component = self._components(is_open)
        ends = np.unique(component[(self.inlet | self.outlet) & is_open])
        return is_open & ~np.isin(component, ends)

    def _spanning(self, h: float) -> np.ndarray:
        """(V,) bool: vertices in clusters of {gap >= h} that join inlet and outlet."""
        above = self.gap >= h
        component = self._components(above)
        both = np.intersect1d(component[self.inlet & above], component[self.outlet & above])
        return above & np.isin(component, both)

    def _components(self, mask: np.ndarray) -> np.ndarray:
        """(V,) int: number of the cluster of masked vertices to which each vertex belongs."""
        return components(self.edges[mask[self.edges].all(axis=1)], len(mask))
