"""The stages of a lift, from two starts: where they begin, what they claim, and why they end."""

from dataclasses import replace
from functools import partial
from importlib import import_module
from itertools import combinations, count
from unittest.mock import Mock

import numpy as np
import pytest
from lifted_scenes import from_pressure, problem_of, scene
from project import FIRST

import fem_seal as fs
from fem_seal.accuracy import flow_log_error
from fem_seal.coupling import lifted_state, search, stages
from fem_seal.coupling.newton import equilibrium, newton
from fem_seal.coupling.point import LiftPoint
from fem_seal.coupling.search import _merged
from fem_seal.leak_rate import log_ratio
from fem_seal.network.network import Network


@pytest.fixture
def steps_of_stages(monkeypatch):
    """Function that lets a rule change the steps of each stage; it gives the stages' first points.

    The rule takes the first point and the steps, and returns the fields to be replaced.
    """

    def changed_by(rule):
        points = []

        def changed(point, tolerance):
            points.append(point)
            steps = equilibrium(point, tolerance)
            return replace(steps, **rule(point, steps))

        monkeypatch.setattr(stages, "equilibrium", changed)
        return points

    return changed_by


@pytest.mark.slow
def test_a_channel_that_coarse_networks_miss():
    """On the first networks the film is sealed, and stays so under the most fluid pressure.

    With a node for each sample it opens at an ε of a thousandth of the rms height, and the
    equilibria with smaller ε leak.
    """
    settings = ["surface.shape=[256, 256]", "surface.seed=5", "contact.pressure=0.30 MPa"]
    problem = problem_of(fs.Scene.from_file(FIRST, settings))
    pressure = np.full(problem.height.shape, problem.outlet)
    network = Network.uniform(problem.touching_film, 1)
    closer = replace(problem, settings=replace(problem.settings, rtol=0.01))
    for epsilon in problem.roughness * np.geomspace(0.02, 3e-4, 7):
        contact = problem.contact_under(pressure)
        steps = newton(LiftPoint(closer, network, epsilon, pressure, contact), closer.allowed)
        pressure = steps.point.pressure
    assert not steps.failure
    assert not steps.point.sealed
    assert lifted_state(problem).state == "leaking"


SEALED_AT_LAST = {"n": 16, "load": 5e5, "inlet": 3e5, "seed": 2}


@pytest.mark.parametrize("failure", ["", "no equilibrium"])
def test_stages_end_with_the_least_epsilon(steps_of_stages, monkeypatch, failure):
    """Sealed until a quarter of ε has a cube below the rounding of g³: it may leak all the same.

    With three stages allowed after the first, the search ends after the third: not settled.
    """
    if failure:
        monkeypatch.setattr(stages, "MOST_STAGES", 3)
    problem = problem_of(scene(**SEALED_AT_LAST))
    points = steps_of_stages(lambda *_: {"failure": failure, "lost": bool(failure)})
    state = from_pressure(problem, problem.outlet)
    assert state.converged is not bool(failure)
    assert state.state == "sealed"
    assert state.is_range
    rounding = np.cbrt(np.finfo(float).eps) * problem.height.values.std()
    epsilons = [point.epsilon for point in points]
    if failure:
        assert len(epsilons) == 4
    else:
        assert epsilons[-1] / 4 < rounding <= epsilons[-1] == min(epsilons)


@pytest.mark.parametrize("last", [1 / 4, 4])
def test_a_sealed_film_keeps_its_last_equilibrium(steps_of_stages, last):
    """No smaller ε than `last` times that with which a film must be sealed has an equilibrium.

    With the larger one the fluid may not reach a channel that it would open: not settled.
    """
    problem = problem_of(scene(**SEALED_AT_LAST))
    least = last * stages.SEALED_EPSILON * problem.roughness
    lost = {"failure": "no equilibrium", "lost": True}
    steps_of_stages(lambda point, steps: {} if point.epsilon >= least else lost)
    state = from_pressure(problem, problem.outlet)
    assert state.state == "sealed"
    assert state.is_range
    assert state.highest > 0
    assert state.converged is (last < 1)


def test_steps_that_miss_a_small_tolerance_settle_to_what_is_allowed():
    """No step changes ln Q by nothing at all; twenty are difficult."""
    problem = problem_of(scene(n=16, load=1.2e5, inlet=6e4, seed=3))
    pressure = np.full(problem.height.shape, problem.outlet)
    contact, epsilon = problem.contact_under(pressure), 0.02 * problem.roughness
    start = LiftPoint(problem, problem.first_network, epsilon, pressure, contact)
    steps, allowed = newton(start, 0.0), newton(start, problem.allowed)
    assert (steps.failure, steps.difficult, allowed.difficult) == ("", True, False)
    apart = np.log(steps.point.flow.conductance / allowed.point.flow.conductance)
    assert abs(apart) <= problem.allowed


def test_networks_that_change_ever_more_end_the_search(steps_of_stages, monkeypatch):
    """The sum of what all finer networks would change is then not known."""
    powers = count(1)
    monkeypatch.setattr(LiftPoint, "log_rate_change_to", lambda *_: 2.0 ** next(powers))
    points = steps_of_stages(lambda *_: {})
    problem = problem_of(scene(n=16, load=1.2e5, inlet=6e4, seed=3))
    state = from_pressure(problem, problem.outlet)
    assert not state.converged
    assert "changes the leak rate more than the one before" in state.reason
    # Of four networks with one ε the third and fourth change ln Q by more: that is not solved.
    epsilons = [point.epsilon for point in points]
    assert epsilons.count(epsilons[-1]) == 3


