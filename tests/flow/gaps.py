"""Gaps the flow tests share, and the fluid in which film conductivity is simply gap³."""

import numpy as np

from fem_seal.fenicsx import MPI
from fem_seal.flow.gap_on_mesh import REPRESENTATIONS, ConstantGap, LinearGap
from fem_seal.flow.level import LevelProblem, Stream
from fem_seal.flow.linear import Minimum
from fem_seal.grid import GridField
from fem_seal.mesh.bisection import bisect
from fem_seal.mesh.nested import uniform_mesh

FLUID = {"viscosity": 1 / 12, "pressure_drop": 1.0}  # K = g³/(12 η) = g³, Δp = 1


def vertex_gap(function, shape: tuple[int, int], size=(1.0, 1.0)) -> GridField:
    """Samples of function(x, y) at the vertices of mx × my pixels over a rectangle."""
    spacing = (size[0] / shape[0], size[1] / shape[1])
    i, j = np.meshgrid(*(np.arange(m + 1) for m in shape), indexing="ij")
    values = np.broadcast_to(function(i * spacing[0], j * spacing[1]), i.shape)
    return GridField(values, spacing)


def pixel_gap(function, shape: tuple[int, int], size=(1.0, 1.0)) -> GridField:
    """Samples of function(x, y) at the centres of mx × my pixels over a rectangle."""
    spacing = (size[0] / shape[0], size[1] / shape[1])
    i, j = np.meshgrid(*(np.arange(m) + 0.5 for m in shape), indexing="ij")
    values = np.broadcast_to(function(i * spacing[0], j * spacing[1]), i.shape)
    return GridField(values, spacing)


def rough_gap(shape: tuple[int, int], contact: float, seed: int, smooth: int = 1) -> GridField:
    """Random samples averaged over (2 smooth + 1)² neighbours, cut off at a contact area."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=shape)
    total = sum(
        np.roll(noise, (i, j), (0, 1))
        for i in range(-smooth, smooth + 1)
        for j in range(-smooth, smooth + 1)
    )
    gap = np.maximum(0.0, total - np.quantile(total, contact))
    return GridField(gap / gap.max(), (1.0, 1.0), periodic=True)


def represented(
    gap: GridField,
    representation: str = "linear",
    cut: float = 0.0,
    floor: float = 0.0,
    width: int = 1,
    ceiling: float = np.inf,
) -> LinearGap | ConstantGap:
    """The gap on meshes as it is, without raising or lowering small gaps."""
    return REPRESENTATIONS[representation](gap, cut, floor, width, ceiling)


def level_problem(
    gap: LinearGap | ConstantGap,
    width: int = 1,
    periodic_sides: bool = False,
    tolerance: float = 1e-8,
    markings=(),
) -> LevelProblem:
    """Both problems on the uniform mesh, bisected where each marking(mesh) says."""
    mesh = uniform_mesh(gap.squares, width, periodic_sides)
    values = gap.vertex_values(mesh)
    for marking in markings:
        step = bisect(mesh, marking(mesh))
        mesh, values = step.mesh, gap.refined_values(values, step.mesh, step.edge_ends)
    return LevelProblem(gap, mesh, values, MPI.COMM_SELF, tolerance)


def solved(problem: LevelProblem) -> tuple[Minimum, Stream | None]:
    """Pressure and stream function, from zero."""
    pressure = problem.pressure(np.zeros(problem.unknowns))
    return pressure, problem.stream(np.zeros(len(problem.mesh.xy)))


def plain_bounds(problem: LevelProblem) -> np.ndarray:
    """Lower and upper bound before sharpening."""
    pressure, stream = solved(problem)
    return np.array([stream.conductance, pressure.energy])
