"""The leak rate in other units than m³/s, for result.json."""

from typing import Literal

from fem_seal.errors import present
from fem_seal.fluid import GasDrive, volume_conditions
from fem_seal.leak_rate import LeakRate, rate_text
from fem_seal.patch import Patch
from fem_seal.quantities.of_patch import shown_in
from fem_seal.quantities.slip import knudsen_number
from fem_seal.results.record import Record
from fem_seal.units import RATES, RateUnit


class RateBounds(Record):
    """Leak rate with guaranteed bounds, which finite differences do not have."""

    value: float
    lower: float | None
    upper: float | None
    unit: Literal["m^3/s"] = "m^3/s"

    @classmethod
    def of(cls, leak: LeakRate) -> "RateBounds | None":
        """Value and bounds of a leak rate; None if it has no limit (lifted off)."""
        if leak.state == "lifted off":
            return None
        return cls(value=leak.value, lower=leak.lower, upper=leak.upper)


class RateRecord(Record):
    """Leak rate with its bounds in another unit."""

    value: float
    lower: float | None
    upper: float | None
    unit: str

    @classmethod
    def of(cls, leak: LeakRate, unit: str, per_solved: float) -> "RateRecord":
        """Convert a leak rate; 1 m³/s of it are `per_solved` in `unit`."""
        lower, upper = (None if b is None else b * per_solved for b in (leak.lower, leak.upper))
        return cls(value=leak.value * per_solved, lower=lower, upper=upper, unit=unit)

    @classmethod
    def shown(cls, patch: Patch) -> "RateRecord | None":
        """The leak rate in output.leak_rate_unit, if the scene names one."""
        return cls.in_unit(patch, patch.leak_rate) if patch.scene.needs_flow else None

    @classmethod
    def in_unit(cls, patch: Patch, leak: LeakRate) -> "RateRecord | None":
        """A leak rate of the patch or its seal in output.leak_rate_unit, if there is one."""
        if patch.scene.output.leak_rate_unit is None or leak.state == "lifted off":
            return None
        unit = shown_in(patch)
        return cls.of(leak, unit.name, unit.per_solved)


class GasRecord(Record):
    """Rates of a gas that do not depend on reference conditions.

    Attributes
    ----------
    mass_rate, amount_rate, throughput : RateRecord
    reference_temperature, reference_pressure : float
        T0 [K], p0 [Pa].
    mean_free_path : float
        Mean free path at the mean of the two pressures [m].
    knudsen_number : float or None
        The mean free path over the critical gap; None if sealed, and of a whole seal.
    slip : str or None
        Law of slip at the walls, "first-order" or "kinetic"; None without slip.
    accommodation : float or None
        Accommodation coefficient of the walls; None without slip.
    """

    mass_rate: RateRecord
    amount_rate: RateRecord
    throughput: RateRecord
    reference_temperature: float
    reference_pressure: float
    mean_free_path: float
    knudsen_number: float | None = None
    slip: str | None = None
    accommodation: float | None = None

    @classmethod
    def of(cls, patch: Patch, leak: LeakRate | None) -> "GasRecord | None":
        """Rates of a patch or its seal; None for a liquid, without a flow, or if lifted off."""
        if leak is None or leak.state == "lifted off":
            return None
        if not isinstance(patch.scene.drive, GasDrive):
            return None
        gas = patch.scene.drive
        fluid = present(patch.scene.fluid, "[fluid]")
        rates = {kind: RateRecord.of(leak, RATES[kind], size) for kind, size in gas.rates.items()}
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
    """Unit of a leak rate; of a volume of gas with the conditions at which it is stated.

    Parameters
    ----------
    unit : str
        Unit, such as "ml/h".
    gas : GasRecord or None
        Part of the result about its gas; None for a liquid.
    """
    if gas is None or RateUnit.parse(unit).kind != "volume":
        return unit
    return f"{unit} {volume_conditions(gas.reference_temperature, gas.reference_pressure)}"


def rate_words(rate: RateBounds | RateRecord, gas: GasRecord | None = None) -> str:
    """Leak rate and bounds in the unit of a record, as `unit_words` has it."""
    return rate_text(rate.value, rate.lower, rate.upper, unit_words(rate.unit, gas))
