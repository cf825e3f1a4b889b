"""What makes the bracket a certificate: indicators, refinement and sloppy solvers."""

from itertools import product

import numpy as np
import pytest
from gaps import (
    Random,
    assert_enclosed,
    bracketed,
    everything,
    level_problem,
    plain_bounds,
    represented,
    solved,
    stiffness,
)
from nested_meshes import areas
from sample_gaps import rough_gap
from scipy.sparse.linalg import spsolve

from fem_seal.film import GridFilm
from fem_seal.flow import Tuning
from fem_seal.flow.field import boundary_flows
from fem_seal.flow.level import LevelProblem
from fem_seal.grid import GridField

# --- against an assembly of our own ------------------------------------------------------------


def by_hand(problem: LevelProblem, coefficient: np.ndarray, given: np.ndarray, value: np.ndarray):
    """Minimum of ∫ c|∇v|² over P1 functions with given vertex values: scipy, direct solver."""
    A, v = stiffness(problem.mesh, coefficient), np.where(given, value, 0.0)
    v[~given] = spsolve(A[~given][:, ~given], -(A @ v)[~given])
    return v @ (A @ v)


@pytest.mark.parametrize("seed", range(3))
def test_both_minima_against_a_direct_solver(seed):
    """Open gap, side walls, bisected at random. CG is within 2e-8 of the minimum."""
    samples = np.random.default_rng(seed).uniform(0.2, 1, (7, 6))
    gap = represented(GridField(samples, (1.0, 1.0)))
    problem = level_problem(gap, markings=[Random(seed)] * 4)
    mesh, g = problem.mesh, problem.vertex_gap[problem.mesh.cells]
    # Mean of g³ by the seven-point rule that is exact for cubics.
    middles = (g[:, [0, 1, 2]] + g[:, [1, 2, 0]]) / 2
    cube = 8 * (middles**3).sum(1) + 3 * (g**3).sum(1) + 27 * g.mean(1) ** 3
    upper = by_hand(problem, cube / 60, mesh.inlet | mesh.outlet, mesh.inlet)
    lower = 1 / by_hand(problem, 1 / g.prod(1), mesh.bottom | mesh.top, mesh.top)
    assert plain_bounds(problem) == pytest.approx([lower, upper], rel=4e-8)


# --- indicators --------------------------------------------------------------------------------


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("contact", [0.0, 0.3])
@pytest.mark.parametrize(
    ("tolerance", "spacing"), [(1e-8, (1.0, 1.0)), (1e-1, (1.0, 1.0)), (1e-8, (5.0, 1.0))]
)
def test_indicators_are_positive_and_sum_to_the_difference(
    representation, periodic, contact, tolerance, spacing
):
    """Prager and Synge: e_T ≥ 0 and Σ e_T = upper - lower, for any admissible pair, converged or
    not; power traces, blocked cells and cuts included. Sums of 10³ terms: 1e-12 of the upper."""
    limits = {"cut": 0.02, "floor": 0.02} if contact else {}
    rough = GridField(rough_gap((16, 16), contact, 5).values, spacing, periodic=True)
    gap = represented(rough, representation, width=2, **limits)
    markings = [everything, *([Random(1)] * 5)]
    problem = level_problem(gap, 2, periodic, tolerance, markings)
    pressure, stream = solved(problem)
    indicators = problem.indicators(problem.flows(pressure, stream))
    assert indicators.min() > -1e-12 * pressure.energies.item()
    difference = pressure.energies.item() - stream.conductance
    assert indicators.sum() == pytest.approx(difference, abs=1e-12 * pressure.energies.item())
    assert 0 < stream.conductance < pressure.energies.item()
    if contact and representation == "linear":
        number = problem.data.contact_vertex.sum(axis=1)
        assert {0, 1, 2} <= set(number)  # all kinds of traces took part


def test_depth_ends_with_the_bounds_so_far():
    """A corner of four fields of contrast 1e6, p ~ r^0.0013: triangles of 2^-24 pixels do not do.
    The bounds reached by then are returned, and the reason. (A small θ keeps the mesh small.)"""
    gap = GridField(np.array([[1.0, 1e-2], [1e-2, 1.0]]), (1.0, 1.0))
    film, tuning = GridFilm(gap, representation="constant"), Tuning(theta=0.1)
    flow = bracketed(film, 0.1, unknowns=None, tuning=tuning)
    assert not flow.converged
    assert "2^-24" in flow.reason
    assert 0 < flow.lower <= 1e-3 <= flow.upper
    assert flow.field is None


# --- refinement and tolerance ------------------------------------------------------------------


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("contact", [0.0, 0.25])
def test_nested_meshes_have_nested_bounds(representation, contact):
    """Plain minima over growing spaces: the upper bound falls, and without power traces the lower
    one rises, on any bisection, starting from squares four pixels wide. CG errs by 2e-8."""
    gap = represented(rough_gap((16, 16), contact, 3), representation, width=4)
    bounds = []
    for steps in range(8):
        problem = level_problem(gap, 4, True, 1e-8, [Random(4 + k) for k in range(steps)])
        pressure, stream = solved(problem)
        bounds.append([stream.conductance if stream else 0.0, pressure.energies.item()])
    lower, upper = np.transpose(bounds)
    assert (upper[1:] <= upper[:-1] * (1 + 4e-8)).all()
    assert upper[-1] < upper[0]
    if not contact or representation == "constant":
        assert (lower[1:] >= lower[:-1] * (1 - 4e-8)).all()
        assert lower[-1] > lower[0]


@pytest.mark.parametrize("sides", ["wall", "periodic"])
@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_a_sloppy_solver_widens_the_bracket_but_keeps_it(sides, representation):
    """Whatever CG left undone, both bounds are energies of admissible functions."""
    film = GridFilm(rough_gap((12, 12), 0.25, 9), sides, representation)
    exact = bracketed(film, 0.02, 6000)
    for tolerance, method in product([1e-3, 0.1, 10.0], ["uniform", "adaptive"]):
        sloppy = bracketed(film, 0.02, 1500, method=method, tuning=Tuning(tolerance=tolerance))
        assert_enclosed(sloppy, exact.lower, exact.upper)
        # CG really stopped early: the tolerance is not decoration.
        assert sloppy.levels[0].iterations["primal"] <= exact.levels[0].iterations["primal"]


@pytest.mark.parametrize("tolerance", [1e-2, 1e-5, 1e-8])
@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("periodic", [False, True])
def test_inflow_is_outflow(tolerance, representation, periodic):
    """in - out = a(p, w) with w = 1 on inlet and outlet, 0 at the unknowns; it vanishes for the
    minimiser p*, so |in - out| ≤ ‖p - p*‖ ‖w‖ in the energy norm, and ‖p - p*‖² is at most
    2 · tolerance of the energy (estimated within a factor of two)."""
    gap = represented(rough_gap((14, 14), 0.25, 12), representation)
    problem = level_problem(gap, 1, periodic, tolerance, [Random(0)] * 2)
    pressure, _ = solved(problem)
    into, out = boundary_flows(problem, pressure)
    numbering = problem.primal_numbering
    slope = problem.gradients((numbering.of_corner < 0).astype(float))
    area = areas(problem.mesh)[problem.kept]
    size_of_w = np.sqrt((problem.data.K * area * (slope**2).sum(axis=1)).sum())
    energy = pressure.energies.item()
    error = np.sqrt(2 * tolerance * energy)
    assert abs(into - out) <= error * size_of_w
    # Each of them is the leak rate of the discrete problem, by the same argument.
    assert abs(into - energy) <= error * size_of_w + 2 * tolerance * energy
    assert into > 0
