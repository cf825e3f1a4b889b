"""Refinement ahead of a solve: only cells whose halves would be marked again."""

import numpy as np
import pytest
from gaps import level_problem, represented
from project import leak_rate
from sample_gaps import FLUID, rough_gap
from triangulations import square_with_hole

from fem_seal.fenicsx import MPI
from fem_seal.film import GridFilm
from fem_seal.flow import Tuning
from fem_seal.flow.energy import gradients, shape_gradients
from fem_seal.flow.gap_on_mesh import VertexGap
from fem_seal.flow.integrals import batch
from fem_seal.flow.level import LevelProblem, Streams
from fem_seal.flow.look_ahead import least_indicator, refined_ahead
from fem_seal.flow.marking import Marks
from fem_seal.flow.solution import FlowEstimate, Start
from fem_seal.grid import GridField
from fem_seal.mesh.triangles import ISLAND

CHI = 0.1


def solved(gap, width: int, periodic_sides: bool):
    """A mesh of squares `width` pixels wide with its solutions and the start after it."""
    problem = level_problem(gap, width=width, periodic_sides=periodic_sides)
    pressure = problem.pressure([np.zeros(problem.unknowns)])
    regularised = problem.stream(problem.mesh.first_guess()[1], CHI)
    return problem, pressure, regularised, problem.start(pressure, regularised)


def halved_ahead(start: Start, gap, marks: Marks, regularised: Streams, times: int) -> Start:
    """By the one flow of a leak rate, whose pressure is not looked at."""
    flow = FlowEstimate(
        None, regularised.psi[0], np.ones(1), regularised.conductance, regularised.chi
    )
    return refined_ahead(start, gap, marks, [flow], times)


def some_marked(start: Start, indicator: float = np.inf, flow: float = np.inf) -> Marks:
    """Every seventh cell, and the least of its indicators and flows."""
    return Marks((np.arange(len(start.mesh.cells)) % 7 == 0).astype(np.int8), indicator, flow)


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("periodic_sides", [False, True])
def test_new_vertices_take_the_best_value(representation, periodic_sides):
    """With all others as they were, no energy is left to gain by a new vertex inside: its slope,
    as DOLFINx integrates it, is rounding. Cells share no new vertices where one in seven is cut
    but for those that follow, so those with a new neighbour are left out."""
    gap = represented(rough_gap((32, 32), 0.3, 3), representation, cut=0.05, width=2)
    _, _, regularised, start = solved(gap, 2, periodic_sides)
    before = len(start.mesh.xy)
    ahead = halved_ahead(start, gap, some_marked(start), regularised, 2)
    mesh, data = ahead.mesh, gap.cell_data(ahead.mesh, ahead.values)
    plain = start.refined(gap, some_marked(start).times).streams[0]
    new = (mesh.cells >= before).sum(axis=1)
    crowded = np.zeros(len(plain), dtype=bool)
    crowded[mesh.cells[new > 1]] = True
    alone = np.flatnonzero(~crowded & ~mesh.bottom & ~mesh.top)
    alone = alone[alone >= before]
    batch().place(mesh.points(gap.aspect)[mesh.cells], data.regularised(CHI, gap.cut))
    slope, unrelaxed = (
        np.bincount(mesh.cells.ravel(), batch().slopes(psi[mesh.cells]).ravel(), len(plain))
        for psi in (ahead.streams[0], plain)
    )
    assert len(alone) > 20
    # Rounding of ψ times the largest resistivity, 1 / (χ cut³).
    assert np.all(np.abs(slope[alone]) <= 1e-15 * 100 / (CHI * gap.cut**3))
    assert np.abs(unrelaxed[alone]).max() > 0.1
    assert np.abs(ahead.streams[0] - plain)[alone].max() > 1e-3


