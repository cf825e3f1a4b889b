"""One mesh of a periodic cell: against the leak rate of a cell that is its own mirror image. What
is stored is admissible to the last digit, and no small energy is lost beside a large one."""

from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from gaps import represented, solved_on
from sample_gaps import rough_gap

from fem_seal.flow.energy import gradients, shape_gradients
from fem_seal.flow.families import lower_matrix, orthonormal, upper_matrix
from fem_seal.flow.indicators import blocked_fluxes, error_indicators, flux_residuals
from fem_seal.flow.look_ahead import least_indicator, refined_ahead
from fem_seal.flow.marking import Marks
from fem_seal.grid import GridField
from fem_seal.mesh.nested import uniform_mesh
from fem_seal.mesh.torus import uniform_torus

SOLVER = 1e-6  # ten times the root of the 1e-14 of the energy at which CG stops
CHI = 0.1


def mirrored(representation, seed=3):
    """A rough periodic gap with the mirror image of its first half beside it, in contact along a
    line in x: with pressures that are constant at both ends, and flow along x alone."""
    half = rough_gap((17, 32), 0.25, seed, 2).values.copy()
    half[:, :5] = 0.0
    # Vertices 0 and 16 are their own images; of pixels none is.
    parts = (half[:16], half[:0:-1]) if representation == "linear" else (half[1:], half[:0:-1])
    values = np.concatenate(parts)
    return GridField(values, (1.0, 0.8), periodic=True)


def both(representation, width, chi=0.0):
    """The mirror cell as a leak rate from end to end, and as a torus."""
    gap = represented(mirrored(representation), representation, cut=1e-3, width=width)
    meshes = uniform_mesh(gap.pixels, width, True), uniform_torus(gap.pixels, width)
    return [solved_on(gap, mesh, chi) for mesh in meshes]


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("width", [1, 2])
def test_bounds_of_a_mirror_cell_are_those_of_its_leak_rate(representation, width):
    """K*_xx Ly/Lx is the leak rate, and so are the bounds, before and after the correction."""
    (leak, p, psi), (cell, pressures, streams) = both(representation, width)
    assert cell.excess(pressures, streams) == pytest.approx(leak.excess(p, psi), rel=SOLVER)
    corrected = cell.corrected(pressures, streams)
    matrices = corrected.lower, corrected.upper
    for bound, matrix in zip(leak.corrected(p, psi).numbers, matrices, strict=True):
        assert matrix[0, 0] == pytest.approx(bound, rel=SOLVER)
        assert np.abs(matrix[[0, 1, 1], [1, 0, 1]]).max() <= 1e-12 * matrix[0, 0]
    upper = cell.upper_bound(pressures)
    assert upper.upper[0, 0] == pytest.approx(leak.upper_bound(p).upper.item(), rel=SOLVER)
    assert not upper.lower.any()


@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_cells_of_a_mirror_cell_are_marked_as_for_its_leak_rate(representation):
    """Its one flow is that of the leak rate, and so are indicators, blocked flux and residuals."""
    (leak, *of_leak), (cell, *of_cell) = both(representation, 4, CHI)
    np.testing.assert_array_equal(leak.kept, cell.kept)
    assert cell.data.blocked.any()
    (flow,), (same,) = leak.flows(*of_leak), cell.flows(*of_cell)
    assert flow.flux.drop == same.flux.drop == 1
    assert same.flux.rate == pytest.approx(flow.flux.rate, rel=SOLVER)
    for measure in (error_indicators, blocked_fluxes, flux_residuals):
        expected = measure(leak, [flow])
        np.testing.assert_allclose(
            measure(cell, [same]), expected, atol=SOLVER * expected.sum(), err_msg=measure.__name__
        )


def test_shares_of_both_flows():
    """Prager and Synge: with orthonormal pressures, and the best flux of each, shares of the cells
    are positive, and their sum is tr(A⁻¹(A - C))."""
    rough = GridField(rough_gap((16, 16), 0.0, 4).values + 0.05, (1.0, 0.7), periodic=True)
    gap = represented(rough, width=2)
    problem, pressures, streams = solved_on(gap, uniform_torus(gap.pixels, 2))
    A, C = upper_matrix(pressures), lower_matrix(streams)
    flows = problem.flows(pressures, streams)
    assert len(flows) == 2
    # All cells are open, so that the regularised dual is the true one.
    assert not problem.data.blocked.any()
    indicators, difference = error_indicators(problem, flows), np.trace(np.linalg.solve(A, A - C))
    assert indicators.min() >= -1e-9 * difference
    assert indicators.sum() == pytest.approx(difference, rel=SOLVER)


def test_two_pressures_that_differ_by_rounding_have_finite_weights():
    """Their Gram matrix, scaled, is one of ones: an eigenvalue is 0, or rounding below it."""
    for rounding in (0.0, 1e-16, -3e-16):
        energies = np.array([[4.0, 2.0 - rounding], [2.0 - rounding, 1.0]])
        assert np.isfinite(orthonormal(SimpleNamespace(energies=energies))).all()


