"""Extremes, refusals, and failures that must be reported."""

from functools import partial

import numpy as np
import pytest
from contact_cases import E_STAR, SLOPE, SOLID, rough_surface
from project import refused_calls

from fem_seal.contact import Arithmetic, ElasticSolid, Layer, Load, bearing, press
from fem_seal.contact.halfspace import HalfSpace
from fem_seal.contact.methods import ContactStopping, converge
from fem_seal.contact.problem import Problem
from fem_seal.contact.state import ContactState
from fem_seal.contact.tangent import ContactTangent
from fem_seal.errors import Inconsistent, InvalidInput, NotConverged
from fem_seal.grid import GridField
from fem_seal.limits import Limits


def periodic(values):
    return GridField(np.asarray(values, dtype=float), (1.0, 1.0), periodic=True)


def test_one_sample_in_contact(rough):
    pressure = 1e-9 * E_STAR * SLOPE
    state = press(rough, SOLID, Load("pressure", pressure))
    peak = np.unravel_index(rough.values.argmax(), rough.shape)
    assert state.contact.sum() == 1
    assert state.contact[peak]
    assert state.pressure.values[peak] == pytest.approx(pressure * rough.values.size, rel=1e-12)


@pytest.mark.parametrize("load", [Load("pressure", 0), Load("area_fraction", 0)])
@pytest.mark.parametrize("start", [None, np.ones((64, 64))], ids=["alone", "on a path"])
def test_first_touch(rough, load, start):
    state = press(rough, SOLID, load, start=start)
    assert state.mean_pressure == 0
    assert np.array_equal(state.gap.values, rough.values.max() - rough.values)


def test_a_flat_surface_touches_everywhere():
    state = press(periodic(np.zeros((16, 16))), SOLID, Load("pressure", 1e3))
    assert state.contact_area_fraction == 1
    assert state.pressure.values == pytest.approx(1e3, rel=1e-12)


def test_apart(rough):
    """A mean gap larger than the highest peak: no contact at all."""
    wanted = 1.5 * rough.values.max()
    state = press(rough, SOLID, Load("mean_gap", wanted))
    assert state.contact_area_fraction == 0
    assert state.mean_gap == pytest.approx(wanted, rel=1e-13)


@pytest.mark.parametrize("load", [Load("pressure", 1e-3), Load("area_fraction", 0.2)])
@pytest.mark.parametrize("unit", [1e-306, 1e160])
def test_heights_whose_squares_are_no_numbers_are_refused(rough, unit, load):
    height = GridField(rough.values * unit, rough.spacing, periodic=True)
    with pytest.raises(InvalidInput, match="allowed is 1e-100 m to"):
        press(height, SOLID, load)


def test_a_tangent_out_of_reach_is_an_error(monkeypatch):
    """One step of conjugate gradients is not enough, and the message says that it was one."""
    monkeypatch.setattr("fem_seal.contact.tangent.MOST_CG", 1)
    opened = np.arange(64).reshape(8, 8) % 5 > 0
    tangent = ContactTangent(HalfSpace((8, 8), (1.0, 1.0)), 1.0, opened)
    with pytest.raises(NotConverged, match=r"residual [\d.e-]+ after 1 iteration \(wanted 1.0e-12"):
        tangent.change(np.arange(64.0).reshape(8, 8), 1e-12)


@pytest.mark.parametrize("solver", ["free-set-cg", "fista"])
def test_stagnation_raises(rough, solver):
    """A huge load drowns the roughness in rounding: the method says so instead of running on."""
    stopping = ContactStopping(solver, tolerance=1e-10)
    with pytest.raises(NotConverged, match=r"no longer falls.* rounding errors of so high"):
        press(rough, SOLID, Load("pressure", 1e9 * E_STAR), stopping)


@pytest.mark.parametrize(
    ("solver", "load"), [("free-set-cg", "mean_pressure"), ("damped", "mean_gap")]
)
def test_numbers_that_overflow_are_named(solver, load):
    heights, half_space = np.array([[1.0, -1.0], [-1.0, 1.0]]), HalfSpace((2, 2), (1.0, 1.0))
    problem = Problem(heights, half_space, **{load: 0.5})
    with pytest.raises(NotConverged, match=r"not a number after 0 iterations, since .*overflowed"):
        converge(problem, np.full((2, 2), np.nan), ContactStopping(solver))


