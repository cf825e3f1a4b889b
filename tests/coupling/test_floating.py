"""A solid that rests on its film alone, without contact, and one that the film lifts off."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from lifted_scenes import problem_of, scene
from scipy.optimize import brentq

import fem_seal as fs
from fem_seal.coupling import lifted_state
from fem_seal.coupling.krylov import gmres
from fem_seal.coupling.linearised import Linearised
from fem_seal.coupling.newton import newton
from fem_seal.coupling.point import FloatingPoint, LiftPoint
from fem_seal.grid import GridField
from fem_seal.patch import Given, Patch


def test_a_solid_that_floats():
    """Between the load of a uniform film and the inlet's pressure the solid rests on its film.

    Without contact the gap is that of the fluid's pressure alone, which carries the whole load, to
    rounding.
    """
    load = 5.25e4
    patch = Patch(scene(load))
    state = patch.lifted
    assert state.converged
    assert state.floats
    assert state.contact.mean_pressure == 0
    assert state.fluid_load == pytest.approx(load, rel=1e-12)
    separation = state.contact.gap.values + patch.surface.values
    separation -= problem_of(patch.scene).displacement(state.fluid_pressure.values)
    assert np.ptp(separation) < 1e-9 * patch.surface.values.std()
    lighter = Patch(scene(0.995 * load)).lifted
    assert lighter.leak_rate.value > state.leak_rate.value
    assert lighter.contact.gap.values.mean() > state.contact.gap.values.mean()


def test_the_whole_answer_of_a_solid_that_floats():
    """Higher heights lower its leak rate, unlike that of a contact.

    On 16² samples a uniform film carries 53 kPa, more than the load, on 32² less.
    """
    of_all = scene(5.25e4, output={"products": ["leak_rate", "sensitivity"]})
    floating = fs.solve(of_all.with_({"tolerances": {"heights": "5 %"}}))
    assert floating.patch.lifted.floats
    assert floating.patch.sensitivity is None
    higher = fs.solve(scene(5.25e4).scaled({"heights": 1.08}))
    assert higher.headline.upper < floating.headline.lower
    assert next(entry for entry in floating.budget if entry.key == "inputs").kind == "not covered"
    chosen = fs.solve(of_all.with_({"flow.rtol": None, "accuracy": {"total": 0.9}}))
    assert chosen.leak_rate.state == "leaking"
    assert chosen.patch.surface.shape[0] >= 32


def floating(problem, network, pressure, separation):
    """A solid at a mean separation from its counter-face, under a fluid pressure."""
    touching = LiftPoint(problem, network, 1e-4 * problem.height.values.std(), pressure, None)
    gap = problem.displacement(pressure) - problem.height.values + separation
    return FloatingPoint.at_gap(touching, pressure, gap)


def floating_low(load):
    """A solid a tenth farther off than where it touches, under the pressure of a uniform film."""
    problem = problem_of(scene(load))
    pressure = problem.uniform_pressure
    separation = 1.1 * float((problem.height.values - problem.displacement(pressure)).max())
    return floating(problem, problem.first_network, pressure, separation)


@pytest.mark.parametrize("solved", [True, False])
def test_a_step_that_is_not_solved_tells_no_error_of_a_solid_that_floats(monkeypatch, solved):
    """Else its stages would end as settled, with whatever GMRES has left."""
    point = floating_low(5.2e4)

    def solution(*arguments, **settings):
        return replace(gmres(*arguments, **settings), converged=solved)

    monkeypatch.setattr(import_module("fem_seal.coupling.linearised"), "gmres", solution)
    assert np.isfinite(point.log_rate_error(replace(point))) == solved


def test_a_solid_that_floats_too_high_or_too_low_comes_to_its_separation():
    """Under the pressure of the equilibrium, whose load is right: the step lowers or raises ln Q.

    Gaps a tenth higher change ln Q by 3 ln 1.1 = 0.29, far beyond the tolerance of 0.01.
    """
    problem = problem_of(scene(5.25e4, rtol=0.02))
    state = lifted_state(problem)
    pressure, gap = state.fluid_pressure.values, state.contact.gap.values
    separation = float((gap + problem.height.values - problem.displacement(pressure)).mean())
    for rise in (0.9, 1.2):
        start = floating(problem, state.network, pressure, separation + (rise - 1) * gap.mean())
        steps = newton(start, start.problem.allowed)
        mean, before = (point.contact.gap.values.mean() for point in (steps.point, start))
        assert not steps.failure
        assert mean < before if rise > 1 else mean > before
        assert mean == pytest.approx(gap.mean(), rel=0.01)


def test_a_film_that_rises_at_most_doubles():
    """Without an equilibrium above: no separation carries more than the film of first touch does.

    Each of 20 steps at most doubles the film. p_f does not depend on a large separation, so that a
    whole step may leave double precision.
    """
    start = floating_low(9.5e4)
    gap = start.contact.gap.values.mean()
    high = start.after(replace(start.step, gap=np.full(start.pressure.shape, 1e300)))
    assert high.contact.gap.values.mean() == pytest.approx(2 * gap, rel=1e-9)
    steps = newton(start, start.problem.allowed)
    assert steps.failure
    assert steps.point.contact.gap.values.mean() < 2**21 * gap


def test_a_separation_that_is_no_number_or_changes_no_load(monkeypatch):
    """The first is no point; of the second the step is that at a fixed separation."""
    start = floating_low(9.5e4)
    assert floating(start.problem, start.network, start.pressure, np.nan) is None
    monkeypatch.setattr(Linearised, "response", lambda self, gap, tolerance: np.zeros_like(gap))
    # Displacements have no mean, to rounding.
    assert abs(start.step.gap.mean()) < 1e-12 * np.ptp(start.step.gap)
    np.testing.assert_allclose(start.step.pressure, start.residual, rtol=1e-14)  # rounding


def carried(gap):
    """Mean pressure in a film whose gap (n,) at n rows of vertices varies along the flow alone.

    In units of the inlet's: ∫ dx/g³ over a piece of the length 1 on which g goes from a to b is
    (a + b)/(2 a² b²). The last piece leads back to the first vertex.
    """
    after = np.roll(gap, -1)
    lost = np.cumsum((gap + after) / (gap * after) ** 2)
    return 1 - np.append(0, lost[:-1]).mean() / lost[-1]


def stiff(gap, load, inlet, modulus=1e13):
    """Scene and surface of a stiff solid that touches one sample of a face with gaps (n,) in 10 µm.

    The gap varies along the flow alone, but for that sample.
    """
    n = len(gap)
    values = -np.repeat(1e-5 * gap, n).reshape(n, n)
    values[n // 2, n // 2] = 0.0
    surface = GridField(values, (1e-3 / n, 1e-3 / n), True)
    return scene(load, inlet, n, solid={"contact_modulus": modulus}), surface


def test_a_stiff_wedge_floats_from_where_its_film_carries_the_load():
    """However stiff: its gap, and so ln Q, hardly changes before the contact is lost.

    It touches at one sample, a tent over 4 of the n² cells. Blocking a share f of the area takes
    about 2 f from the conductance. The solid's own deflection is of the order of P₀ L/E*.
    """
    n, load, height, modulus = 32, 1e5, 1e-5, 1e13
    wedge = 1 - 0.5 * np.arange(n) / n
    error = 2 * 4 / n**2 + load * 1e-3 / modulus / height
    for drop in (1.4, 1.6):
        lifting, surface = stiff(wedge, load, drop * load, modulus)
        state = Patch(lifting, given=Given(surface=surface)).lifted
        assert state.converged
        assert state.floats == (drop * carried(wedge) > 1)
        rise = state.contact.gap.values.min() / height
        assert state.fluid_load / (drop * load) == pytest.approx(carried(wedge + rise), rel=error)


@pytest.mark.parametrize(("rise", "lasts"), [(0.0703, False), (0.12, True), (1.0, True)])
def test_a_solid_does_not_float_where_a_rise_lets_the_fluid_carry_more(rise, lasts):
    """Behind a gate at the inlet the fluid carries more as the solid rises, and less far up.

    So it carries the load at two rises. The solid leaves the lower one: steps from there come to no
    equilibrium, or to the upper one, which lasts.
    """
    gap, share, load = np.ones(32), 0.58, 1e5
    gap[1], gap[-4:-1] = 0.05, 0.2
    crossed = [carried(gap + end) > share for end in (0.07, 0.071, 0.73, 0.76)]
    assert crossed == [False, True, True, False]
    problem = problem_of(*stiff(gap, load, load / share))
    lost = np.cumsum((gap + rise) ** -3)
    pressure = np.repeat(problem.inlet * (1 - lost / lost[-1]), 32).reshape(32, 32)
    start = floating(problem, problem.first_network, pressure, 1e-5 * rise)
    steps = newton(start, problem.allowed)
    assert (not steps.failure) == lasts
    if lasts:
        assert 0.73 < steps.point.contact.gap.values.min() / 1e-5 < 0.76


def test_a_contact_below_a_solid_that_floats_is_one_of_two_states():
    """Both are reported: the contact behind the gate, and the film that carries the same load.

    With the rise t the leak rate is W p_in/(12 η) over ∫ dx/(g + t)³.
    """
    gap, share, load = np.ones(32), 0.58, 1e5
    gap[1], gap[-4:-1] = 0.05, 0.2
    lifting, surface = stiff(gap, load, load / share)
    state = Patch(lifting, given=Given(surface=surface)).lifted
    rise = brentq(lambda t: carried(gap + t) - share, 0.73, 0.76)

    def leak(rise):
        low, high = gap + rise, np.roll(gap, -1) + rise
        resistance = ((low + high) / (low * high) ** 2).sum() / 2 / 1e-15 / len(gap)
        return load / share / (12e-3 * resistance)

    assert not state.converged
    assert "two equilibria, one in contact and one floating" in state.reason
    # In contact a tent at one sample takes up to twice its area from the conductance.
    error = state.error + lifting.flow.rtol + 2 * 4 / 32**2
    assert state.lowest == pytest.approx(leak(0), rel=error)
    assert state.highest == pytest.approx(leak(rise), rel=error)


def test_no_load_below_that_of_a_uniform_film_is_carried():
    """However thick the film, its pressure carries more."""
    limit = 1e5 * (1 + 1 / 32) / 2  # the mean of p in an even film on 32 rows of vertices
    off, floating = Patch(scene(0.999 * limit)), Patch(scene(1.005 * limit))
    assert (off.lifted_off, off.leak_rate.state) == (True, "lifted off")
    assert off.lifted.fluid_load >= 0.999 * limit
    assert floating.lifted.floats
    assert not floating.lifted_off
