"""The linear systems of Newton's step and of its adjoint, GMRES, and the point that has them."""

import gc
from dataclasses import replace
from importlib import import_module
from weakref import ref

import numpy as np
import pytest
from lifted_scenes import E_STAR, problem_of, scene
from project import AIR

from fem_seal.contact.state import ContactState
from fem_seal.coupling.krylov import gmres
from fem_seal.coupling.linearised import Linearised, summed_by_parts
from fem_seal.coupling.newton import newton
from fem_seal.coupling.point import LiftPoint
from fem_seal.network.film_pressure import eliminated

TOLERANCE = 1e-9  # of GMRES; its operators are a tenth as inexact


def inexact(*pairs):
    """What two solves of a system and of its transpose may differ by: <s, x> - <y, r>.

    r and s are the parts that they leave of v and w; the pairs are (w, x) and (y, v).
    """
    return TOLERANCE * sum(np.linalg.norm(a) * np.linalg.norm(b) for a, b in pairs)


def point_of(problem):
    """Contact under half of the inlet's pressure, whose flow conducts in contact as well."""
    pressure = np.full(problem.height.shape, 0.5 * problem.inlet)
    contact = problem.contact_under(pressure)
    return LiftPoint(problem, problem.first_network, 0.02 * problem.roughness, pressure, contact)


@pytest.fixture(scope="module")
def linear():
    """That of a gas, whose pressure is not linear in the network's solution."""
    pressures = {"inlet_pressure": 1.6e5, "outlet_pressure": 1e5}
    return point_of(problem_of(scene(2e5, n=16, fluid=AIR, **pressures))).linear


@pytest.fixture
def changes():
    return np.random.default_rng(1).standard_normal((2, 16, 16))


def test_the_adjoint_is_the_transpose_of_the_step(linear, changes):
    """With (I - R' G') δ = b and (I - G' R'ᵀ) λ = G' q, ⟨λ, b⟩ = ⟨G' q, δ⟩."""
    step, moved = linear.solved(changes[0], TOLERANCE, 60)
    adjoint = linear.adjoint(TOLERANCE, 60)
    assert step.converged
    assert adjoint.converged
    by_step = np.vdot(linear.flow.log_rate_by_gap, moved)  # ⟨q, G' δ⟩, G' symmetric
    right_side = linear.gap_change(linear.flow.log_rate_by_gap, TOLERANCE)
    # A tenth more for the operators.
    room = 1.1 * inexact((right_side, step.x), (adjoint.x, changes[0]))
    assert np.vdot(adjoint.x, changes[0]) == pytest.approx(by_step, rel=0, abs=room)


def test_a_gas_that_slips_through_many_constrictions_of_one_gap():
    """Under a ridge across the flow all samples have the gap of the critical constriction.

    All gaps are widened together. The central differences of the fluid's pressure err by the square
    of their step, 1e-8, and by what rounding leaves, 1e-12 over the step.
    """
    step, drop = 1e-4, {"inlet_pressure": 1.6e5, "outlet_pressure": 1e5}
    made = problem_of(scene(2e5, n=16, fluid=AIR, **drop))
    problem = replace(made, solver=eliminated)
    gap = np.tile(1e-7 * (1.5 + np.cos(2 * np.pi * np.arange(16) / 16))[:, None], 16)

    def at(part):
        contact = ContactState.without_load(problem.field(part * gap), E_STAR)
        point = LiftPoint(problem, problem.first_network, 1e-10, np.zeros_like(gap), contact)
        assert np.count_nonzero(point.contact.gap.values == point.critical) == 16
        return point

    differences = (at(1 + step).residual - at(1 - step).residual) / (2 * step)
    found = at(1).linear.response(gap, TOLERANCE)
    assert found == pytest.approx(differences, rel=0, abs=1e-6 * abs(differences).max())


def test_a_point_is_freed_with_its_last_name():
    """On large grids each holds many arrays: none may wait for Python's search for cycles."""
    point = point_of(problem_of(scene(2e5, 6e4, n=16)))
    assert point.step.log_rate > 0
    assert point.linear is not None
    alive = ref(point)
    gc.disable()
    try:
        del point
        assert alive() is None
    finally:
        gc.enable()


