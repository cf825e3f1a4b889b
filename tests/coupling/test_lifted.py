"""Contact and flow in one equilibrium, against closed forms, theorems and other solvers."""

from dataclasses import replace
from functools import partial
from importlib import import_module
from itertools import combinations, count
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from lifted_scenes import E_STAR, problem_of, scene
from scipy import sparse

import fem_seal as fs
from fem_seal.accuracy import flow_log_error
from fem_seal.contact import ElasticSolid, Load, press
from fem_seal.coupling import lifted, stages
from fem_seal.coupling.krylov import gmres
from fem_seal.coupling.lifted import _merged
from fem_seal.coupling.linearised import Linearised, summed_by_parts
from fem_seal.coupling.newton import equilibrium, newton
from fem_seal.coupling.point import FloatingPoint, LiftPoint
from fem_seal.coupling.state import log_ratio
from fem_seal.errors import Inconsistent, InvalidInput, NotConverged
from fem_seal.grid import GridField
from fem_seal.network.film_pressure import eliminated
from fem_seal.network.network import MeshNetwork
from fem_seal.patch import Patch
from fem_seal.quantities.lift import lift_range

FIRST = Path(__file__).parents[2] / "demos" / "scenes" / "first.toml"


def from_pressure(problem, pressure):
    """The state from a uniform fluid pressure."""
    return lifted(problem, start=np.full(problem.height.shape, pressure))


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


def test_uniform_fluid_pressure_is_a_dry_contact_under_the_rest_of_the_load():
    """Inlet a millionth above the outlet, both far above ambient: dry contact under P₀ - p_f."""
    load, fluid = 2e5, 8e4
    patch = Patch(
        scene(load, inlet_pressure=fluid * (1 + 1e-6), outlet_pressure=fluid, ambient_pressure=0)
    )
    dry = press(patch.surface, ElasticSolid(E_STAR), Load("pressure", load - fluid))
    assert dry.contact_area_fraction < 0.8 * patch.contact.contact_area_fraction
    # The gap is known to the certificate, 1e-6 of the energy: 1e-3 of the rms height.
    atol = 1e-3 * patch.surface.values.std()
    np.testing.assert_allclose(patch.film.gap.values, dry.gap.values, atol=atol)
    assert patch.lifted.converged
    assert patch.lifted.contact.mean_pressure == pytest.approx(load - fluid, rel=1e-5)


GAS = {"kind": "gas", "viscosity": 1.8e-5, "molar_mass": 0.029, "temperature": 293.0}
DIFFERENT = (
    {"sides": "wall", "representation": "constant"},
    {"method": "finite-difference"},
    {"load": 1.5e5, "inlet": 1.4e5},
    {"load": 3e5, "inlet": 2.5e5},  # the first of the three is sealed
    {"load": 1.6e5, "fluid": GAS, "inlet_pressure": 2e5, "outlet_pressure": 1e5},
    {"inlet_pressure": 1e5, "outlet_pressure": 2e4, "ambient_pressure": 1e5, "load": 1.5e5},
)


@pytest.mark.parametrize("settings", DIFFERENT, ids=str)
def test_range_encloses_resolved(settings):
    """Dry contacts under P₀ - p_out and P₀ - p_in leak no more and no less than the lifted one."""
    resolved = Patch(scene(n=16, **settings))
    low, high = lift_range(Patch(scene(n=16, **settings, lift="range")))
    assert resolved.lifted.converged
    rates = low, resolved.leak_rate, high
    if settings.get("method") == "finite-difference":
        lower = upper = [rate.value for rate in rates]
    else:
        lower, upper = zip(*(rate.bounds for rate in rates), strict=True)
    assert upper[0] < lower[2]  # or nothing is shown
    assert lower[0] <= upper[1]
    assert lower[1] <= upper[2]


