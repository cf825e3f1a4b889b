"""The section of the fluid: a liquid, or an isothermal ideal gas."""

from collections.abc import Iterator
from functools import partial
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from fem_seal.errors import present
from fem_seal.fluid import Drive, GasDrive, LiquidDrive, Slip
from fem_seal.rarefied import LEAST_ACCOMMODATION
from fem_seal.scene.messages import ContradictionError
from fem_seal.scene.section import Number, Pressure, Section, Viscosity
from fem_seal.scene.sections import Flow
from fem_seal.units import to_si

Temperature = Annotated[float, BeforeValidator(partial(to_si, unit="K")), Field(gt=0)]
MolarMass = Annotated[float, BeforeValidator(partial(to_si, unit="kg/mol")), Field(gt=0)]

# Normal conditions of DIN 1343.
NORMAL_TEMPERATURE, NORMAL_PRESSURE = 273.15, 101325.0
# Lowest outlet pressure [Pa] that may be taken for the ambient pressure.
ATMOSPHERIC = 1e5
_NEEDED_BY_GAS = ("molar_mass", "temperature")


class Fluid(Section):
    """The fluid. A gas is ideal and isothermal, its viscosity independent of the pressure."""

    kind: Literal["liquid", "gas"] = Field("liquid", description='"liquid" or "gas"')
    viscosity: Viscosity = Field(description="dynamic viscosity η")
    molar_mass: MolarMass | None = Field(None, description="molar mass of a gas")
    temperature: Temperature | None = Field(
        None, description="temperature of a gas, the same everywhere"
    )
    reference_temperature: Temperature | None = Field(
        None, description="temperature at which the volume of a gas is stated; 0 degC if left out"
    )
    reference_pressure: Pressure | None = Field(
        None, description="pressure at which the volume of a gas is stated; 1 atm if left out"
    )

    slip: Literal["first-order", "kinetic", True, False] | None = Field(
        None,
        description='law of a gas that slips at the walls: "first-order" (true, or left out) or '
        '"kinetic"; false: no slip',
    )
    accommodation: Number | None = Field(
        None,
        gt=0,
        le=1,
        description="part of a gas's molecules that a wall reflects diffusely; 1 if left out",
    )

    @property
    def slip_law(self) -> str:
        """Name of the law of a gas that slips."""
        return self.slip if isinstance(self.slip, str) else "first-order"

    def drive(self, flow: Flow) -> Drive:
        """Drive of the flow; ContradictionError if its pressures do not fit the fluid."""
        return self._gas(flow) if self.kind == "gas" else _liquid(flow)

    def slip_under(self, flow: Flow) -> Slip | None:
        """Slip at the walls; None for a liquid, and where it is left out. Raises as `drive`."""
        if self.kind == "liquid" or self.slip is False:
            return None
        return self._gas(flow).slip(self.viscosity, self.accommodation or 1.0, self.slip_law)

    def _gas(self, flow: Flow) -> GasDrive:
        if flow.pressure_drop is not None:
            raise ContradictionError(
                "flow.pressure_drop does not fix the flow of a gas, which goes as p_in² - p_out²; "
                "give the absolute flow.inlet_pressure and flow.outlet_pressure instead"
            )
        inlet, outlet = flow.both_pressures("fluid.kind = 'gas'")
        return GasDrive(
            inlet_pressure=inlet,
            outlet_pressure=outlet,
            temperature=present(self.temperature, "fluid.temperature"),
            molar_mass=present(self.molar_mass, "fluid.molar_mass"),
            reference_temperature=self.reference_temperature or NORMAL_TEMPERATURE,
            reference_pressure=self.reference_pressure or NORMAL_PRESSURE,
        )

    def _contradictions(self) -> Iterator[str]:
        others = [name for name in type(self).model_fields if name not in ("kind", "viscosity")]
        of_gas = [name for name in others if getattr(self, name) is not None]
        if self.kind == "liquid" and of_gas:
            yield f"{of_gas[0]} is for kind = 'gas' only; this is a liquid"
        missing = [name for name in _NEEDED_BY_GAS if getattr(self, name) is None]
        if self.kind == "gas" and missing:
            yield f"{missing[0]} is missing: kind = 'gas' needs it"
        if self.slip is False and self.accommodation is not None:
            yield "accommodation is for a gas that slips: leave out slip"
        sigma = self.accommodation
        if self.slip == "kinetic" and sigma is not None and sigma < LEAST_ACCOMMODATION:
            yield (
                f"accommodation = {sigma:g} is below {LEAST_ACCOMMODATION:g}, the least that "
                "slip = 'kinetic' covers; slip = 'first-order' covers less"
            )


def _liquid(flow: Flow) -> LiquidDrive:
    inlet, outlet = flow.inlet_pressure, flow.outlet_pressure
    if flow.pressure_drop is not None:
        if inlet is not None or outlet is not None:
            raise ContradictionError(
                "give flow.pressure_drop, or flow.inlet_pressure and flow.outlet_pressure, not both"
            )
        return LiquidDrive(flow.pressure_drop)
    if inlet is None and outlet is None:
        raise ContradictionError("flow.pressure_drop is missing: a leak rate needs it")
    inlet, outlet = flow.both_pressures("without flow.pressure_drop a leak rate")
    return LiquidDrive(inlet - outlet, outlet)


def ambient_is_open(outlet: float | None, ambient: float | None) -> bool:
    """Whether the ambient pressure must be stated, since the outlet's is below 1 bar."""
    return ambient is None and outlet is not None and outlet < ATMOSPHERIC * (1 - 1e-9)