def test_fewer_samples_that_alone_are_unstable_do_not_keep_the_steps_going(monkeypatch):
    """λ is then that of more samples. first.toml on 512², 0.22 MPa, took all 20 steps."""
    monkeypatch.setattr(import_module("fem_seal.coupling.problem"), "FIRST_NODES", 1500)
    problem = problem_of(scene(1.2e5, 6e4, n=16).with_({"surface.shape": [64, 64]}))
    adjoint, samples = Linearised.adjoint, []

    def judged(linear, *arguments):
        samples.append(linear.pressure_by_u.shape)
        return replace(adjoint(linear, *arguments), unstable=samples[-1] != (64, 64))

    monkeypatch.setattr(Linearised, "adjoint", judged)
    pressure, epsilon = np.zeros((64, 64)), 0.02 * problem.roughness
    network, contact = problem.first_network, problem.contact_under(pressure)
    point = LiftPoint(problem, network, epsilon, pressure, contact)
    assert not newton(point, problem.allowed).failure
    assert samples[-2:] == [(32, 32), (64, 64)]


def test_the_pressure_of_fewer_samples_is_interpolated_around_periodic_sides(monkeypatch):
    """Linear along the flow, up to the last row of fewer samples, and a cosine around."""
    monkeypatch.setattr(import_module("fem_seal.coupling.problem"), "FIRST_NODES", 500)
    problem = problem_of(scene())
    x, y = np.meshgrid(*[np.arange(32) / 32] * 2, indexing="ij")
    line, wave = 1 - x, (1 - x) * np.cos(2 * np.pi * y)
    line_error, wave_error = (
        np.abs(problem.interpolated(field[::2, ::2]) - field)[:-1].max() for field in (line, wave)
    )
    assert line_error <= 1e-15
    assert wave_error <= (2 * np.pi * 2 / 32) ** 2 / 8  # h² f''/8 with h = 2/32


def test_gmres_leaves_what_the_operator_returns():
    """The identity returns its argument, which belongs to the basis."""
    b = np.arange(1.0, 4.0)
    np.testing.assert_allclose(gmres(lambda x: x, b, 1e-12, 9).x, b, rtol=1e-15)


def test_changes_in_several_places_do_not_cancel():
    """Opposite ones at both ends count twice; noise within a part of the patch cancels."""
    changes = np.zeros((8, 8))
    changes[0, 0], changes[7, 7] = 1.0, -1.0
    assert summed_by_parts(changes) == 2
    assert summed_by_parts(np.tile([[1.0, -1.0]], (8, 4))) == 0
    assert summed_by_parts(np.ones((2, 3))) == 6  # each sample once, also of few


def test_newtons_step_leads_away_from_an_unstable_state():
    """Its part along an eigenvector with a negative eigenvalue is reversed, all others are kept."""
    rng = np.random.default_rng(2)
    vectors, values = rng.standard_normal((5, 5)), np.array([1.0, 0.5, -0.3, 2.0, 1.5])
    matrix, b = vectors @ np.diag(values) @ np.linalg.inv(vectors), rng.standard_normal(5)
    solved, away = (
        gmres(lambda x: matrix @ x, b, 1e-12, 9, to_stable=end) for end in (False, True)
    )
    assert solved.unstable
    # GMRES ends at 1e-12 of b; eigenvectors as skew as these cost two digits.
    np.testing.assert_allclose(matrix @ solved.x, b, atol=1e-10)
    parts = np.linalg.solve(vectors, solved.x) * np.sign(values)
    np.testing.assert_allclose(np.linalg.solve(vectors, away.x), parts, atol=1e-9)


@pytest.mark.parametrize("unit", [1.0, 1e-12])
def test_a_pair_of_complex_eigenvalues_is_no_instability(unit):
    """Whatever the unit of the operator: -1 ± i turn, and only a real one leads away."""
    matrix, b = unit * np.array([[-1.0, 1.0], [-1.0, -1.0]]), np.array([1.0, 0.0])
    solution = gmres(lambda x: matrix @ x, b, 1e-12, 9, to_stable=True)
    assert not solution.unstable
    np.testing.assert_allclose(matrix @ solution.x, b, atol=1e-14)


@pytest.mark.parametrize(
    ("matrix", "b"),
    [([[0.0, 1.0], [0.0, 0.0]], [1.0, 0.0]), ([[1.0, 0.0], [0.0, 0.0]], [1.0, 1.0])],
    ids=["nothing new", "rounding"],
)
def test_a_singular_operator_is_not_solved(matrix, b):
    """No vector of the Krylov space is new any more, and the residual is as large as before."""
    b = np.array(b)
    solution = gmres(lambda x: np.array(matrix) @ x, b, 0.1, 20)
    assert not solution.converged
    left = np.linalg.norm(matrix @ solution.x - b) / np.linalg.norm(b)
    assert left == pytest.approx(solution.residuals[-1])
    assert len(solution.residuals) <= 2
