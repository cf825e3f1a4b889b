"""Gaps the flow tests share, and the fluid in which film conductivity is simply gap³."""

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix

from fem_seal.fenicsx import MPI
from fem_seal.flow.gap_on_mesh import REPRESENTATIONS, ConstantGap, LinearGap
from fem_seal.flow.level import LevelProblem, Stream
from fem_seal.flow.linear import Minimum
from fem_seal.grid import GridField
from fem_seal.mesh.bisection import bisect
from fem_seal.mesh.nested import NestedMesh, uniform_mesh

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


def everything(mesh: NestedMesh) -> np.ndarray:
    return np.ones(len(mesh.cells), dtype=bool)


class Random:
    """Marks a fifth of the cells."""

    def __init__(self, seed: int):
        self._rng = np.random.default_rng(seed)

    def __call__(self, mesh: NestedMesh) -> np.ndarray:
        return self._rng.random(len(mesh.cells)) < 0.2


def stiffness(mesh: NestedMesh, coefficient: np.ndarray) -> csc_matrix:
    """Matrix (V, V) of ∫ c ∇u·∇v over P1 functions on the mesh."""
    x = mesh.points((1.0, 1.0))[mesh.cells]
    to_corner = np.stack([x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]], axis=2)
    slopes = np.linalg.inv(to_corner)  # rows: ∇λ_1, ∇λ_2
    slopes = np.concatenate([-slopes.sum(axis=1, keepdims=True), slopes], axis=1)
    weight = coefficient * np.abs(np.linalg.det(to_corner)) / 2
    local = weight[:, None, None] * slopes @ slopes.transpose(0, 2, 1)
    rows, columns = np.repeat(mesh.cells, 3, axis=1), np.tile(mesh.cells, 3)
    return coo_matrix((local.ravel(), (rows.ravel(), columns.ravel()))).tocsc()