@pytest.mark.parametrize(
    ("n", "load", "inlet", "shares"),
    [
        (16, 4.5e5, 3e5, (0.6,)),
        pytest.param(16, 5e5, 3.5e5, (0.3, 0.6, 0.9), marks=pytest.mark.slow),
        pytest.param(32, 4.5e5, 3e5, (0.3, 0.6, 0.9), marks=pytest.mark.slow),
    ],
)
def test_an_almost_sealed_film(n, load, inlet, shares):
    """Sealed when dry, open under the inlet's pressure, and all but sealed at the equilibrium.

    A tenth of the upper end's gap would be a thousandth of its leak rate. From no start does it
    settle in a film that leaks.
    """
    settings = {"n": n, "load": load, "inlet": inlet}
    state, problem = Patch(scene(**settings)).lifted, problem_of(scene(**settings))
    low, high = lift_range(Patch(scene(**settings, lift="range")))
    assert low.state == "sealed"
    assert state.leak_rate.value < 1e-3 * high.value
    assert state.lowest <= state.leak_rate.value <= state.highest
    states = state, *(from_pressure(problem, share * problem.inlet) for share in shares)
    assert {one.state for one in states if one.converged} == {"sealed"}


@pytest.mark.slow
def test_a_channel_that_coarse_networks_miss():
    """On the first networks the film is sealed, and stays so under the most fluid pressure.

    With a node for each sample it opens at an ε of a thousandth of the rms height, and the
    equilibria with smaller ε leak.
    """
    settings = ["surface.shape=[256, 256]", "surface.seed=5", "contact.pressure=0.30 MPa"]
    problem = problem_of(fs.Scene.from_file(FIRST, settings))
    pressure = np.full(problem.height.shape, problem.outlet)
    network = MeshNetwork.uniform(problem.touching_film, 1)
    closer = replace(problem, settings=replace(problem.settings, rtol=0.01))
    for epsilon in problem.roughness * np.geomspace(0.02, 3e-4, 7):
        contact = problem.contact_under(pressure)
        steps = newton(LiftPoint(closer, network, epsilon, pressure, contact), closer.allowed)
        pressure = steps.point.pressure
    assert not steps.failure
    assert not steps.point.sealed
    assert lifted(problem).state == "leaking"


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
    least = last * stages.SEALED * problem.roughness
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
    module = import_module("fem_seal.coupling.lifted")
    begun, gone_on = Mock(wraps=stages.first_stage), Mock(wraps=stages.further_stages)
    monkeypatch.setattr(module, "first_stage", begun)
    monkeypatch.setattr(module, "further_stages", gone_on)
    steps_of_stages(lambda *_: {"lost": lost})
    lifted(problem_of(scene(*pressures, n=16)))
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
        states.append(lifted(replace(problem, press=press)))
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


def test_fewer_samples_that_alone_are_unstable_do_not_keep_the_steps_going(monkeypatch):
    """λ is then that of more samples. README's scene on 512², 0.22 MPa, took all 20 steps."""
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


def test_what_cannot_be_solved_is_refused():
    """A start that leaves nothing of the load to the solid, and a singular matrix.

    SciPy's words say nothing about a film.
    """
    problem = problem_of(scene(n=16, load=1e5, inlet=1.5e5))
    start = np.full(problem.height.shape, problem.inlet)
    with pytest.raises(InvalidInput, match="start: a mean pressure of 150000 Pa carries the whole"):
        lifted(problem, start=start)
    with pytest.raises(NotConverged, match="conductances are so far apart"):
        eliminated(sparse.csr_array((2, 2)))


def test_changes_in_several_places_do_not_cancel():
    """Opposite ones at both ends count twice; noise within a part of the patch cancels."""
    changes = np.zeros((8, 8))
    changes[0, 0], changes[7, 7] = 1.0, -1.0
    assert summed_by_parts(changes) == 2
    assert summed_by_parts(np.tile([[1.0, -1.0]], (8, 4))) == 0
    assert summed_by_parts(np.ones((2, 3))) == 6  # each sample once, also of few


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
    whole = lifted(problem)
    assert whole.converged
    low, high = (from_pressure(problem, end) for end in (problem.outlet, problem.inlet))
    assert low.converged + high.converged >= settled
    for pair in combinations((whole, low, high), 2):
        claimed = sum(state.error + flow_log_error(state.leak_rate) for state in pair)
        assert log_ratio(*(state.leak_rate.value for state in pair)) <= claimed


def test_a_leak_rate_outside_its_range_is_refused():
    state = lifted(problem_of(scene(inlet=1e4, n=16)))
    with pytest.raises(Inconsistent):
        replace(state, highest=0.0)


