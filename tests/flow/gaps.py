"""Gaps on meshes, discrete problems and their solutions that the flow tests share."""

import numpy as np
from project import leak_rate
from sample_gaps import FLUID

from fem_seal.fenicsx import MPI
from fem_seal.film import Film
from fem_seal.flow import Limits, Tuning
from fem_seal.flow.families import Pressures, Streams
from fem_seal.flow.gap_on_mesh import REPRESENTATIONS, GapOnMesh, GridGap
from fem_seal.flow.level import LevelProblem
from fem_seal.flow.solution import Start
from fem_seal.grid import GridField
from fem_seal.leak_rate import FlowField, LeakRate
from fem_seal.mesh.bisection import AnyMesh, bisect
from fem_seal.mesh.nested import NestedMesh, uniform_mesh

TIGHT = Tuning(tolerance=1e-12)
# Energies err by 2e-12. The correction subtracts δ, the squared norm of a projection: an error e of
# the solution changes it by 2 √(δ E(e)) at most, relative 2 √(0.3 · 2e-12), and two bounds meet.
DUALITY = 4 * np.sqrt(0.3 * 2e-12)


def bracketed(film: Film, rtol: float = 1e-3, unknowns: int | None = 700, **options) -> LeakRate:
    """Leak rate at K = g³ and Δp = 1, with bounds from both sides on every level."""
    options = {"limits": Limits(unknowns=unknowns), "every_dual": True} | FLUID | options
    return leak_rate(film, rtol=rtol, **options)


def assert_enclosed(flow: LeakRate, low: float, high: float, case: object) -> None:
    """The bracket of every level meets [low, high]; a failure names the case."""
    for level in flow.levels:
        assert level.lower <= high, case
        assert low <= level.upper, case


def represented(
    gap: GridField,
    representation: str = "linear",
    cut: float = 0.0,
    floor: float = 0.0,
    width: int = 1,
    ceiling: float = np.inf,
) -> GridGap:
    """The gap on meshes as it is, without raising or lowering small gaps."""
    return REPRESENTATIONS[representation](gap, cut, floor, width, ceiling)


def meshed(
    gap: GridGap, width: int = 1, periodic_sides: bool = False, markings=()
) -> tuple[NestedMesh, np.ndarray]:
    """The uniform mesh, bisected where each marking(mesh) says, and the gap at its vertices."""
    mesh = uniform_mesh(gap.pixels, width, periodic_sides)
    values = gap.vertex_values(mesh)
    for marking in markings:
        step = bisect(mesh, marking(mesh))
        mesh, values = step.mesh, gap.refined_values(values, step)
    return mesh, values


def level_problem(
    gap: GridGap,
    width: int = 1,
    periodic_sides: bool = False,
    tolerance: float = 1e-8,
    markings=(),
) -> LevelProblem:
    """Both problems on such a mesh."""
    return LevelProblem(
        gap, *meshed(gap, width, periodic_sides, markings), MPI.COMM_SELF, tolerance
    )


def solved(problem: LevelProblem) -> tuple[Pressures, Streams | None]:
    """Pressure and stream function, from zero."""
    pressure = problem.pressure([np.zeros(problem.unknowns)])
    return pressure, problem.stream(np.zeros((1, len(problem.mesh.xy))))


def solved_on(
    gap: GapOnMesh, mesh: AnyMesh, chi: float = 0.0, tolerance: float = 1e-14
) -> tuple[LevelProblem, Pressures, Streams | None]:
    """The problem on any mesh, pressures and stream functions from those of a uniform gap."""
    start = Start.first(gap, mesh)
    problem = LevelProblem(gap, mesh, start.values, MPI.COMM_SELF, tolerance)
    pressure = problem.pressure(problem.guesses(start))
    return problem, pressure, problem.stream(start.streams, chi)


def plain_bounds(problem: LevelProblem) -> np.ndarray:
    """Lower and upper bound before correction."""
    pressure, stream = solved(problem)
    return np.array([stream.conductance, pressure.energies.item()])


def everything(mesh: NestedMesh) -> np.ndarray:
    return np.ones(len(mesh.cells), dtype=bool)


class Random:
    """Marks a fifth of the cells."""

    def __init__(self, seed: int):
        self._rng = np.random.default_rng(seed)

    def __call__(self, mesh: NestedMesh) -> np.ndarray:
        return self._rng.random(len(mesh.cells)) < 0.2


def areas_and_slopes(field: FlowField) -> tuple[np.ndarray, np.ndarray]:
    """Area (C,) and pressure gradient (C, 2) of each cell, from points and pressure alone."""
    x, p = field.points[field.cells], field.pressure[field.cells]
    sides = x[:, 1:] - x[:, :1]
    slope = np.linalg.solve(sides, (p[:, 1:] - p[:, :1])[..., None])[..., 0]
    return np.abs(np.linalg.det(sides)) / 2, slope


def octaves(low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points and weights between two gaps, in pieces on which the gap at most doubles.

    A pole at 0 lies at least a piece beyond the ends of each: 24 points err by (3 + √8)^-48.
    """
    ends = np.geomspace(low, high, 2 + int(abs(np.log2(high / low))))
    x, w = np.polynomial.legendre.leggauss(24)
    halves = np.diff(ends)[:, None] / 2
    return (ends[:-1, None] + halves * (1 + x)).ravel(), (halves * w).ravel()


# --- random contact: each takes open samples and returns which of them stay open -----------------


def scattered(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Single contacts anywhere, touching at corners, on the sides and at the ends."""
    return open_part & (rng.random(open_part.shape) > rng.uniform(0, 0.6))


def channel(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """All contact but for a random walk one sample wide, that may miss the outlet."""
    path = np.zeros_like(open_part)
    i, j = 0, int(rng.integers(open_part.shape[1]))
    for _ in range(3 * open_part.size):
        path[i, j] = True
        step = rng.integers(4)
        i = min(max(i + (step == 0) - (step == 1 and rng.random() < 0.5), 0), len(path) - 1)
        j = (j + (step == 2) - (step == 3)) % path.shape[1]
        if i == len(path) - 1:
            path[i, j] = rng.random() < 0.8
            return path
    return path


def lines(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Contact lines one sample wide, along and across, ending inside or on the rim."""
    kept = open_part.copy()
    for _ in range(rng.integers(1, 4)):
        i, j = (int(rng.integers(n)) for n in kept.shape)
        length = int(rng.integers(1, max(kept.shape) + 1))
        if rng.random() < 0.5:
            kept[i : i + length, j] = False
        else:
            kept[i, j : j + length] = False
    return kept


def rings(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Islands three samples wide; with an open centre, a pocket."""
    kept = open_part.copy()
    for _ in range(rng.integers(1, 3)):
        i, j = (int(rng.integers(-1, n)) for n in kept.shape)
        block = kept[max(i, 0) : i + 3, max(j, 0) : j + 3]
        block[...] = False
        if rng.random() < 0.5 and min(block.shape) == 3:
            block[1, 1] = True
    return kept


def rows(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A row all in contact, but perhaps for one sample."""
    kept = open_part.copy()
    i = int(rng.integers(len(kept)))
    kept[i] = False
    if rng.random() < 0.7:
        kept[i, rng.integers(kept.shape[1])] = True
    return kept


def corners(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Fields of a chessboard, each two samples wide or one, in contact."""
    i, j = np.indices(open_part.shape) // int(rng.integers(1, 3))
    return open_part & (((i + j) % 2 == 0) | (rng.random(open_part.shape) < 0.2))
