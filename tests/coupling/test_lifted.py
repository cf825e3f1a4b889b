"""Contact and flow in one equilibrium, against closed forms, theorems and other solvers."""

from dataclasses import replace

import numpy as np
import pytest
from lifted_scenes import E_STAR, problem_of, scene, wave

from fem_seal.contact import solve
from fem_seal.coupling import PassTuning, lifted
from fem_seal.coupling.lifted import _both, lifted_from
from fem_seal.coupling.passes import Passes
from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.progress import silent


def test_uniform_fluid_pressure_is_a_dry_contact_under_the_rest_of_the_load():
    """Inlet a millionth above the outlet, both far above ambient: dry contact under P₀ - p_f."""
    load, fluid = 2e5, 8e4
    patch = Patch(
        scene(load, inlet_pressure=fluid * (1 + 1e-6), outlet_pressure=fluid, ambient_pressure=0)
    )
    dry = solve(patch.surface, E_STAR, pressure=load - fluid)
    assert dry.contact_area_fraction < 0.8 * patch.contact.contact_area_fraction
    # The gap is known to the certificate, 1e-6 of the energy: 1e-3 of the rms height.
    atol = 1e-3 * patch.surface.values.std()
    np.testing.assert_allclose(patch.film.gap.values, dry.gap.values, atol=atol)
    assert patch.lifted.converged
    assert patch.lifted.contact.mean_pressure == pytest.approx(load - fluid, rel=1e-5)


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_waves_along_the_flow_under_uniform_pressure(share):
    """Westergaard: contact fraction (2/π) arcsin √((P₀ - p_f)/(π E* Δ/λ)), to a sample or two."""
    n, length, height = 128, 1e-4, 1e-6
    full = np.pi * E_STAR * height / length
    load = 0.7 * full
    fluid = share * load
    flow = {"inlet_pressure": fluid * (1 + 1e-6), "outlet_pressure": fluid, "ambient_pressure": 0}
    state = lifted(problem_of(scene(load, **flow), wave(n, length, height)), 0.05)
    exact = 2 / np.pi * np.arcsin(np.sqrt((load - fluid) / full))
    assert state.contact.contact_area_fraction == pytest.approx(exact, abs=2 / n)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_bump_under_uniform_pressure(seed):
    """Hertz: a³ = 3 F R/(4 E*), F = (P₀ - p_f) L²; a bump of radius R in every cell of side L.

    Half a sample around the patch is 1/a of its area; the neighbours' pressure is (a/L)³ or so.
    """
    n, length, radius = 128, 1e-4, 1e-3
    rng = np.random.default_rng(seed)
    share = rng.uniform(0.3, 0.7)  # of the fluid in the load
    contact_radius = 16 * length / n
    left = 4 * E_STAR * contact_radius**3 / (3 * radius * length**2)
    fluid = share / (1 - share) * left
    x = (np.arange(n) / n - 0.5) * length
    bump = GridField(-(x[:, None] ** 2 + x**2) / (2 * radius), (length / n, length / n), True)
    flow = {"inlet_pressure": fluid * (1 + 1e-6), "outlet_pressure": fluid, "ambient_pressure": 0}
    state = lifted(problem_of(scene(left + fluid, **flow), bump), 0.05)
    area = state.contact.contact_area_fraction * length**2
    assert state.converged
    assert area == pytest.approx(np.pi * contact_radius**2, rel=1 / 16)
    peak = 1.5 * left * length**2 / (np.pi * contact_radius**2)
    assert state.contact.pressure.values.max() == pytest.approx(peak, rel=0.02)


def test_vanishing_fluid_pressure_gives_the_dry_answer():
    """p_in → ambient: the dry contact to the last digits, and its leak rate."""
    patch, dry = (Patch(scene(inlet=1e-15, lift=lift)) for lift in ("resolved", "none"))
    assert patch.film.contact_area_fraction == dry.film.contact_area_fraction
    # The contact is solved again from itself, which moves gaps by rounding.
    atol = 1e-14 * patch.surface.values.std()
    np.testing.assert_allclose(patch.film.gap.values, dry.film.gap.values, rtol=0, atol=atol)
    assert patch.leak_rate.value == pytest.approx(dry.leak_rate.value, rel=1e-9)


