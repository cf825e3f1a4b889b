"""What the next level starts from: the solutions of the last one, carried to its mesh."""

from dataclasses import dataclass

import numpy as np

from fem_seal.flow.gap_on_mesh import ConstantGap, LinearGap, VertexGap
from fem_seal.flow.level import LevelProblem, Stream
from fem_seal.flow.linear import Minimum
from fem_seal.mesh.bisection import refine
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.triangles import TriangleMesh


@dataclass(frozen=True, eq=False)
class Guess:
    """What the solves of a level start from: unknowns of the pressure, ψ (V,) at the vertices."""

    pressure: np.ndarray
    stream: np.ndarray


@dataclass(frozen=True, eq=False)
class Start:
    """A mesh, the gap at its vertices, and what to start from.

    pressure : (C, 3), at the corners, since it jumps across contact
    stream : (V,), at the vertices
    """

    mesh: NestedMesh | TriangleMesh
    values: np.ndarray
    pressure: np.ndarray
    stream: np.ndarray

    @classmethod
    def first(
        cls, gap: LinearGap | ConstantGap | VertexGap, mesh: NestedMesh | TriangleMesh
    ) -> "Start":
        """On the first mesh, as if the gap were the same everywhere."""
        pressure, stream = mesh.first_guess()
        return cls(mesh, gap.vertex_values(mesh), pressure[mesh.cells], stream)

    @classmethod
    def after(cls, problem: LevelProblem, pressure: Minimum, stream: Stream | None) -> "Start":
        """The solutions on a mesh; what carries no flow now never will, and needs no guess."""
        mesh = problem.mesh
        at_corners = np.zeros(mesh.cells.shape)
        at_corners[problem.kept] = pressure.corner_values
        at_vertices = np.zeros(len(mesh.xy)) if stream is None else stream.psi
        return cls(mesh, problem.values, at_corners, at_vertices)

    def guess(self, problem: LevelProblem) -> Guess:
        """In place of the pressure at the corners of all cells its unknowns alone."""
        pressure = self.pressure.compress(problem.kept, axis=0)
        return Guess(problem.primal_numbering.from_corners(pressure), self.stream)

    def refined(self, gap: LinearGap | ConstantGap | VertexGap, times: np.ndarray) -> "Start":
        """Carry all to the mesh in which each cell is bisected so many times at least."""
        step = refine(self.mesh, times)
        values = self.values
        for mesh, edge_ends in step.by_rounds():
            values = gap.refined_values(values, mesh, edge_ends)
        pressure, stream = step.prolong(self.pressure), step.at_vertices(self.stream)
        return Start(step.mesh, values, pressure, stream)