@pytest.mark.parametrize("kind", ["indicators", "flux"])
def test_both_flows_count_in_what_is_halved_ahead(kind):
    """Every new cell whose sum over both flows, of the least indicators or of the fluxes of blocked
    cells, is as large as the smallest marked one, and no other."""
    gap = represented(rough_gap((32, 32), 0.25, 8, 2), cut=1e-3, width=8)
    problem, pressures, streams = solved_on(gap, uniform_torus(gap.pixels, 8), CHI)
    flows, start = problem.flows(pressures, streams), problem.start(pressures, streams)
    for flow in flows:
        np.testing.assert_allclose(flow.flux.weights @ start.streams, flow.stream, atol=1e-12)
    fluxes = [flow.flux for flow in flows]
    times = (np.arange(len(start.mesh.cells)) % 5 == 0).astype(np.int8)
    blind = refined_ahead(start, gap, Marks(times, np.inf, np.inf), fluxes, 1)
    mesh, data = blind.mesh, gap.cell_data(blind.mesh, blind.values)
    slopes, areas = shape_gradients(mesh.corners(gap.aspect, mesh.cells))
    R = data.regularised(CHI, gap.cut)
    indicators, total = np.zeros((2, len(mesh.cells)))
    for flux in fluxes:
        J = flux.rate * gradients(slopes, (flux.weights @ blind.streams)[mesh.cells])
        indicators += areas * least_indicator(J, data.K, R)
        total += flux.drop * np.hypot(*J.T) * np.sqrt(2 * areas)
    sums = indicators if kind == "indicators" else np.where(data.blocked, total, -np.inf)
    new = (mesh.cells >= len(start.mesh.xy)).any(axis=1) & (data.K > 0)
    sums = np.where(new, sums, -np.inf)
    for rank in (1, 5, 15):
        least = np.sort(sums)[-rank] * (1 - 1e-9)
        # A new cell is marked from half the smallest marked indicator on.
        marks = Marks(times, *((2 * least, np.inf) if kind == "indicators" else (np.inf, least)))
        ahead = refined_ahead(start, gap, marks, fluxes, 1)
        once = (sums >= least).astype(np.int8)
        assert once.sum() == rank
        np.testing.assert_array_equal(ahead.mesh.cells, blind.refined(gap, once).mesh.cells)
        assert ahead.mesh.edges.slots().min() >= 0


def test_functions_of_a_single_winding_are_exact_and_start_the_next():
    """An oblique channel. Corners of one unknown differ by the jumps of p across the seams, to the
    last digit: no other pressure is admissible. The start after a mesh holds the solutions of that
    mesh, so that CG has nothing left to do."""
    i, j = np.indices((16, 32))
    values = np.where((2 * i - j) % 32 < 12, 0.5 + rough_gap((16, 32), 0.0, 2).values, 0.0)
    gap = represented(GridField(values, (1.0, 1.0), periodic=True), "constant")
    problem, pressures, streams = solved_on(gap, uniform_torus(gap.pixels, 1))
    assert len(pressures.jumps) == len(streams.jumps) == 1
    (p,), across = pressures.minima, [Fraction(jump) for jump in pressures.jumps[0]]
    far = problem.mesh.on_far_seam[problem.mesh.cells[problem.kept]].reshape(-1, 2)
    of_unknown: dict[int, set[Fraction]] = {}
    for number, v, (x, y) in zip(
        p.numbering.of_corner.ravel().tolist(), p.corner_values.ravel(), far, strict=True
    ):
        stored = Fraction(v) - across[0] * int(x) - across[1] * int(y)
        of_unknown.setdefault(number, set()).add(stored)
    assert all(len(found) == 1 for found in of_unknown.values())
    start = problem.start(pressures, streams)
    again = problem.pressure(problem.guesses(start)), problem.stream(start.streams)
    assert [family.residuals for family in again] == [(), ()]


def test_small_energies_beside_large_ones():
    """C of the energies B of two unit jumps is B/det B, to a few roundings of √(C_ii C_jj)."""
    for ratio, mixed in ((1.0, -0.9), (1e12, 0.7), (1e12, 4e5), (1e24, -2.0), (1e24, 2e4)):
        B = np.array([[1.5, mixed], [mixed, 3 * ratio]])
        a, b, _, d = map(Fraction, B.ravel())
        exact = np.array([[float(x / (a * d - b * b)) for x in row] for row in ((a, b), (b, d))])
        found = lower_matrix(SimpleNamespace(jumps=np.eye(2), energies=B))
        scale = np.sqrt(np.outer(exact.diagonal(), exact.diagonal()))
        # With its diagonal scaled to ones B has a condition below 3, and a system of two equations
        # takes about ten steps.
        assert np.abs((found - exact) / scale).max() < 15 * np.finfo(float).eps