GAS = {"kind": "gas", "viscosity": 1.8e-5, "molar_mass": 0.029, "temperature": 293.0}
OTHERS = (
    {"sides": "wall"},
    {"representation": "constant"},
    {"method": "finite-difference"},
    {"load": 1.5e5, "inlet": 1.4e5},
    {"load": 3e5, "inlet": 2.5e5},  # the first of the three is sealed
    {"load": 1.6e5, "fluid": GAS, "inlet_pressure": 2e5, "outlet_pressure": 1e5},
    {"inlet_pressure": 1e5, "outlet_pressure": 2e4, "ambient_pressure": 1e5, "load": 1.5e5},
)


@pytest.mark.parametrize("settings", [*({"seed": seed} for seed in (1, 2, 3, 5)), *OTHERS], ids=str)
def test_range_encloses_resolved(settings):
    """Dry contacts under P₀ - p_out and P₀ - p_in leak no more and no less than the lifted one."""
    resolved = Patch(scene(**settings))
    low, high = Patch(scene(**settings, lift="range")).lift_range
    assert resolved.lifted.converged
    rates = low, resolved.leak_rate, high
    if settings.get("method") == "finite-difference":
        lower = upper = [rate.value for rate in rates]
    else:
        lower, upper = zip(*(rate.bounds for rate in rates), strict=True)
    assert upper[0] < lower[2]  # or nothing is shown
    assert lower[0] <= upper[1]
    assert lower[1] <= upper[2]


def test_sealed_film_that_the_inlet_pressure_would_open():
    """Passes end sealed, but not for certain: not settled. What then leaks lies within "range"."""
    settings = {"load": 4.5e5, "inlet": 3e5}
    state = Patch(scene(**settings)).lifted
    low, high = Patch(scene(**settings, lift="range")).lift_range
    assert state.state == low.state == "sealed"
    assert not state.converged
    assert 0 == state.lowest < state.highest <= high.bounds[1]
    assert "0 (sealed)" in state.reason


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_both_starts_come_to_one_state(seed):
    """From the outlet's and from the inlet's pressure: the same to what is claimed."""
    problem = problem_of(scene(seed=seed, load=1.2e5, inlet=6e4))
    shape = problem.height.shape
    low, high = (
        lifted_from(problem, 0.02, np.full(shape, pressure), None)
        for pressure in (problem.outlet, problem.inlet)
    )
    assert low.converged
    assert high.converged
    claimed = low.change + high.change + 0.02
    assert abs(np.log(low.leak_rate.value / high.leak_rate.value)) <= claimed


def test_forces_balance():
    """Solid and fluid carry the load together, and the fluid's pressure lies between the ends'."""
    patch = Patch(scene())
    state = patch.lifted
    assert state.contact.mean_pressure + state.fluid_load == pytest.approx(1.5e5, rel=1e-6)
    assert state.fluid_pressure.values.min() >= 0
    assert state.fluid_pressure.values.max() <= 1e5
    assert 0 < state.fluid_load < 1e5


@pytest.mark.parametrize(("load", "off"), [(0.9e5, False), (0.2e5, True)])
def test_lift_off(load, off):
    """The fluid carries about half of its 1 bar: 0.9 bar keep the solids together, 0.2 do not."""
    patch = Patch(scene(load))
    assert patch.lifted_off is off
    assert (patch.leak_rate.state == "lifted off") is off
    if off:
        # No equilibrium: whatever is left to the solid, the fluid's pressure exceeds the load.
        assert patch.lifted.fluid_load >= load


@pytest.mark.parametrize("least", [3e-2, 3e-4])
def test_the_solid_keeps_a_tenth_of_its_load_in_each_pass(least):
    """A fluid that always carries twice the total load: the solid's load falls step by step, so
    that each contact starts near the last, until less than the least part is left."""
    problem, loads = problem_of(scene(load := 1.5e5)), []

    def press(heights, pressure, *start):
        loads.append(pressure)
        return problem.press(heights, pressure, *start)

    twice = replace(
        problem,
        press=press,
        inlet=2 * load,
        fluid_pressure=lambda film, leak: film.samples + 2 * load,
    )
    start = np.full(problem.height.shape, problem.outlet)
    state = lifted_from(twice, 0.05, start, tuning=PassTuning(least_solid_share=least))
    assert state.state == "lifted off"
    assert loads == pytest.approx(load * 0.1 ** np.arange(len(loads)), rel=1e-9)
    assert loads[-1] < least * load < loads[-2]


