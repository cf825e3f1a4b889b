"""Leak rates in customary units: exact factors, consistent rates of a gas, bad units refused."""

import numpy as np
import pytest

from fem_seal.scene import Scene
from fem_seal.solved import solve
from fem_seal.units import RateUnit, StatedRate

GAS = {"kind": "gas", "viscosity": 1.8e-5, "temperature": 293.15, "molar_mass": 0.029}


@pytest.mark.parametrize(
    ("unit", "kind", "size"),
    [
        ("ml/h", "volume", 1e-6 / 3600),
        ("l/min", "volume", 1e-3 / 60),
        ("cm^3/min", "volume", 1e-6 / 60),
        ("mbar l/s", "throughput", 0.1),
        ("Pa m^3/s", "throughput", 1.0),
        ("W", "throughput", 1.0),
        ("mol/s", "amount", 1.0),
        ("umol/h", "amount", 1e-6 / 3600),
        ("g/year", "mass", 1e-3 / (365.25 * 86400)),
    ],
)
def test_units_of_leak_rates(unit, kind, size):
    """Tolerance: two roundings, of pint's decimal quotient and of the expected value."""
    rate_unit = RateUnit.parse(unit)
    assert (rate_unit.name, rate_unit.kind) == (unit, kind)
    assert rate_unit.size == pytest.approx(size, rel=4e-16, abs=0)


@pytest.mark.parametrize("unit", ["m/s", "degC", "", "litres", "1 ml/h", "2", 5, None])
def test_bad_units_of_a_leak_rate_are_refused(unit):
    with pytest.raises(ValueError, match="volume"):
        RateUnit.parse(unit)


@pytest.mark.parametrize("unit", ["slm", "slpm", "sccm", "Nl/min", "std cm^3/min"])
def test_units_of_standard_conditions_are_refused(unit):
    """Pint's slm is 1.68875 Pa m³/s: with the pressure times volume of a gas of 20 degC, a mass
    flow of 1 slm would count as 1.073."""
    with pytest.raises(ValueError, match=r"fluid\.reference_temperature"):
        RateUnit.parse(unit)


@pytest.mark.parametrize(
    "rate", [3e-10, "1", "ml/h", "0 ml/h", "-1 ml/h", "1 m", "1e999 ml/h", True, None]
)
def test_bad_leak_rates_are_refused(rate):
    with pytest.raises(ValueError, match=r"leak rate|greater than 0"):
        StatedRate.parse(rate)


def test_text_of_a_leak_rate_is_that_it_was_read_from():
    rate = StatedRate.parse("0.25 ml/h")
    assert StatedRate.parse(str(rate)) == rate


@pytest.fixture
def scene(scene_of_gap):
    """Function that makes the scene of an open gap with a fluid and flow settings."""
    values = 1e-6 * (1 + np.random.default_rng(4).random((9, 9)))

    def make(fluid=GAS, **flow):
        flow = flow or {"inlet_pressure": 2e5, "outlet_pressure": 1e5}
        return scene_of_gap(values, fluid=dict(fluid), flow=flow)

    return make


def test_one_gas_in_every_unit(scene):
    """The rates of one gas in all units agree through R T, M and the reference."""
    shown = {}
    for unit in ("l/min", "mbar l/s", "mol/s", "kg/s"):
        data = scene()
        data["output"]["leak_rate_unit"] = unit
        result = solve(Scene.from_mapping(data)).result()
        shown[unit] = result.leak_rate_shown
        assert shown[unit].unit == unit
        assert shown[unit].lower <= shown[unit].value <= shown[unit].upper
    R, amount = 8.31446261815324, shown["mol/s"].value
    assert shown["mbar l/s"].value == pytest.approx(10 * amount * R * 293.15, rel=1e-12, abs=0)
    assert shown["kg/s"].value == pytest.approx(amount * 0.029, rel=1e-12, abs=0)
    normal_litres = 60e3 * amount * R * 273.15 / 101325
    assert shown["l/min"].value == pytest.approx(normal_litres, rel=1e-12, abs=0)
    assert result.gas.mass_rate.value == shown["kg/s"].value
    assert result.leak_rate.value == pytest.approx(shown["l/min"].value / 60e3, rel=1e-12, abs=0)
