"""Base of the meshes that bisection refines: triangles, points that are the same, and edges."""

from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np

from fem_seal.mesh.edges import Edges, find_edges


class Mesh(ABC):
    """Triangles whose sides are opposite their corners."""

    xy: np.ndarray  #: (V, 2), coordinates of the vertices
    cells: np.ndarray  #: (C, 3) int32, vertices of the triangles
    #: (V,) int32, for a vertex on the far side of a seam, the vertex on the near side that is the
    #: same point; for all others the vertex itself
    twin: np.ndarray
    carried_edges: Edges | None  #: edges of the mesh, if bisection has already made them

    @cached_property
    def periodic(self) -> bool:
        """Whether the mesh has a seam, whose two sides are the same line."""
        return not np.array_equal(self.twin, np.arange(len(self.twin)))

    def ends_of_sides(self) -> np.ndarray:
        """(C, 3, 2) vertices at the ends of the sides opposite corners 0, 1 and 2."""
        return self.cells[:, [[1, 2], [2, 0], [0, 1]]]

    @cached_property
    def numbered_edges(self) -> Edges:
        """Edges; the edges on the far side of a seam are those on the near side."""
        return self.carried_edges or find_edges(self._ends_of_edges(), len(self.xy))

    @property
    def edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (E, 2) of each edge, and the edges (C, 3) opposite the corners."""
        return self.numbered_edges.ends, self.numbered_edges.of_cell

    @abstractmethod
    def _ends_of_edges(self) -> np.ndarray:
        """(C, 3, 2) ends of the sides; on the far side of a seam those of the twin."""
