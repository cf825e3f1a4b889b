"""Objects that pass from mesh to mesh in a refinement: the start of a solve, and its estimates."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.flow.bounds import Bounds
from fem_seal.flow.gap_on_mesh import GapOnMesh, GridGap
from fem_seal.mesh.bisection import AnyMesh, refine
from fem_seal.mesh.nested import NestedMesh

# Corner values (n, 3) of a function on a slice or an array of n cells.
CornerValues = Callable[[slice | np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Flux:
    """A flux J = Q (∂ψ/∂y, -∂ψ/∂x) through the film, with a stream function ψ of unit flux."""

    weights: np.ndarray  #: (d,), ψ as a combination of the stream functions of unit jumps
    rate: float  #: flow rate Q
    drop: float  #: pressure drop
    chi: float  #: factor χ of the regularised dual that ψ solves; zero for the true dual

    @property
    def conductance(self) -> float:
        """Flow rate at unit pressure drop."""
        return self.rate / self.drop


@dataclass(frozen=True, eq=False)
class FlowEstimate:
    """Estimates of one flow on a mesh: a pressure p, and a flux that should be -K∇p."""

    pressure: CornerValues  #: corner values (n, 3) of p on a slice of n cells
    flux: Flux
    stream: np.ndarray  #: (V,), ψ of the flux at the vertices


@dataclass(frozen=True, eq=False)
class Start:
    """A mesh, the gap at its vertices, and functions to start from.

    A leak rate has one pressure and one stream function, d = 1, a conductivity tensor two of each.
    """

    mesh: AnyMesh  #: mesh to be solved next
    #: (V, n), gap at its vertices, raised and lowered; n = 0 for pixels of constant gap
    values: np.ndarray
    #: (d, C, 3), pressures of unit jumps at the corners, since they jump across contact
    pressures: np.ndarray
    streams: np.ndarray  #: (d, V), stream functions of unit jumps at the vertices

    @classmethod
    def first(cls, gap: GapOnMesh, mesh: AnyMesh) -> "Start":
        """Start on the first mesh with the solution of a uniform gap."""
        pressures, streams = mesh.first_guess()
        return cls(mesh, gap.vertex_values(mesh), pressures[:, mesh.cells], streams)

    def refined(self, gap: GapOnMesh, times: np.ndarray) -> "Start":
        """Bisect each cell at least `times` (C,) times; prolongate the gap and all functions."""
        step = refine(self.mesh, times)
        values = gap.refined_values(self.values, step)
        pressures = np.stack([step.prolong(pressure) for pressure in self.pressures])
        streams = np.stack([step.at_vertices(psi) for psi in self.streams])
        return Start(step.mesh, values, pressures, streams)

    def through(self, gap: GapOnMesh) -> "Start":
        """The same mesh and functions, for another gap on the same grid."""
        if isinstance(gap, GridGap) and isinstance(self.mesh, NestedMesh):
            return replace(self, values=gap.vertex_values(self.mesh))
        raise InvalidInput(
            "leak_rate takes the start of another film for films on a grid alone, got a "
            f"{type(gap).__name__} on a {type(self.mesh).__name__}: leave out `start`"
        )


@dataclass(frozen=True)
class SolvedLevel:
    """One mesh of a refinement in the units of the problem, with its bounds and cost."""

    unknowns: int  #: unknowns of the primal problem, for one direction
    cells: int  #: open triangles of the mesh
    bounds: Bounds  #: best bounds so far
    residuals: dict[str, tuple[float, ...]] = field(default_factory=dict)  #: as in `LevelRecord`
    seconds: dict[str, float] = field(default_factory=dict)
