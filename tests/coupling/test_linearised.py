"""The linear systems of Newton's step and of its adjoint, and the point that has them."""

import gc
from weakref import ref

import numpy as np
import pytest
from lifted_scenes import problem_of, scene

from fem_seal.coupling.point import LiftPoint

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
    air = {"kind": "gas", "viscosity": 1.8e-5, "molar_mass": 0.029, "temperature": 293}
    pressures = {"inlet_pressure": 1.6e5, "outlet_pressure": 1e5}
    return point_of(problem_of(scene(2e5, n=16, fluid=air, **pressures))).linear


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
