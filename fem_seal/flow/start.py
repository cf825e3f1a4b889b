"""Initial values for the next level: the solutions of the last one, prolongated to its mesh."""

from dataclasses import dataclass, replace

import numpy as np

from fem_seal.flow.gap_on_mesh import ConstantGap, GapOnMesh, LinearGap
from fem_seal.mesh.bisection import AnyMesh, refine
from fem_seal.mesh.nested import NestedMesh


@dataclass(frozen=True, eq=False)
class Guess:
    """Initial values of the solves on one mesh, in the form that its problem takes."""

    pressure: np.ndarray  #: initial pressure of the primal problem
    stream: np.ndarray  #: initial stream functions of the dual problems


@dataclass(frozen=True, eq=False)
class Start:
    """A mesh, the gap at its vertices, and functions to start from.

    A leak rate has one pressure and one stream function, a conductivity tensor two of each.
    """

    mesh: AnyMesh  #: mesh to be solved next
    #: (V, n), gap at its vertices, raised and lowered; n = 0 for pixels of constant gap
    values: np.ndarray
    pressures: np.ndarray  #: (k, C, 3), pressures at the corners, since they jump across contact
    streams: np.ndarray  #: (k, V), stream functions at the vertices

    @classmethod
    def first(cls, gap: GapOnMesh, mesh: AnyMesh) -> "Start":
        """Start on the first mesh with the solution of a uniform gap."""
        pressures, streams = map(np.atleast_2d, mesh.first_guess())
        return cls(mesh, gap.vertex_values(mesh), pressures[:, mesh.cells], streams)

    def refined(self, gap: GapOnMesh, times: np.ndarray) -> "Start":
        """Bisect each cell at least `times` (C,) times; prolongate the gap and all functions."""
        step = refine(self.mesh, times)
        values = self.values
        for mesh, edge_ends in step.by_rounds():
            values = gap.refined_values(values, mesh, edge_ends)
        pressures = np.stack([step.prolong(pressure) for pressure in self.pressures])
        streams = np.stack([step.at_vertices(psi) for psi in self.streams])
        return Start(step.mesh, values, pressures, streams)

    def through(self, gap: GapOnMesh) -> "Start":
        """The same mesh and functions, for another gap on the same grid."""
        if isinstance(gap, LinearGap | ConstantGap) and isinstance(self.mesh, NestedMesh):
            return replace(self, values=gap.values_at(self.mesh))
        raise TypeError("only films on a grid share a mesh")