@pytest.mark.parametrize(("tolerance", "converged"), [(0.3, False), (0.05, True)])
def test_nothing_settles_on_a_loose_mesh(tolerance, converged):
    """From the equilibrium, all passes on one mesh: they stand still on either, and the leak rate
    is known to the tolerance of the result on the second alone."""
    start = Patch(scene()).lifted.fluid_pressure.values
    tuning = PassTuning(first_tolerance=tolerance, mesh_left=0.0, most_passes=9)
    state = lifted_from(problem_of(scene()), 0.05, start, tuning=tuning)
    assert abs(np.log(state.rates[-1] / state.rates[-2])) < 0.05 / 5
    assert state.converged is converged


def test_the_contact_of_the_result_is_not_that_of_a_rough_pass():
    """Passes solve contacts to a thousandth; that of the state keeps the scene's tolerance."""
    problem, certificates = problem_of(scene()), []

    def press(*arguments):
        contact = problem.press(*arguments)
        certificates.append(contact.certificate)
        return contact

    tuning = PassTuning(rough_contact=0.02)
    start = np.zeros(problem.height.shape)
    state = lifted_from(replace(problem, press=press), 0.05, start, tuning=tuning)
    assert min(certificates[:-1]) > 1e-5
    assert state.contact.certificate == certificates[-1] <= 1e-6


def test_load_below_the_outlet_lifts_off_at_once():
    flow = {"inlet_pressure": 4e5, "outlet_pressure": 3e5, "ambient_pressure": 1e5}
    state = Patch(scene(load=1.9e5, **flow)).lifted
    assert (state.state, state.passes) == ("lifted off", 0)


def test_sealed_with_the_inlets_pressure_everywhere():
    """Full contact that the fluid cannot open: sealed, without a second start."""
    patch = Patch(scene(load=5e6))
    assert patch.leak_rate.state == "sealed"
    assert patch.lifted.converged


def test_finite_differences_agree_with_finite_elements():
    """Both flows lead to one equilibrium, as far as the grid of the differences allows."""
    elements = Patch(scene(n=64))
    differences = Patch(scene(n=64, method="finite-difference"))
    assert differences.lifted.converged
    dry = Patch(scene(n=64, lift="none", method="finite-difference")).leak_rate.value
    dry_elements = Patch(scene(n=64, lift="none")).leak_rate.value
    # Both differ by their discretisation when dry already; the lift must not add as much again.
    apart = abs(np.log(dry / dry_elements))
    assert abs(np.log(differences.leak_rate.value / elements.leak_rate.value)) < 2 * apart + 0.05
    assert elements.leak_rate.value > 2 * dry_elements


@pytest.mark.parametrize("contact", [{"area_fraction": 0.2}, {"mean_gap": 2.5e-7}])
def test_held_area_or_mean_gap(contact):
    """They are kept, and the solid bends: the total load is that of solid and fluid."""
    patch = Patch(scene(contact=contact))
    state = patch.lifted
    assert state.converged
    name, value = next(iter(contact.items()))
    reached = getattr(
        state.contact, {"area_fraction": "contact_area_fraction", "mean_gap": "mean_gap"}[name]
    )
    tolerance = 1 / patch.surface.values.size if name == "area_fraction" else 1e-4 * value
    assert reached == pytest.approx(value, abs=tolerance, rel=1e-3)
    assert patch.mean_pressure == pytest.approx(state.contact.mean_pressure + state.fluid_load)


def test_layer_walls_and_constant_pixels():
    """They settle too; a thin layer bends less where the fluid presses, and is lifted less."""
    layer = {"layer_thickness": 5e-6, "layer_poisson_ratio": 0.3}
    patch = Patch(scene(solid=layer, sides="wall", representation="constant", load=1e6))
    assert patch.lifted.converged
    assert patch.film.contact_area_fraction < patch.contact.contact_area_fraction


