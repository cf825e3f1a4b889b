"""Contact and flow in one equilibrium, against closed forms, theorems and other solvers."""

from dataclasses import replace

import numpy as np
import pytest
from lift_campaign import campaign
from lifted_scenes import E_STAR, from_pressure, problem_of, scene
from project import AIR
from scipy import sparse

from fem_seal.contact import ElasticSolid, Load, press
from fem_seal.coupling import lifted_state
from fem_seal.coupling.newton import newton
from fem_seal.coupling.point import LiftPoint
from fem_seal.errors import Inconsistent, InvalidInput, NotConverged
from fem_seal.grid import GridField
from fem_seal.network.film_pressure import eliminated
from fem_seal.patch import Patch
from fem_seal.quantities.lift import lift_range


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


DIFFERENT = (
    {"sides": "wall", "representation": "constant"},
    {"method": "finite-difference"},
    {"load": 1.5e5, "inlet": 1.4e5},
    {"load": 3e5, "inlet": 2.5e5},  # the first of the three is sealed
    {"load": 1.6e5, "fluid": AIR, "inlet_pressure": 2e5, "outlet_pressure": 1e5},
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


def test_what_cannot_be_solved_is_refused():
    """A start that leaves nothing of the load to the solid, and a singular matrix.

    SciPy's words say nothing about a film.
    """
    problem = problem_of(scene(n=16, load=1e5, inlet=1.5e5))
    with pytest.raises(InvalidInput, match="start: a mean pressure of 150000 Pa carries the whole"):
        from_pressure(problem, problem.inlet)
    with pytest.raises(NotConverged, match="conductances are so far apart"):
        eliminated(sparse.csr_array((2, 2)))


def test_a_leak_rate_outside_its_range_is_refused():
    state = lifted_state(problem_of(scene(inlet=1e4, n=16)))
    with pytest.raises(Inconsistent):
        replace(state, highest=0.0)


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


def test_the_fluids_pressure_is_that_of_the_flow_through_the_gap():
    """Another solver's flow on the gap has the pressure of the network of all samples, where the
    film conducts.

    Their difference is measured by the root of its energy Σ C Δp². The flow's own energy is the
    least. With ε it is at most 1/(1 - e) times as large, e the part of ε, so that the pressure with
    ε differs by at most √(e/(1 - e)) of the flow's root. F, what the last step has left, has a root
    of at most √(8 C_max Σ F²), since each node has four links.
    """
    problem = problem_of(scene(1.2e5, rtol=2e-4))
    pressure, epsilon = np.zeros((32, 32)), 1e-3 * problem.roughness
    contact = problem.contact_under(pressure)
    start = LiftPoint(problem, problem.first_network, epsilon, pressure, contact)
    steps = newton(start, problem.allowed)
    assert not steps.failure
    point = steps.point
    flow, incidence, links = flow_on_links(point.contact.gap.values)
    found = np.append(point.pressure / 1e5, np.zeros((1, 32)))

    def size(p):
        return np.sqrt(links @ (incidence @ p) ** 2)

    left = np.sqrt(8 * links.max() * flow.size) * point.residual_size
    allowed = np.sqrt(point.by_epsilon / (1 - point.by_epsilon)) + left / size(flow)
    assert allowed < 0.2  # or nothing is shown
    assert size(found - flow) <= allowed * size(flow)


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
    ends, fluids = {"inlet_pressure": 2e5, "outlet_pressure": 1e5}, (AIR | {"slip": False}, None)
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
    state = lifted_state(problem)
    assert not state.converged
    assert "two equilibria" in state.reason
    assert state.lowest == 0.0
    assert state.highest == pytest.approx(state.leak_rate.value, rel=0.03)
    for share in (0.2, 0.5, 0.8):
        start = problem.largest_start * np.where(x < place, 1.0, np.where(x < 0.75, share, 0.0))
        found = lifted_state(problem, start=np.repeat(start, 32, axis=1))
        leaks = found.leak_rate.state == "leaking"
        assert found.leak_rate.value == pytest.approx(leaks * state.leak_rate.value, rel=0.05)


@pytest.mark.parametrize(
    ("load", "others"),
    [
        *((load, {}) for load in (5.35e4, 1.2e5)),
        # The slip has no gap by which to be judged.
        (1.2e5, {"fluid": AIR, "inlet_pressure": 2e5, "outlet_pressure": 1e5}),
    ],
)
def test_a_flat_counter_face(load, others):
    """Without roughness the solid's own displacement says what a small gap is.

    Above the inlet's pressure no fluid pressure opens it: p_c = P₀ - p_f > 0 everywhere.
    """
    n = 16
    surface = GridField(np.zeros((n, n)), (1e-4 / n, 1e-4 / n), True)
    state = lifted_state(problem_of(scene(load, n=n, **others), surface))
    assert state.contact.mean_pressure + state.fluid_load == pytest.approx(load, rel=1e-9)
    assert (state.state == "sealed") == (load > 1e5)


@pytest.mark.slow
def test_random_scenes():
    """None claims too little, and none leaks outside the range of the dry contacts."""
    verdicts = {verdict for _, verdict in campaign(range(20))}
    assert "settled" in verdicts
    assert not verdicts & {"wrong", "outside the range"}


def test_units_of_pressure():
    """Pressures and moduli in another unit."""
    unit, load, n = 1e9, 1.5e5, 16
    made, other = (
        Patch(scene(load * one, 1e5 * one, n, solid={"contact_modulus": 1e7 * one}))
        for one in (1, unit)
    )
    assert other.lifted.steps == made.lifted.steps
    # Rounding moves single samples at the rim of contact.
    value = unit * made.leak_rate.value
    assert other.leak_rate.value == pytest.approx(value, rel=made.lifted.error)
