"""Liquids and gases: exact channel flows, bounds, rates, pressures, invalid settings."""

from math import log, pi, sqrt

import numpy as np
import pytest
from project import refused_calls

from fem_seal.fluid import GAS_CONSTANT, GasDrive, LiquidDrive, Slip
from fem_seal.patch import Patch
from fem_seal.quantities.verdict import verdict
from fem_seal.results.words import summary_of
from fem_seal.scene import Scene
from fem_seal.slip_error import EXCESS
from fem_seal.solved import solve

VISCOSITY, TEMPERATURE, MOLAR_MASS = 1.8e-5, 293.15, 0.029
P_IN, P_OUT = 2.5e5, 1e5
GAS = {
    "kind": "gas",
    "viscosity": VISCOSITY,
    "temperature": TEMPERATURE,
    "molar_mass": MOLAR_MASS,
    "slip": False,
}
SLIPPING = {name: value for name, value in GAS.items() if name != "slip"}


@pytest.fixture
def gap_scene(scene_of_gap):
    """Function that makes the scene of a gap from an array, with a gas and without contact."""

    def scene(gap, fluid=GAS, flow=None, spacing=(1e-6, 2e-6), **output):
        flow = {"inlet_pressure": P_IN, "outlet_pressure": P_OUT} if flow is None else flow
        output = {"products": ["leak_rate", "mesh"], **output}
        return scene_of_gap(gap, spacing, fluid=dict(fluid), flow=flow, output=output)

    return scene


def air(p_in=P_IN, p_out=P_OUT):
    return GasDrive(p_in, p_out, TEMPERATURE, MOLAR_MASS, 273.15, 101325.0)


def channel_mass_rate(height, width, length, accommodation):
    """Isothermal ideal gas between parallel plates: W h³ M (p_in² - p_out²) / (24 η R T L).

    Slip multiplies it by 1 + 6 Kn (2-σ)/σ, Kn at the mean pressure (Arkilic et al. 1997).
    """
    per_pressure = MOLAR_MASS / (GAS_CONSTANT * TEMPERATURE)
    speed = np.sqrt(np.pi * GAS_CONSTANT * TEMPERATURE / (2 * MOLAR_MASS))
    knudsen = VISCOSITY * speed / ((P_IN + P_OUT) / 2) / height
    rate = width * height**3 / (24 * VISCOSITY * length) * per_pressure * (P_IN**2 - P_OUT**2)
    return rate * (1 + 6 * knudsen * (2 - accommodation) / accommodation)


@pytest.mark.parametrize("accommodation", [None, 0.7])
def test_gas_that_slips_in_a_uniform_channel(gap_scene, accommodation):
    """Arkilic's channel, first-order slip with full accommodation being the default."""
    fluid = SLIPPING
    if accommodation is not None:
        fluid = SLIPPING | {"slip": True, "accommodation": accommodation}
    scene = gap_scene(np.full((9, 5), 1e-7), fluid, products=["leak_rate", "hydraulic_aperture"])
    result = solve(Scene.from_mapping(scene)).result()
    exact = channel_mass_rate(1e-7, 8e-6, 8e-6, accommodation or 1.0)
    # CG stops at a relative energy error of 1e-8.
    assert result.gas.mass_rate.lower == pytest.approx(exact, rel=1e-7)
    assert result.gas.mass_rate.upper == pytest.approx(exact, rel=1e-7)
    assert result.gas.accommodation == (accommodation or 1.0)
    aperture = result.quantities.hydraulic_aperture
    assert [aperture.lower, aperture.upper] == pytest.approx([1e-7] * 2, rel=1e-7)