def test_a_loose_tolerance_claims_what_the_first_order_tells():
    """At rtol = 1 half of it would be allowed, too much for a linear estimate: e^0.5 is 1.65.

    An estimate of at most 0.15 of ln Q errs by about its square, 0.02.
    """
    problem = problem_of(scene(2.2e5, n=64))
    loose, tight = (
        lifted(replace(problem, settings=replace(problem.settings, rtol=rtol)))
        for rtol in (1.0, 0.05)
    )
    assert loose.converged
    assert tight.converged
    assert 0 < tight.error < loose.error <= 0.15
    rates = [problem.flow(problem.film(one.contact.gap), 0.0).value for one in (loose, tight)]
    assert abs(np.log(rates[0] / rates[1])) <= loose.error + tight.error


def flow_on_links(gap):
    """Pressure from 1 to 0 on links between samples, periodic across, and incidence of the links.

    The last row of nodes is the first one again, at the outlet. A link conducts as 1/mean(g⁻³) of a
    gap that is linear along it; closed nodes keep a millionth of a millionth of the largest gap.
    """
    a = np.append(gap, gap[:1], axis=0) / gap.max() + 1e-12
    rows, columns = map(np.eye, a.shape)
    along = sparse.kron(np.diff(rows, axis=0), columns)
    across = sparse.kron(rows, np.roll(columns, 1, axis=1) - columns)
    incidence = sparse.vstack([along, across]).tocsr()
    ends = a[:-1], a, a[1:], np.roll(a, -1, axis=1)
    one, other = np.concatenate([end.ravel() for end in ends]).reshape(2, -1)
    links = 2 * (one * other) ** 2 / (one + other)
    matrix = (incidence.T @ sparse.diags(links) @ incidence).toarray()
    pressure, free = np.zeros(a.size), np.arange(a.shape[1], gap.size)
    pressure[: a.shape[1]] = 1.0
    pressure[free] = np.linalg.solve(matrix[np.ix_(free, free)], -(matrix @ pressure)[free])
    return pressure, incidence, links


@pytest.mark.parametrize("load", [2.2e5, 2.5e5])
def test_the_least_epsilon(load):
    """Tight tolerances do not lead to an ε whose cube is lost in the rounding of g³.

    There rounding errors made the pressure in pockets, and leak rates 1.4 and 20 % smaller than
    claimed. Each state lies within the claims of both, settled or not.
    """
    loose, tight = (
        lifted(problem_of(scene(load, method="finite-difference", rtol=rtol)))
        for rtol in (1e-3, 1e-4)
    )
    assert log_ratio(loose.leak_rate.value, tight.leak_rate.value) <= loose.error + tight.error
    assert loose.converged
    assert tight.converged or "a smaller ε is lost in the rounding" in tight.reason


def test_the_fluids_pressure_is_that_of_the_flow_through_the_gap():
    """Another solver's flow on the reported gap has the reported pressure, where the film conducts.

    Their difference is measured by the root of its energy Σ C Δp². The flow's own energy is the
    least. With ε it is at most 1/(1 - e) times as large, e the claimed error, so that the pressure
    with ε differs by at most √(e/(1 - e)) of the flow's root. F, what the last step has left, has a
    root of at most √(8 C_max Σ F²), since each node has four links.
    """
    state = Patch(scene(1.2e5, method="finite-difference", rtol=2e-4)).lifted
    assert state.converged
    flow, incidence, links = flow_on_links(state.contact.gap.values)
    reported = np.append(state.fluid_pressure.values / 1e5, np.zeros((1, 32)))

    def size(p):
        return np.sqrt(links @ (incidence @ p) ** 2)

    left = np.sqrt(8 * links.max() * flow.size) * state.residuals[-1]
    allowed = np.sqrt(state.error / (1 - state.error)) + left / size(flow)
    assert allowed < 0.2  # or nothing is shown
    assert size(reported - flow) <= allowed * size(flow)


LAYER = {"youngs_modulus": 0.75 * E_STAR, "poisson_ratio": 0.5, "layer_thickness": 1e-4}


@pytest.mark.parametrize(
    "settings",
    [
        {"load": 5e6},
        {"load": 5e6, "solid": {**LAYER, "contact_modulus": None}},
        {"contact": {"area_fraction": 0.9}},
        {"contact": {"mean_gap": 1e-10}},
        {"load": 9e4},
    ],
    ids=["half-space", "layer", "area", "mean gap", "may float"],
)
def test_where_gaps_are_not_ordered_a_sealed_film_may_open(settings):
    """The theorem needs a half-space and a load above the inlet's pressure, as the first has."""
    problem = problem_of(scene(**settings))
    everywhere = np.full(problem.height.shape, problem.inlet)
    if "load" not in settings or settings["load"] > problem.inlet:
        assert problem.film(problem.contact_under(everywhere).gap).sealed
    assert problem.never_opens == (settings == {"load": 5e6})