def test_a_gas_carries_more_than_a_liquid():
    """p² is linear along a uniform film: the mean pressure is above that of a liquid.

    Between 2 and 1 bar, above ambient, 55.6 kPa in place of 50 kPa. Slip makes p more linear.
    """
    gas = {"kind": "gas", "viscosity": 1.8e-5, "molar_mass": 0.029, "temperature": 293.0}
    gas["slip"] = False
    ends = {"inlet_pressure": 2e5, "outlet_pressure": 1e5}
    loads = [
        Patch(scene(load=1.6e5, fluid=fluid, **ends)).lifted.fluid_load for fluid in (gas, None)
    ]
    assert loads[0] > 1.02 * loads[1]


def test_unsettled_passes_say_so():
    """With two passes nothing can have settled: the range that was seen, and no more."""
    state = lifted(problem_of(scene()), 0.05, tuning=PassTuning(most_passes=2))
    assert not state.converged
    assert state.lowest <= state.leak_rate.value * 1.05
    assert "have not settled after 2 passes" in state.reason
    assert replace(state, converged=True).reason == ""


def test_a_fluid_pressure_that_jumps_has_no_equilibrium():
    """A fluid that carries nine tenths of its pressure in a thin film and a tenth in a thick one.

    No pressure between is its own response, and ln Q keeps moving between two films.
    """
    problem = problem_of(scene())
    low, high = (np.full(problem.height.shape, part * problem.inlet) for part in (0.1, 0.9))
    gaps = [problem.contact_under(pressure).gap.values.mean() for pressure in (low, high)]

    def jumping(film, leak):
        thick = film.gap.values.mean() > sum(gaps) / 2
        return np.full(film.samples.shape, (0.1 if thick else 0.9) * problem.inlet)

    state = lifted_from(replace(problem, fluid_pressure=jumping), 0.05, low)
    assert not state.converged
    assert state.lowest < state.highest
    assert f"{state.flipping} samples open and close" in state.reason
    assert 0 < state.flipping < problem.height.values.size


def given_up_after(rates):
    """Number of passes with these leak rates, one after the other, until they are given up."""
    passes = Passes(problem_of(scene()), 0.05, np.zeros((32, 32)))
    for rate in rates:
        passes.count += 1
        passes.rates.append(rate)
        if passes.given_up:
            break
    return passes.count


def test_passes_that_calm_down_go_on_and_others_are_given_up():
    """ln Q that swings by ±a: as long as a shrinks by a seventh in each pass, or is small, it
    may settle yet. A film that closes in every third pass, with smaller steps as well, will close
    once more."""
    most, calm = PassTuning().most_passes, (6 / 7) ** np.arange(40)
    swing = (-1.0) ** np.arange(40)
    assert given_up_after(np.exp(2 * calm * swing)) == most
    assert given_up_after(np.exp(0.05 * swing)) == most
    assert given_up_after(np.exp(2 * swing)) < most
    assert given_up_after([0.0] * 40) == most
    assert given_up_after([0.0, 1.0, 0.0] * 13) < most


def test_two_settled_starts_that_differ_are_two_states():
    """The samples that are open in one state alone are counted, and both leak rates named."""
    problem = problem_of(scene())
    states = [lifted(replace(problem, load=problem.load * part), 0.05) for part in (1.0, 1.1)]
    both = _both(*states)
    rates = sorted(state.leak_rate.value for state in states)
    opened = [state.contact.gap.values > 0 for state in states]
    assert not both.converged
    assert both.flipping == np.count_nonzero(opened[0] & ~opened[1]) > 0  # more load closes
    # The ends are leak rates of passes, which are known to 5 % like those of the states.
    assert abs(np.log(both.lowest / rates[0])) < 0.1 < np.log(rates[1] / rates[0])
    assert abs(np.log(both.highest / rates[1])) < 0.1
    assert "two states" in both.reason