@pytest.mark.parametrize(("height", "decision"), [(1e-6, "within limit"), (1e-7, "undecided")])
def test_verdict_with_first_order_slip(gap_scene, height, decision):
    """Kinetic theory adds to first order: up to Kn = 0.05 it is estimated, beyond it is open."""
    gap = np.full((5, 5), height)
    gap[2] *= 0.8
    scene = Scene.from_mapping(gap_scene(gap, SLIPPING))
    limit = f"{1.2 * Patch(scene).leak_rate.upper} m^3/s"
    result = solve(scene.with_({"limit.leak_rate": limit})).result()
    knudsen = air().mean_free_path(VISCOSITY) / (0.8 * height)
    assert result.gas.knudsen_number == pytest.approx(knudsen)
    assert result.verdict.decision == decision
    entries = {entry.name: entry for entry in result.error_budget}
    lacking = EXCESS * knudsen  # by the kinetic law, at most
    assert entries["slip"].upper == (None if knudsen > 0.05 else pytest.approx(1 + lacking))
    # What refinement closes and what it cannot make up the bounds.
    parts = entries["flow"], entries["slip interval"]
    for side in ("lower", "upper"):
        product = np.prod([getattr(part, side) for part in parts])
        bound = getattr(result.leak_rate, side) / result.leak_rate.value
        assert product == pytest.approx(bound, rel=1e-12)
    assert entries["slip interval"].upper > 1
    low = scene.with_({"limit.leak_rate": f"{0.8 * result.leak_rate.lower} m^3/s"})
    assert solve(low).result().verdict.decision == "above limit"


@pytest.mark.parametrize(
    ("height", "p_out", "near"),
    [(1e-6, P_OUT, "within limit"), (1e-7, P_OUT, "undecided"), (1e-9, 0.0, "undecided")],
)
def test_kinetic_slip(gap_scene, height, p_out, near):
    """A uniform channel from Kn 0.04 to 75: mass rate, aperture, pressure, error and verdict."""
    flow = {"inlet_pressure": P_IN, "outlet_pressure": p_out}
    fluid = SLIPPING | {"slip": "kinetic"}
    products = ["leak_rate", "hydraulic_aperture", "mesh"]
    scene = Scene.from_mapping(gap_scene(np.full((9, 5), height), fluid, flow, products=products))
    solved = solve(scene)
    result, drive = solved.result(), scene.drive
    slip = drive.slip(VISCOSITY, 1.0, "kinetic")
    potentials = [slip.potential(p, height) for p in (p_out, P_IN)]
    # B g² (φ_in - φ_out)/(12 η), times M/(R T), with width over length 1.
    per = MOLAR_MASS / (GAS_CONSTANT * TEMPERATURE)
    exact = per * slip.product * height**2 * (potentials[1] - potentials[0]) / (12 * VISCOSITY)
    rate = result.gas.mass_rate
    assert rate.lower <= exact * (1 + 1e-7)
    assert rate.upper >= exact * (1 - 1e-7)
    assert rate.upper / rate.lower < 1 + 3e-4
    assert result.gas.slip == "kinetic"
    aperture = result.quantities.hydraulic_aperture
    assert aperture.value == pytest.approx(height, rel=3e-4)
    field = solved.leak_rate.field
    x = field.points[:, 0] / field.points[:, 0].max()
    line = potentials[1] + (potentials[0] - potentials[1]) * x
    assert slip.potential(field.pressure, height) == pytest.approx(line, rel=1e-6)
    entry = next(entry for entry in result.error_budget if entry.name == "slip")
    share = 1 - (P_IN + p_out) / 2 * (P_IN - p_out) * height / (
        slip.product * (potentials[1] - potentials[0])
    )
    assert entry.kind == "estimated"
    assert entry.upper == pytest.approx(1 + 0.04 * share)
    # In the lower end the film's ends, 8 um apart, shorten λ; c falls at most as 1/t.
    flights = 4 * drive.mean_free_path(VISCOSITY) / 8e-6
    assert 1 / (1 + flights) < entry.lower * entry.upper <= 1 + 1e-9
    assert all(words in entry.sentence for words in ("BGK", "Knudsen number"))
    # Kinetic theory is off by 4 % of what slip adds: below 1 % where that is little.
    for part, decision in ((1.06, "within limit"), (1.01, near), (0.94, "above limit")):
        limited = scene.with_({"limit.leak_rate": f"{part * result.leak_rate.value} m^3/s"})
        decided = verdict(limited, solved.leak_rate, solved.budget).decision
        assert decision == decided


