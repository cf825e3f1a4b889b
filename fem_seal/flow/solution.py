"""What the refinement hands from mesh to mesh: where a solve starts, and what it has found."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fem_seal.flow.bounds import Bounds
from fem_seal.flow.gap_on_mesh import ConstantGap, GapOnMesh, LinearGap
from fem_seal.mesh.bisection import AnyMesh, refine
from fem_seal.mesh.nested import NestedMesh

# Corner values (n, 3) of a function on a slice or an array of n cells.
CornerValues = Callable[[slice | np.ndarray], np.ndarray]

# A problem is a `LevelProblem` or, of a tensor, a `CellProblem`, and its solutions and bounds have
# types of their own. Pressures are a `Minimum` or a `Family`, stream functions a `Stream` or a
# `StreamFamily`: all with `residuals` and `stalled`, with `corner_values`, (C, 3) or (2, C, 3), or
# with `psi`, (V,) or (2, V). Bounds are `Bounds` or `MatrixBounds`.
AnyProblem = Any
AnyPressure = Any
AnyStream = Any
AnyBounds = Any


@dataclass(frozen=True, eq=False)
class FlowEstimate:
    """Estimates of one flow through the film: a pressure p, and a flux J that should be -K∇p."""

    pressure: CornerValues  #: corner values (n, 3) of p on a slice of n cells
    #: (V,), stream function ψ of unit flux at the vertices: J = Q (∂ψ/∂y, -∂ψ/∂x), Q the `rate`
    stream: np.ndarray
    rate: float  #: flow rate
    epsilon: float  #: factor ε of the regularised dual that ψ solves; zero for the true dual
    drop: float = 1.0  #: pressure drop
    #: (k,), ψ as a combination of the stream functions that were solved for; None if it is
    #: the only one
    weights: np.ndarray | None = None

    @property
    def conductance(self) -> float:
        """Flow rate at unit pressure drop."""
        return self.rate / self.drop

    def without_functions(self) -> "FlowEstimate":
        """The flow without p and ψ, so that the mesh on which they live can be freed."""
        return replace(self, pressure=_freed, stream=np.empty(0))


def _freed(cells: slice | np.ndarray) -> np.ndarray:
    raise AssertionError("the mesh of this flow has been freed")


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


@dataclass(frozen=True)
class SolvedLevel:
    """One mesh of a refinement in the units of the problem, with its bounds and cost."""

    unknowns: int  #: unknowns of the primal problem, for one direction
    cells: int  #: open triangles of the mesh
    bounds: AnyBounds  #: best bounds so far
    residuals: dict[str, tuple[float, ...]] = field(default_factory=dict)  #: as in `Level`
    seconds: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class LevelSolution:
    """One level of the refinement: the best bounds so far and the solutions on this mesh."""

    level: SolvedLevel  #: best bounds so far, and the cost of this level
    problem: AnyProblem  #: the mesh with its numberings
    pressure: AnyPressure  #: solution of the primal problem
    #: solution of the true dual problem; None if it was not solved, or blocked cells close every
    #: channel
    stream: AnyStream | None
    #: bounds for a gas that slips, if a `widen` of the loop has added them
    slip: Bounds | None = None

    @property
    def stalled(self) -> str:
        """Reason why CG stopped short of its tolerance in the primal or the dual, else ""."""
        return self.pressure.stalled or (self.stream.stalled if self.stream else "")

    def certified(self) -> "LevelSolution":
        """The same level with the dual solved: the last level must have a lower bound."""
        if self.stream is not None:
            return self
        _, guess = self.problem.mesh.first_guess()
        stream = self.problem.stream(guess)
        if stream is None:
            return self
        bounds = self.problem.corrected(self.pressure, stream).tightened(self.level.bounds)
        residuals = {**self.level.residuals, "dual": stream.residuals}
        level = replace(self.level, bounds=bounds, residuals=residuals)
        return replace(self, level=level, stream=stream)