@pytest.mark.parametrize("loads", [(None, None), (1.0, 1.0), (0.0, None), (None, np.nan)])
def test_a_contact_problem_has_one_load(loads):
    with pytest.raises(Inconsistent, match="a mean pressure or a mean gap > 0"):
        Problem(np.zeros((2, 2)), HalfSpace((2, 2), (1.0, 1.0)), *loads)


@pytest.mark.parametrize(
    ("gap", "pressure", "message"),
    [
        ([[1e-6, -1e-9]], [[0.0, 0.0]], "gap of a contact is negative: -1e-09 m"),
        ([[1e-6, 0.0]], [[0.0, -1.0]], "pressure of a contact is negative: -1 Pa"),
        ([[1e-6, 0.0]], [[1.0, 0.0]], "pressure where its gap is open"),
        # Their product is below the least number.
        ([[1e-200, 0.0]], [[1e-200, 0.0]], "pressure where its gap is open"),
        ([[1e-6, 0.0]], [[0.0], [0.0]], r"have \(1, 2\) and \(2, 1\) samples"),
    ],
)
def test_a_state_that_is_no_contact_is_refused(gap, pressure, message):
    fields = (GridField(np.array(values), (1.0, 1.0), True) for values in (gap, pressure))
    with pytest.raises(Inconsistent, match=message):
        ContactState(*fields, E_STAR)
    flat, finer = (GridField(np.zeros((2, 2)), (dx, dx), True) for dx in (1.0, 0.5))
    with pytest.raises(Inconsistent, match="another spacing"):
        ContactState(flat, finer, E_STAR)


def test_progress_hears_every_iteration(rough):
    """And the last one is the first below the default tolerance, 1e-6."""
    heard = []
    stopping = ContactStopping(progress=lambda *measured: heard.append(measured))
    state = press(rough, SOLID, Load("pressure", 1e4), stopping)
    assert [k for k, _ in heard] == list(range(state.iterations + 1))
    assert tuple(error for _, error in heard) == state.residuals
    assert state.residuals[-1] <= 1e-6 < state.residuals[-2]


NAN = float("nan")
ROUGH = rough_surface()
ROUGH_GAP = GridField(ROUGH.values - ROUGH.values.min(), ROUGH.spacing, ROUGH.periodic)


def pressed(height=ROUGH, start=None):
    return press(height, SOLID, Load("pressure", 1e4), start=start)


test_refused = refused_calls(
    (partial(Load, "pressure", -1.0), "pressure = -1.0 must be a finite number >= 0"),
    (partial(Load, "area_fraction", 1.0), "area_fraction"),
    (partial(Load, "mean_gap", 0.0), "mean_gap"),
    (partial(ContactState.without_load, ROUGH_GAP, 0.0), "contact_modulus"),
    (partial(pressed, height=np.ones((8, 8))), "make it a GridField"),
    (partial(pressed, height=GridField(np.ones((8, 8)), (1.0, 1.0))), "periodic"),
    (partial(pressed, height=periodic([[1.0]])), "more than one sample"),
    (partial(ContactStopping, "newton"), "free-set-cg, damped, fista, polonsky-keer"),
    (partial(ContactStopping, tolerance=1e-15), "tolerance must lie in"),
    (partial(ContactStopping, max_iterations=0), "max_iterations"),
    (partial(pressed, start=np.ones((3, 3))), "start"),
    (partial(pressed, start=np.full((64, 64), -1.0)), "start"),
    (partial(bearing, ROUGH), "exactly one load.*none"),
    (partial(bearing, ROUGH, area_fraction=0.1, mean_gap=1.0), "exactly one load"),
    (partial(Layer, NAN), "thickness"),
    (partial(Layer, 1.0, "glued"), "fixed, sliding"),
    (partial(Layer, 1.0, "fixed", 0.6), "poisson_ratio"),
    (partial(Load, "presure", 1.0), "load = 'presure' is unknown; choose from pressure"),
    (partial(ElasticSolid, -5.0), "contact_modulus = -5.0 must be a positive number"),
    (partial(Arithmetic, None, "single"), "precision = 'single' is unknown; choose from do"),
    (partial(Arithmetic, NAN), "threads = nan must be a whole number"),
    (partial(ContactStopping, "free-set-cg", 1e-6, 1.5), r"max_iterations = 1\.5 must be a"),
    (partial(Limits, 2.5), r"unknowns = 2\.5 must be a whole number >= 1"),
)