@pytest.mark.parametrize("width", [1, 4])
def test_no_indicator_is_smaller(width):
    """Of a mesh that was solved: e_T, with its pressure, is nowhere below what ψ alone allows."""
    gap = represented(rough_gap((32, 32), 0.3, 5), cut=1e-3, width=width)
    problem, pressure, regularised, _ = solved(gap, width, True)
    cells = problem.mesh.cells[problem.kept]
    slopes, areas = shape_gradients(problem.mesh.points(gap.aspect)[cells])
    J = regularised.conductance * gradients(slopes, regularised.psi[0][cells])
    tensor = problem.data.regularised(CHI, gap.cut)
    indicators = problem.indicators(problem.flows(pressure, regularised))
    least = areas * least_indicator(J, problem.data.K, tensor)
    linear = ~problem.data.contact_vertex.any(
        axis=1
    )  # of a power trace the mean gradient is another one
    assert np.count_nonzero(linear) > 100
    assert np.all(indicators[linear] >= least[linear] - 1e-9 * indicators.sum())


def test_closed_cells_are_opened_where_they_let_flow_pass():
    """A wall with one opening, in squares as wide as the wall: what is halved ahead is at the
    opening, and none along the rest of the wall, though its whole rim is closed."""
    samples = np.ones((65, 65))
    samples[24:33] = 0
    samples[24:33, 27:30] = 0.5
    gap = represented(GridField(samples, (1.0, 1.0)), cut=1e-3, width=8)
    problem, pressure, regularised, start = solved(gap, 8, False)
    flow = np.zeros(len(problem.kept))
    flow[problem.kept] = problem.blocked_flux(problem.flows(pressure, regularised))
    marked = flow > 0.05 * regularised.conductance
    marks = Marks(marked.astype(np.int8), np.inf, 0.02 * regularised.conductance)
    plain, ahead = start.refined(gap, marks.times), halved_ahead(start, gap, marks, regularised, 2)
    x, y = ahead.mesh.points((1.0, 1.0))[len(plain.mesh.xy) :].T
    assert len(x) > 10
    assert np.all(np.abs(x - 28) <= 12)
    assert np.all(np.abs(y - 28) <= 12)


def test_fewer_levels_for_the_same_bounds():
    """What is seen ahead needs no solve: fewer levels, and brackets of one leak rate."""
    gap = rough_gap((64, 64), 0.38, 3, smooth=2)
    blind, ahead = (
        leak_rate(GridFilm(gap, sides="periodic"), rtol=0.05, tuning=Tuning(ahead=times), **FLUID)
        for times in (0, 2)
    )
    assert ahead.converged
    assert blind.converged
    assert len(ahead.levels) < len(blind.levels)
    assert max(ahead.lower, blind.lower) <= min(ahead.upper, blind.upper)


def of_a_plate_with_a_hole():
    """As `solved`: ψ is one unknown on the wall of the island."""
    mesh = square_with_hole(9, 5)
    gap = VertexGap(np.ones(len(mesh.xy)), 1.0, 1e-3, 0.0)
    problem = LevelProblem(gap, mesh, gap.vertex_values(mesh), MPI.COMM_SELF, 1e-8)
    pressure = problem.pressure([np.zeros(problem.unknowns)])
    regularised = problem.stream(mesh.first_guess()[1], CHI)
    return gap, regularised, problem.start(pressure, regularised)


@pytest.mark.parametrize("kind", ["walls", "seam", "island"])
def test_walls_seams_and_islands_stay(kind):
    """ψ is given on walls, one unknown on an island's, and on a seam two vertices are one: their
    new vertices are not moved one by one."""
    if kind == "island":
        gap, regularised, start = of_a_plate_with_a_hole()
    else:
        gap = represented(rough_gap((32, 32), 0.3, 3), cut=0.05, width=8)
        _, _, regularised, start = solved(gap, 8, kind == "seam")
    marks = Marks(np.full(len(start.mesh.cells), 2, dtype=np.int8), np.inf, np.inf)
    ahead, plain = halved_ahead(start, gap, marks, regularised, 1), start.refined(gap, marks.times)
    if kind == "island":
        cell, side = np.nonzero(ahead.mesh.sides == ISLAND)
        rim = ahead.mesh.cells[cell, (side + 1) % 3]
    else:
        rim = np.flatnonzero(plain.mesh.bottom | plain.mesh.top)
    assert np.count_nonzero(rim >= len(start.mesh.xy)) > (10 if kind == "island" else 3)
    assert np.array_equal(ahead.streams[0][rim], plain.streams[0][rim])
    assert not np.array_equal(ahead.streams, plain.streams)