@pytest.mark.parametrize("aspect", [32, 160, 1e4])
@pytest.mark.parametrize("p_in", [1e-2, 1.0, 1e2])
def test_molecules_without_collisions_in_a_slot(gap_scene, aspect, p_in):
    """Of the molecules that hit the inlet of a slot a part passes it (A. S. Berman 1965).

    The aspect is length over height. The mean free path is at least eight times the length. The
    kinetic law, that of an endless slot, gives more.
    """
    root, square = sqrt(1 + aspect**2), aspect**2
    blocked = 1.5 * (aspect - log(aspect + root)) ** 2
    blocked /= aspect**3 + 3 * square + 4 - (square + 4) * root
    part = 0.5 * (1 + root - aspect) - blocked
    length = width = 8e-6
    gap = np.full((9, 9), length / aspect)
    flow = {"inlet_pressure": p_in, "outlet_pressure": 0.0, "rtol": 0.01}
    case = gap_scene(gap, SLIPPING | {"slip": "kinetic"}, flow, spacing=(1e-6, 1e-6))
    result = solve(Scene.from_mapping(case)).result()
    # Molecules on an area and a second, times their mass: p √(M/(2π R T)).
    flux = p_in * sqrt(MOLAR_MASS / (2 * pi * GAS_CONSTANT * TEMPERATURE))
    exact = flux * width * length / aspect * part
    factor = exact / result.gas.mass_rate.value
    entry = next(entry for entry in result.error_budget if entry.name == "slip")
    assert entry.lower < factor < 1
    assert entry.caution
    assert "longer than a quarter of the film" in entry.sentence


@pytest.mark.parametrize("stated", [{}, {"reference_temperature": 300, "reference_pressure": 1e5}])
def test_one_gas_in_every_unit(gap_scene, stated):
    """The rates of one gas in all units agree through R T, M and the reference."""
    shown, gap = {}, 1e-6 * (1 + np.random.default_rng(4).random((9, 9)))
    T0, p0 = stated.values() or (273.15, 101325)
    for unit in ("l/min", "mbar l/s", "mol/s", "kg/s"):
        scene = gap_scene(gap, GAS | stated, leak_rate_unit=unit, products=["leak_rate"])
        scene = Scene.from_mapping(scene).with_({"flow.rtol": 0.5})
        result = solve(scene).result()
        shown[unit] = result.leak_rate_shown
        assert shown[unit].unit == unit
        assert shown[unit].lower <= shown[unit].value <= shown[unit].upper
    amount = shown["mol/s"].value
    throughput, normal = (amount * GAS_CONSTANT * T for T in (TEMPERATURE, T0))
    assert shown["mbar l/s"].value == pytest.approx(10 * throughput, rel=1e-12)
    assert shown["kg/s"].value == pytest.approx(amount * MOLAR_MASS, rel=1e-12)
    assert shown["l/min"].value == pytest.approx(60e3 * normal / p0, rel=1e-12)
    assert result.gas.mass_rate.value == shown["kg/s"].value
    assert result.leak_rate.value == pytest.approx(shown["l/min"].value / 60e3, rel=1e-12)


def test_vacuum_at_the_outlet():
    gas = air(1e5, 0.0)
    half = gas.pressure(np.array([-1e-9, 0.5, 1.0]) * gas.pressure_drop)
    np.testing.assert_allclose(half, [0.0, 1e5 / np.sqrt(2), 1e5], rtol=1e-14)