@pytest.mark.parametrize("contact", [{"area_fraction": 0.2}, {"mean_gap": 2.5e-7}])
def test_held_area_or_mean_gap(contact):
    """They are kept to a sample, or to 1e-4, and the total load is that of solid and fluid."""
    patch = Patch(scene(contact=contact))
    state = patch.lifted
    assert state.converged
    name, value = next(iter(contact.items()))
    reached, tolerance = state.contact.mean_gap, 1e-4 * value
    if name == "area_fraction":
        reached, tolerance = state.contact.contact_area_fraction, 1 / patch.surface.values.size
    assert reached == pytest.approx(value, abs=tolerance, rel=0)
    assert patch.carried_load == pytest.approx(state.contact.mean_pressure + state.fluid_load)


def test_a_gas_carries_more_than_a_liquid():
    """p² is linear along a uniform film: the mean pressure is above that of a liquid.

    Between 2 and 1 bar, above ambient, 55.6 kPa in place of 50 kPa: 1.11 times as much. Where all
    of the pressure falls at one place both are the same; a fifth of the excess of an even film
    shows that p² is what is linear. Slip makes p more linear.
    """
    ends, fluids = {"inlet_pressure": 2e5, "outlet_pressure": 1e5}, (GAS | {"slip": False}, None)
    loads = [Patch(scene(load=1.6e5, fluid=one, **ends)).lifted.fluid_load for one in fluids]
    assert loads[0] > 1.02 * loads[1]


THIN = {"layer_thickness": 5e-6, "layer_poisson_ratio": 0.3}


@pytest.mark.parametrize(
    "settings",
    [{}, {"solid": THIN, "sides": "wall", "representation": "constant", "load": 1e6}],
    ids=["half-space", "layer"],
)
def test_the_gap_is_that_of_both_pressures(settings):
    """g = S (p_c + p_f) - h + const everywhere, to the certificate: 1e-3 of the rms height."""
    patch = Patch(scene(**settings))
    problem, state = problem_of(patch.scene), patch.lifted
    assert state.converged
    total = state.contact.pressure.values + state.fluid_pressure.values
    separation = state.contact.gap.values + problem.height.values - problem.displacement(total)
    slack = 1e-3 * problem.height.values.std()
    assert np.ptp(separation) < slack
    assert np.ptp(problem.displacement(state.fluid_pressure.values)) > 20 * slack
    assert patch.film.contact_area_fraction < patch.contact.contact_area_fraction


def gate_and_chamber(load=0.301, place=0.3, depth=0.8, n=32):
    """A gate across the flow at x = place, and a chamber behind it whose way out is throttled."""
    x, y = np.arange(n)[:, None] / n, np.arange(n) / n
    gate = 0.5 * np.exp(-(((x - place) / 0.05) ** 2))
    throttled = 1 - depth * np.exp(-(((y - 0.5) / 0.08) ** 2))
    heights = gate + throttled * np.exp(-(((x - 0.75) / 0.05) ** 2))
    ends = {"inlet_pressure": 0.3, "outlet_pressure": 0.0, "ambient_pressure": 0.0}
    unit = {"solid": {"contact_modulus": 1.0}, "fluid": {"viscosity": 1 / 12}}
    problem = problem_of(scene(load, **ends, **unit), GridField(heights, (1 / n, 1 / n), True))
    return problem, x


def test_two_sealed_films_keep_the_range_of_either():
    """What opens the film of one start may open that of the other."""
    sealed = lifted(problem_of(scene(3e5, n=16)))
    assert sealed.state == "sealed"
    for highest in ((1e-18, 0.0), (0.0, 1e-18)):
        both = _merged(*(replace(sealed, highest=h) for h in highest), in_equilibrium=True)
        assert (both.converged, both.highest) == (True, 1e-18)


