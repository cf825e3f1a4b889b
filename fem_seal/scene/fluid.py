"""The section of the fluid: a liquid, or an isothermal ideal gas."""

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from fem_seal.errors import present
from fem_seal.fluid import Drive, GasDrive, LiquidDrive, Slip
from fem_seal.rarefied import LEAST_ACCOMMODATION
from fem_seal.scene.messages import ContradictionError
from fem_seal.scene.sections import Pressure, Section, Viscosity
from fem_seal.units import to_si

if TYPE_CHECKING:
    from fem_seal.scene.sections import Flow

Temperature = Annotated[float, BeforeValidator(partial(to_si, unit="K")), Field(gt=0)]
MolarMass = Annotated[float, BeforeValidator(partial(to_si, unit="kg/mol")), Field(gt=0)]

# Normal conditions of DIN 1343.
NORMAL_TEMPERATURE, NORMAL_PRESSURE = 273.15, 101325.0
# Lowest outlet pressure [Pa] that may be taken for the ambient pressure.
ATMOSPHERIC = 1e5
_NEEDED_BY_GAS = ("molar_mass", "temperature")
_OF_GAS = (
    *_NEEDED_BY_GAS,
    "reference_temperature",
    "reference_pressure",
    "slip",
    "accommodation",
)


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
    accommodation: float | None = Field(
        None,
        gt=0,
        le=1,
        description="part of a gas's molecules that a wall reflects diffusely; 1 if left out",
    )

    @property
    def slip_law(self) -> str:
        """Name of the law of a gas that slips."""
        return self.slip if isinstance(self.slip, str) else "first-order"

    @model_validator(mode="after")
    def _check(self) -> "Fluid":
        of_gas = [name for name in _OF_GAS if getattr(self, name) is not None]
        if self.kind == "liquid" and of_gas:
            raise ContradictionError(f"{of_gas[0]} is for kind = 'gas' only; this is a liquid")
        missing = [name for name in _NEEDED_BY_GAS if getattr(self, name) is None]
        if self.kind == "gas" and missing:
            raise ContradictionError(f"{missing[0]} is missing: kind = 'gas' needs it")
        if self.slip is False and self.accommodation is not None:
            raise ContradictionError("accommodation is for a gas that slips: leave out slip")
        sigma = self.accommodation
        if self.slip == "kinetic" and sigma is not None and sigma < LEAST_ACCOMMODATION:
            raise ContradictionError(
                f"accommodation = {sigma:g} is below {LEAST_ACCOMMODATION:g}, the least that "
                "slip = 'kinetic' covers; slip = 'first-order' covers less"
            )
        return self


def drive(fluid: Fluid, flow: "Flow") -> Drive:
    """Drive of the flow, from the sections of the fluid and the flow.

    Raises
    ------
    ContradictionError
        If pressures are missing, stated twice, or of the wrong kind for the fluid.
    """
    return _gas(fluid, flow) if fluid.kind == "gas" else _liquid(flow)


def slip_of(fluid: Fluid, flow: "Flow") -> Slip | None:
    """Slip of a gas at the walls; None where it is not computed.

    Raises
    ------
    ContradictionError
        As of `drive`.
    """
    if fluid.kind == "liquid" or fluid.slip is False:
        return None
    drive = _gas(fluid, flow)
    return drive.slip(fluid.viscosity, fluid.accommodation or 1.0, fluid.slip_law)


def gauge_pressures(flow: "Flow") -> tuple[float, float]:
    """Pressures of inlet and outlet above that on the back of the solid [Pa].

    If the ambient pressure is left out, it is that of the outlet.
    """
    if flow.pressure_drop is not None:
        return flow.pressure_drop, 0.0
    inlet, outlet = _both_pressures(flow, "a leak rate")
    ambient = outlet if flow.ambient_pressure is None else flow.ambient_pressure
    return inlet - ambient, outlet - ambient


def with_ambient_pressure(scene: Mapping[str, Any]) -> Mapping[str, Any]:
    """Add the ambient pressure to the scene of an earlier version, which could leave it out.

    Parameters
    ----------
    scene : as `Scene.to_mapping` returns it, in SI units
    """
    flow = scene.get("flow", {})
    outlet = flow.get("outlet_pressure")
    if not ambient_is_open(outlet, flow.get("ambient_pressure")):
        return scene
    return {**scene, "flow": {**flow, "ambient_pressure": outlet}}


def ambient_is_open(outlet: float | None, ambient: float | None) -> bool:
    """Whether the ambient pressure must be stated, since the outlet's is below 1 bar."""
    return ambient is None and outlet is not None and outlet < ATMOSPHERIC * (1 - 1e-9)


def _liquid(flow: "Flow") -> LiquidDrive:
    inlet, outlet = flow.inlet_pressure, flow.outlet_pressure
    if flow.pressure_drop is not None:
        if inlet is not None or outlet is not None:
            raise ContradictionError(
                "give flow.pressure_drop, or flow.inlet_pressure and flow.outlet_pressure, not both"
            )
        return LiquidDrive(flow.pressure_drop)
    if inlet is None and outlet is None:
        raise ContradictionError("flow.pressure_drop is missing: a leak rate needs it")
    inlet, outlet = _both_pressures(flow, "without flow.pressure_drop a leak rate")
    return LiquidDrive(inlet - outlet, outlet)


def _gas(fluid: Fluid, flow: "Flow") -> GasDrive:
    if flow.pressure_drop is not None:
        raise ContradictionError(
            "flow.pressure_drop does not fix the flow of a gas, which goes as p_in² - p_out²; give "
            "the absolute flow.inlet_pressure and flow.outlet_pressure instead"
        )
    inlet, outlet = _both_pressures(flow, "fluid.kind = 'gas'")
    return GasDrive(
        inlet_pressure=inlet,
        outlet_pressure=outlet,
        temperature=present(fluid.temperature, "fluid.temperature"),
        molar_mass=present(fluid.molar_mass, "fluid.molar_mass"),
        reference_temperature=fluid.reference_temperature or NORMAL_TEMPERATURE,
        reference_pressure=fluid.reference_pressure or NORMAL_PRESSURE,
    )


def _both_pressures(flow: "Flow", who: str) -> tuple[float, float]:
    """Absolute pressures of inlet and outlet, the higher one at the inlet."""
    inlet, outlet = flow.inlet_pressure, flow.outlet_pressure
    if inlet is None or outlet is None:
        name = "inlet_pressure" if inlet is None else "outlet_pressure"
        raise ContradictionError(f"flow.{name} is missing: {who} needs both absolute pressures")
    if inlet <= outlet:
        raise ContradictionError(
            f"flow.inlet_pressure = {inlet:g} Pa must be above flow.outlet_pressure "
            f"= {outlet:g} Pa; swap the gap's ends if it leaks the other way"
        )
    return inlet, outlet