def test_passes_on_one_mesh_settle_where_those_on_new_meshes_do():
    """The pressure alone on a kept mesh, or bounds on a mesh of its own in every pass."""
    problem = problem_of(scene(rtol=0.02))
    start = np.zeros(problem.height.shape)
    kept = lifted_from(problem, 0.02, start)
    anew = {"flow_on_kept_mesh": None, "flow": lambda *args: problem.flow(*args[:2], True)}
    new_problem = replace(problem, **anew)
    new = lifted_from(new_problem, 0.02, start)
    assert kept.converged
    assert new.converged
    assert max(kept.change, new.change) < 0.02 / 5
    claimed = kept.claimed + new.claimed
    assert abs(np.log(kept.leak_rate.value / new.leak_rate.value)) <= claimed


def test_a_last_flow_that_contradicts_the_passes_is_no_equilibrium():
    """Passes on a mesh that is not fit settle as well, and the last flow denies what they found."""
    problem, last = problem_of(scene()), []

    def flow(film, tolerance, new=False):
        leak = problem.flow(film, tolerance, new)
        if tolerance is None:
            last.append(leak)
            leak = replace(leak, value=1.2 ** len(last) * leak.value)
        return leak

    start = np.zeros(problem.height.shape)
    tuning = PassTuning(most_passes=15)
    assert lifted_from(problem, 0.05, start, tuning=tuning).converged
    state = lifted_from(replace(problem, flow=flow), 0.05, start, tuning=tuning)
    assert not state.converged
    assert state.passes == 15


def test_the_last_pass_begins_with_the_pressure_of_the_flow():
    """Whole and unmixed, so that neither small steps nor mixtures pass for an equilibrium."""
    passes = Passes(problem_of(scene()), 0.05, np.zeros((32, 32)))
    while not passes.plain and passes.count < 20:
        passes.solve_flow(passes.solve_contact(), silent)
        passes.go_on()
    assert passes.plain
    np.testing.assert_array_equal(passes.pressure, passes.response)


def test_the_gap_is_that_of_both_pressures():
    """g = S (p_c + p_f) - h + const everywhere, to the certificate: 1e-3 of the rms height."""
    problem = problem_of(scene())
    state = Patch(scene()).lifted
    total = state.contact.pressure.values + state.fluid_pressure.values
    level = state.contact.gap.values + problem.height.values - problem.displacement(total)
    slack = 1e-3 * problem.height.values.std()
    assert np.ptp(level) < slack
    assert np.ptp(problem.displacement(state.fluid_pressure.values)) > 20 * slack


def test_starts_that_differ_have_not_settled():
    """One lifted off, the other leaking; or leak rates further apart than both claim."""
    state = Patch(scene()).lifted
    off = replace(state, state="lifted off", leak_rate=None, lowest=np.inf, highest=np.inf)
    assert not _both(off, state).converged
    assert _both(state, state).converged
    far = replace(state, leak_rate=replace(state.leak_rate, value=1.2 * state.leak_rate.value))
    assert not _both(far, state).converged
    # A start that has not settled agrees with nothing, and its range counts.
    sealed = replace(
        state, state="sealed", converged=False, change=np.inf, lowest=0.0, highest=9 * state.highest
    )
    assert _both(state, sealed).state == "leaking"  # that which has settled is shown
    both = _both(sealed, state)
    assert not both.converged
    assert (both.lowest, both.highest) == (0.0, sealed.highest)


@pytest.mark.parametrize("load", [0.2e5, 1.5e5, 4e5])
def test_one_leak_rate_is_kept_of_every_pass(load):
    """Lifted off, leaking and sealed: the last passes leak what the state says, to its claim."""
    state = Patch(scene(load)).lifted
    assert len(state.rates) == state.passes
    if state.state == "leaking":
        assert np.ptp(np.log(state.rates[-3:])) == pytest.approx(state.change, rel=1e-9)
        assert abs(np.log(state.rates[-1] / state.leak_rate.value)) <= state.rtol
        assert state.rates[0] < state.rates[-1]  # the outlet's pressure everywhere lifts least
    if state.state == "sealed":
        assert state.rates[-1] == 0
    both = _both(state, state)
    assert both.rates == state.rates * 2
    assert len(both.rates) == both.passes