test_fluids_that_are_refused = refused_calls(
    (lambda: LiquidDrive(-1.0), "pressure_drop = -1.0 must be a positive number"),
    (lambda: LiquidDrive(1.0, -1.0), "outlet_pressure = -1.0 must be a finite number >= 0"),
    (lambda: air(P_OUT, P_IN), "inlet_pressure = 100000 Pa must be above outlet_pressure = 2"),
    (lambda: air(P_IN, np.nan), "outlet_pressure = nan must be"),
    (lambda: GasDrive(2.0, 1.0, -3.0, 0.0, 1.0, 1.0), "temperature = -3.0 must be a positive"),
    (lambda: Slip(2.0, 1.0, 0.0), "product = 0.0 must be a positive number"),
    (lambda: air().slip(VISCOSITY, 3.0), "accommodation = 3.0 must be above 0, and at most 1"),
    (lambda: air().slip(VISCOSITY, 0.0), "accommodation = 0.0 must be above 0, and at most 1"),
    (lambda: air().slip(VISCOSITY, 0.05, "kinetic"), "0.05 must lie between 0.1 and 1 for the"),
    (lambda: air().slip(VISCOSITY, 1.0, "foo"), "slip = 'foo' is unknown; choose from first-o"),
)


def test_mean_free_path_of_air():
    """Jennings, J. Aerosol Sci. 19, 159 (1988): 65.4 nm at 20 degC and 1 atm; M, η rounded here."""
    assert air(2 * 101325, 0.0).mean_free_path(1.82e-5) == pytest.approx(65.4e-9, rel=0.01)


def test_absolute_pressures_of_a_liquid(gap_scene):
    """Same leak rate as their difference; pressures are absolute then."""
    gap, water = np.full((5, 5), 1e-6), {"viscosity": 1e-3}
    absolute = {"inlet_pressure": "3 bar", "outlet_pressure": "1 bar"}
    by_drop = Patch(Scene.from_mapping(gap_scene(gap, water, {"pressure_drop": "2 bar"}))).leak_rate
    both = Patch(Scene.from_mapping(gap_scene(gap, water, absolute))).leak_rate
    assert both.value == by_drop.value
    np.testing.assert_array_equal(both.field.pressure, by_drop.field.pressure + 1e5)
    assert LiquidDrive(2e5).pressure(np.array([0.0])) == 0


def test_constriction_has_the_same_part_of_the_drop_for_gas_and_liquid(gap_scene):
    """Part of the drop of p² for a gas, of p for a liquid: equal up to rounding."""
    gap = np.full((17, 17), 1e-6)
    gap[7:10] = 0.0
    gap[7:10, 8:10] = 0.5e-6
    shares = []
    for fluid, flow in ((GAS, None), ({"viscosity": 1e-3}, {"pressure_drop": 1e5})):
        scene = gap_scene(gap, fluid, flow, products=["constriction"])
        constriction = solve(Scene.from_mapping(scene)).result().quantities.constriction
        shares.append(constriction.pressure_share)
    assert shares[0] == pytest.approx(shares[1], rel=1e-9)
    assert 0.3 < shares[0] < 1


@pytest.mark.parametrize(("rtol", "slips"), [(0.07, False), (0.03, True)])
def test_caution_where_the_gas_slips(gap_scene, rtol, slips):
    """Mean free path at 1.75 bar: 38 nm; 6 Kn = 0.023 at a gap of 10 um, against rtol/2."""
    flow = {"inlet_pressure": P_IN, "outlet_pressure": P_OUT, "rtol": rtol}
    gap = np.full((5, 5), 1e-5)
    gap[0, 0] = 0.0
    result = solve(Scene.from_mapping(gap_scene(gap, flow=flow))).result()
    assert any("slip of the gas" in text for text in result.cautions) is slips
    assert "mean free path 3" in dict(summary_of(result))["gas"]
    entry = next(entry for entry in result.error_budget if entry.name == "slip")
    kn = result.gas.mean_free_path / 1e-5
    most = (1 + 6 * kn) * (1 + EXCESS * kn)
    assert (entry.lower, entry.upper) == (1.0, None if slips else pytest.approx(most))
