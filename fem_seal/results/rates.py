"""The leak rate in other units than m³/s, for result.json."""

from fem_seal.errors import present
from fem_seal.fluid import GasDrive, volume_conditions
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Patch
from fem_seal.quantities.headline import Shown
from fem_seal.quantities.slip import knudsen_number
from fem_seal.results.record import Record
from fem_seal.units import RATES, RateUnit


class Rate(Record):
    """Leak rate with guaranteed bounds, which finite differences do not have."""

    value: float
    lower: float | None
    upper: float | None
    unit: str = "m^3/s"

    @classmethod
    def of(cls, leak: LeakRate | None, shown: Shown | None = None) -> "Rate | None":
        """Value and bounds of a leak rate in a unit; None if nothing limits it (lifted off)."""
        if leak is None or leak.state == "lifted off":
            return None
        return cls.in_unit(leak, shown or Shown())

    @classmethod
    def in_unit(cls, leak: LeakRate, shown: Shown) -> "Rate":
        """Value and bounds of a leak rate that has a limit."""
        lower, upper = (
            None if b is None else b * shown.per_solved for b in (leak.lower, leak.upper)
        )
        return cls(value=leak.value * shown.per_solved, lower=lower, upper=upper, unit=shown.name)


class GasRecord(Record):
    """Rates of a gas that do not depend on reference conditions."""

    mass_rate: Rate
    amount_rate: Rate
    throughput: Rate
    reference_temperature: float  #: T0 [K]
    reference_pressure: float  #: p0 [Pa]
    mean_free_path: float  #: at the mean of the two pressures [m]
    #: The mean free path over the critical gap; None if sealed, and of a whole seal.
    knudsen_number: float | None = None
    slip: str | None = None  #: law at the walls, "first-order" or "kinetic"
    accommodation: float | None = None  #: coefficient of the walls

    @classmethod
    def of(cls, patch: Patch, leak: LeakRate | None) -> "GasRecord | None":
        """Rates of a patch or its seal; None for a liquid, without a flow, or if lifted off."""
        if leak is None or leak.state == "lifted off":
            return None
        if not isinstance(patch.scene.drive, GasDrive):
            return None
        gas = patch.scene.drive
        fluid = present(patch.scene.fluid, "[fluid]")
        rates = {
            kind: Rate.in_unit(leak, Shown(RATES[kind], size)) for kind, size in gas.rates.items()
        }
        return cls(
            mass_rate=rates["mass"],
            amount_rate=rates["amount"],
            throughput=rates["throughput"],
            reference_temperature=gas.reference_temperature,
            reference_pressure=gas.reference_pressure,
            mean_free_path=gas.mean_free_path(fluid.viscosity),
            knudsen_number=None if patch.scene.seal is not None else knudsen_number(patch),
            slip=None if patch.scene.slip is None else fluid.slip_law,
            accommodation=None if patch.scene.slip is None else fluid.accommodation or 1.0,
        )


def unit_words(unit: str, gas: GasRecord | None) -> str:
    """Unit of a leak rate; of a volume of gas with the conditions at which it is stated."""
    if gas is None or RateUnit.parse(unit).kind != "volume":
        return unit
    return f"{unit} {volume_conditions(gas.reference_temperature, gas.reference_pressure)}"