@pytest.mark.parametrize(
    ("load", "place", "depth"),
    [
        pytest.param(0.301, 0.3, 0.8, marks=pytest.mark.slow),
        pytest.param(0.295, 0.3, 0.8, marks=pytest.mark.slow),
        (0.31, 0.15, 0.6),
    ],
)
def test_two_equilibria_are_both_reported(load, place, depth):
    """Closed, the gate keeps the pressure out that would open it: sealed or leaking.

    Under a load below the inlet's pressure the second start leaves a twentieth to the solid. The
    inlet's pressure does not open the last gate while the chamber is drained.

    Between them lies an equilibrium that plain passes leave. Whatever pressure the chamber has at
    first, one of the two that last is found. Its ln Q errs by at most rtol/2 = 0.025, so that the
    highest leak rate is at most 3 % above the value, and two values differ by at most 5 %.
    """
    problem, x = gate_and_chamber(load, place, depth)
    state = lifted(problem)
    assert not state.converged
    assert "two equilibria" in state.reason
    assert state.lowest == 0.0
    assert state.highest == pytest.approx(state.leak_rate.value, rel=0.03)
    for share in (0.2, 0.5, 0.8):
        start = problem.largest_start * np.where(x < place, 1.0, np.where(x < 0.75, share, 0.0))
        found = lifted(problem, start=np.repeat(start, 32, axis=1))
        leaks = found.leak_rate.state == "leaking"
        assert found.leak_rate.value == pytest.approx(leaks * state.leak_rate.value, rel=0.05)


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
    assert solution.iterations <= 2


@pytest.mark.parametrize(
    ("load", "others"),
    [
        *((load, {}) for load in (5.35e4, 1.2e5)),
        # The slip has no gap by which to be judged.
        (1.2e5, {"fluid": GAS, "inlet_pressure": 2e5, "outlet_pressure": 1e5}),
    ],
)
def test_a_flat_counter_face(load, others):
    """Without roughness the solid's own displacement says what a small gap is.

    Above the inlet's pressure no fluid pressure opens it: p_c = P₀ - p_f > 0 everywhere.
    """
    n = 16
    surface = GridField(np.zeros((n, n)), (1e-4 / n, 1e-4 / n), True)
    state = lifted(problem_of(scene(load, n=n, **others), surface))
    assert state.contact.mean_pressure + state.fluid_load == pytest.approx(load, rel=1e-9)
    assert (state.state == "sealed") == (load > 1e5)


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
    return FloatingPoint.beside(touching, pressure, gap)


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
    state = lifted(problem)
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


def wedge_carries(n, rise=0.0):
    """Mean pressure under a solid `rise` above a gap that falls from 1 to 1/2 along the flow.

    In units of the inlet's, on n rows of vertices: ∫ dx/g³ over a piece of the length 1 on which g
    goes from a to b is (a + b)/(2 a² b²). The last piece leads back to 1.
    """
    gap = 1 - 0.5 * np.arange(n) / n + rise
    after = np.roll(gap, -1)
    lost = np.cumsum((gap + after) / (gap * after) ** 2)
    return 1 - np.append(0, lost[:-1]).mean() / lost[-1]


def test_a_stiff_wedge_floats_from_where_its_film_carries_the_load():
    """However stiff: its gap, and so ln Q, hardly changes before the contact is lost.

    It touches at one sample, a tent over 4 of the n² cells. Blocking a share f of the area takes
    about 2 f from the conductance. The solid's own deflection is of the order of P₀ L/E*.
    """
    n, load, height, modulus = 32, 1e5, 1e-5, 1e13
    values = -np.repeat(height * (1 - 0.5 * np.arange(n) / n), n).reshape(n, n)
    values[n // 2, n // 2] = 0.0
    surface = GridField(values, (1e-3 / n, 1e-3 / n), True)
    error = 2 * 4 / n**2 + load * 1e-3 / modulus / height
    for drop in (1.4, 1.6):
        lifting = scene(load, drop * load, n, solid={"contact_modulus": modulus})
        state = Patch(lifting, surface=surface).lifted
        assert state.converged
        assert state.floats == (drop * wedge_carries(n) > 1)
        rise = state.contact.gap.values.min() / height
        assert state.fluid_load / (drop * load) == pytest.approx(wedge_carries(n, rise), rel=error)


def test_no_load_below_that_of_a_uniform_film_is_carried():
    """However thick the film, its pressure carries more."""
    limit = 1e5 * (1 + 1 / 32) / 2  # the mean of p in an even film on 32 rows of vertices
    off, floating = Patch(scene(0.999 * limit)), Patch(scene(1.005 * limit))
    assert (off.lifted_off, off.leak_rate.state) == (True, "lifted off")
    assert off.lifted.fluid_load >= 0.999 * limit
    assert floating.lifted.floats
    assert not floating.lifted_off
