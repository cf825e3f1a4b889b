"""Initial values for the next level: the solutions of the last one, prolongated to its mesh."""

from dataclasses import dataclass, replace

import numpy as np

from fem_seal.flow.gap_on_mesh import ConstantGap, LinearGap, VertexGap
from fem_seal.flow.level import LevelProblem, Stream
from fem_seal.flow.linear import Minimum
from fem_seal.mesh.bisection import refine
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.triangles import TriangleMesh


@dataclass(frozen=True, eq=False)
class Guess:
    """Initial values of the solves on one mesh.

    Attributes
    ----------
    pressure : (unknowns,)
        Values of the pressure unknowns.
    stream : (V,)
        ψ at the vertices.
    """

    pressure: np.ndarray
    stream: np.ndarray


@dataclass(frozen=True, eq=False)
class Start:
    """A mesh, the gap at its vertices, and functions to start from.

    Attributes
    ----------
    mesh : NestedMesh or TriangleMesh
        Mesh to be solved next.
    values : (V, k)
        Gap at its vertices, raised and lowered; k = 0 for pixels of constant gap.
    pressure : (C, 3)
        Pressure at the corners, since it jumps across contact.
    stream : (V,)
        ψ at the vertices.
    """

    mesh: NestedMesh | TriangleMesh
    values: np.ndarray
    pressure: np.ndarray
    stream: np.ndarray

    @classmethod
    def first(
        cls, gap: LinearGap | ConstantGap | VertexGap, mesh: NestedMesh | TriangleMesh
    ) -> "Start":
        """Start on the first mesh with the solution of a uniform gap."""
        pressure, stream = mesh.first_guess()
        return cls(mesh, gap.vertex_values(mesh), pressure[mesh.cells], stream)

    @classmethod
    def after(cls, problem: LevelProblem, pressure: Minimum, stream: Stream | None) -> "Start":
        """Start from the solutions on a mesh; cells without flow stay so, and get zeros."""
        mesh = problem.mesh
        at_corners = np.zeros(mesh.cells.shape)
        at_corners[problem.kept] = pressure.corner_values
        at_vertices = np.zeros(len(mesh.xy)) if stream is None else stream.psi
        return cls(mesh, problem.values, at_corners, at_vertices)

    def guess(self, problem: LevelProblem) -> Guess:
        """Initial values of the unknowns of a problem on this mesh."""
        pressure = self.pressure.compress(problem.kept, axis=0)
        return Guess(problem.primal_numbering.from_corners(pressure), self.stream)

    def refined(self, gap: LinearGap | ConstantGap | VertexGap, times: np.ndarray) -> "Start":
        """Bisect each cell at least `times` (C,) times; prolongate the gap and both functions."""
        step = refine(self.mesh, times)
        values = self.values
        for mesh, edge_ends in step.by_rounds():
            values = gap.refined_values(values, mesh, edge_ends)
        pressure, stream = step.prolong(self.pressure), step.at_vertices(self.stream)
        return Start(step.mesh, values, pressure, stream)

    def through(self, gap: LinearGap | ConstantGap | VertexGap) -> "Start":
        """The same mesh and functions, for another gap on the same grid."""
        if isinstance(gap, VertexGap) or not isinstance(self.mesh, NestedMesh):
            raise TypeError("only films on a grid share a mesh")
        return replace(self, values=gap.values_at(self.mesh))


@dataclass(eq=False)
class KeptMesh:
    """The mesh on which a flow ended, to begin the flow through a film that differs little.

    Attributes
    ----------
    start : Start or None
        Mesh and solutions of the last flow; None before the first.
    narrowest : float
        Critical constriction of its film [m].
    """

    start: Start | None = None
    narrowest: float = 0.0
