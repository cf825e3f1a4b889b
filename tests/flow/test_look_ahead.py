"""Refinement ahead of a solve: only cells whose halves would be marked again."""

from functools import partial

import numpy as np
import pytest
from gaps import represented, solved_on
from project import leak_rate
from sample_gaps import FLUID, rough_gap
from triangulations import square_with_hole

from fem_seal.film import GridFilm
from fem_seal.flow import Tuning
from fem_seal.flow.energy import gradients, shape_gradients
from fem_seal.flow.gap_on_mesh import VertexGap
from fem_seal.flow.indicators import error_indicators
from fem_seal.flow.integrals import batch
from fem_seal.flow.look_ahead import least_indicator, refined_ahead
from fem_seal.flow.marking import Marks
from fem_seal.mesh.nested import uniform_mesh
from fem_seal.mesh.torus import uniform_torus

CHI = 0.1
MESHES = {
    "walls": partial(uniform_mesh, periodic_sides=False),
    "seam": partial(uniform_mesh, periodic_sides=True),
    "torus": uniform_torus,
}


def looked(gap, mesh):
    """Problem, flows by the regularised dual, their fluxes, and the start after it."""
    problem, pressures, streams = solved_on(gap, mesh, CHI, 1e-8)
    flows = problem.flows(pressures, streams)
    return problem, flows, [flow.flux for flow in flows], problem.start(pressures, streams)


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("kind", MESHES)
def test_new_vertices_take_the_best_value(representation, kind):
    """With all others as they were, no energy is left to gain by a new vertex inside: its slope,
    as DOLFINx integrates it, is rounding. Cells share no new vertices where one in seven is cut
    but for those that follow, so those with a new neighbour are left out."""
    gap = represented(rough_gap((32, 32), 0.3, 3), representation, cut=0.05, width=2)
    _, _, fluxes, start = looked(gap, MESHES[kind](gap.pixels, 2))
    before = len(start.mesh.xy)
    every_seventh = (np.arange(len(start.mesh.cells)) % 7 == 0).astype(np.int8)
    ahead = refined_ahead(start, gap, Marks(every_seventh, np.inf, np.inf), fluxes, 2)
    mesh, data = ahead.mesh, gap.cell_data(ahead.mesh, ahead.values)
    new = (mesh.cells >= before).sum(axis=1)
    crowded = mesh.rim.copy()
    crowded[mesh.cells[new > 1]] = True
    alone = np.flatnonzero(~crowded[before:]) + before
    assert len(alone) > 20
    batch().place(mesh.points(gap.aspect)[mesh.cells], data.regularised(CHI, gap.cut))
    for psi, plain in zip(ahead.streams, start.refined(gap, every_seventh).streams, strict=True):
        slope, unrelaxed = (
            np.bincount(mesh.cells.ravel(), batch().slopes(v[mesh.cells]).ravel(), len(v))
            for v in (psi, plain)
        )
        # Rounding of ψ times the largest resistivity, 1 / (χ cut³).
        assert np.all(np.abs(slope[alone]) <= 1e-15 * 100 / (CHI * gap.cut**3))
        assert np.abs(unrelaxed[alone]).max() > 0.1
        assert np.abs(psi - plain)[alone].max() > 1e-3


@pytest.mark.parametrize("width", [1, 4])
def test_no_indicator_is_smaller(width):
    """Of a mesh that was solved: e_T, with its pressure, is nowhere below what ψ alone allows."""
    gap = represented(rough_gap((32, 32), 0.3, 5), cut=1e-3, width=width)
    problem, (flow,), _, _ = looked(gap, MESHES["seam"](gap.pixels, width))
    cells = problem.mesh.cells[problem.kept]
    slopes, areas = shape_gradients(problem.mesh.points(gap.aspect)[cells])
    J = flow.flux.rate * gradients(slopes, flow.stream[cells])
    tensor = problem.data.regularised(CHI, gap.cut)
    indicators = error_indicators(problem, [flow])
    least = areas * least_indicator(J, problem.data.K, tensor)
    linear = ~problem.data.contact_vertex.any(
        axis=1
    )  # of a power trace the mean gradient is another one
    assert np.count_nonzero(linear) > 100
    assert np.all(indicators[linear] >= least[linear] - 1e-9 * indicators.sum())


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


@pytest.mark.parametrize("kind", [*MESHES, "island"])
def test_walls_seams_and_islands_stay(kind):
    """ψ is given on walls, one unknown on an island's, and on a seam two vertices are one: their
    new vertices are not moved one by one."""
    if kind == "island":
        mesh = square_with_hole(9, 5)
        gap = VertexGap(np.ones(len(mesh.xy)), 1.0, 1e-3, 0.0)
    else:
        gap = represented(rough_gap((32, 32), 0.3, 3), cut=0.05, width=8)
        mesh = MESHES[kind](gap.pixels, 8)
    _, _, fluxes, start = looked(gap, mesh)
    marks = Marks(np.full(len(start.mesh.cells), 2, dtype=np.int8), np.inf, np.inf)
    ahead, plain = refined_ahead(start, gap, marks, fluxes, 1), start.refined(gap, marks.times)
    rim = np.flatnonzero(plain.mesh.rim)
    assert np.count_nonzero(rim >= len(start.mesh.xy)) > (10 if kind == "island" else 3)
    assert np.array_equal(ahead.streams[:, rim], plain.streams[:, rim])
    assert (ahead.streams != plain.streams).any(axis=1).all()