def test_difficult_stages_claim_no_less_than_they_have_changed(steps_of_stages):
    """What a stage changes to first order is then no measure: its solution has to tell."""
    problem = problem_of(scene(n=32, load=1.2e5, inlet=7.2e4, seed=4))
    changes = []

    def difficult(point, steps):
        changes.append(abs(np.log(steps.point.flow.conductance / point.flow.conductance)))
        return {"difficult": True}

    steps_of_stages(difficult)
    state = from_pressure(problem, problem.outlet)
    assert state.converged
    assert len(changes) > 1
    assert state.error >= changes[-1]


@pytest.mark.parametrize(
    ("pressures", "lost", "first", "further"),
    [((5e6, 1e5), False, 1, 1), ((3e5, 2.5e5), False, 2, 1), ((3e5, 2.5e5), True, 2, 2)],
    ids=["never opens", "the same first stages", "lost"],
)
def test_how_far_the_second_start_goes(
    steps_of_stages, monkeypatch, pressures, lost, first, further
):
    """A film that never opens needs none, and one like the first goes on only if that was lost.

    The next stages of both are then not the same, although their first ones are.
    """
    begun, gone_on = Mock(wraps=stages.first_stage), Mock(wraps=stages.further_stages)
    monkeypatch.setattr(search, "first_stage", begun)
    monkeypatch.setattr(search, "further_stages", gone_on)
    steps_of_stages(lambda *_: {"lost": lost})
    lifted_state(problem_of(scene(*pressures, n=16)))
    assert (begun.call_count, gone_on.call_count) == (first, further)


def test_a_thinned_problem_leads_to_the_same_state(monkeypatch):
    """Sixteen samples in the shortest wave, four of them in the thinned problem.

    With fewer contacts on all samples, one at least, and within what both claim.
    """
    fine = scene(1.2e5, 6e4, n=16).with_({"surface.shape": [64, 64]})
    states, contacts = [], []
    for nodes in (4096, 300):
        monkeypatch.setattr(import_module("fem_seal.coupling.problem"), "FIRST_NODES", nodes)
        problem = problem_of(fine)
        press = Mock(wraps=problem.press)
        states.append(lifted_state(replace(problem, press=press)))
        shapes = [heights.shape for (heights, *_), _ in press.call_args_list]
        contacts.append(shapes.count((64, 64)))
    every, thinned = states
    assert every.converged
    assert thinned.converged
    assert thinned.contact.gap.values.shape == (64, 64)
    assert 1 <= contacts[1] < contacts[0]
    apart = abs(np.log(every.leak_rate.value / thinned.leak_rate.value))
    # Each flow is known to half of rtol.
    assert apart <= every.error + thinned.error + 0.05


NEXT_TO_CLOSING = ["surface.shape=[128, 128]", "surface.seed=3", "contact.pressure=0.30 MPa"]


@pytest.mark.parametrize(
    ("made", "settled"),
    [
        (partial(scene, seed=3, load=1.2e5, inlet=6e4, rtol=0.02), 2),
        # Steps are difficult from the first ε on. If later stages are solved to the whole tolerance
        # only, it opens and closes from one to the next. By the last digits of a contact one start
        # may need more than ten stages.
        pytest.param(
            partial(fs.Scene.from_file, FIRST, NEXT_TO_CLOSING), 1, marks=pytest.mark.slow
        ),
    ],
    ids=["open", "next to closing"],
)
def test_both_starts_come_to_one_state(made, settled):
    """From the outlet's, from the inlet's and from both pressures: the same to what is claimed."""
    problem = problem_of(made())
    whole = lifted_state(problem)
    assert whole.converged
    low, high = (from_pressure(problem, end) for end in (problem.outlet, problem.inlet))
    assert low.converged + high.converged >= settled
    for pair in combinations((whole, low, high), 2):
        claimed = sum(state.error + flow_log_error(state.leak_rate) for state in pair)
        assert log_ratio(*(state.leak_rate.value for state in pair)) <= claimed


def test_a_loose_tolerance_claims_what_the_first_order_tells():
    """At rtol = 1 half of it would be allowed, too much for a linear estimate: e^0.5 is 1.65.

    An estimate of at most 0.15 of ln Q errs by about its square, 0.02.
    """
    problem = problem_of(scene(2.2e5, n=64))
    loose, tight = (
        lifted_state(replace(problem, settings=replace(problem.settings, rtol=rtol)))
        for rtol in (1.0, 0.05)
    )
    assert loose.converged
    assert tight.converged
    assert 0 < tight.error < loose.error <= 0.15
    rates = [problem.flow(problem.film(one.contact.gap), 0.0).value for one in (loose, tight)]
    assert abs(np.log(rates[0] / rates[1])) <= loose.error + tight.error


def test_pixels_that_meet_in_corners():
    """There the pressure is singular: the triangles around must become much smaller than others.

    Halved once a stage, as the others are, they kept ten networks from settling.
    """
    loose, tight = (
        lifted_state(problem_of(scene(3e5, 1.2e5, 16, 21, representation="constant", rtol=rtol)))
        for rtol in (0.05, 0.02)
    )
    assert loose.converged
    claimed = sum(state.error + flow_log_error(state.leak_rate) for state in (loose, tight))
    assert log_ratio(loose.leak_rate.value, tight.leak_rate.value) <= claimed


def test_two_sealed_films_keep_the_range_of_either():
    """What opens the film of one start may open that of the other."""
    sealed = lifted_state(problem_of(scene(3e5, n=16)))
    assert sealed.state == "sealed"
    for highest in ((1e-18, 0.0), (0.0, 1e-18)):
        both = _merged(*(replace(sealed, highest=h) for h in highest), in_equilibrium=True)
        assert (both.converged, both.highest) == (True, 1e-18)
