"""The section that says how well the user knows the inputs: ± of each."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field, PlainSerializer, PlainValidator, ValidationInfo

from fem_seal.scene.section import Section
from fem_seal.units import to_si


@dataclass(frozen=True)
class InputTolerance:
    """± of an input."""

    text: str  #: as the user wrote it
    value: float  #: > 0, a part of the input, < 1, or an amount in its SI unit
    is_part: bool

    def __str__(self) -> str:
        return self.text

    def relative(self, given: float) -> float:
        """The tolerance as a part of the given value of the input."""
        return self.value if self.is_part else self.value / given


# SI units in which ± of an input may be given as an amount; pressures are the rest.
_UNITS = {"line_load": "N/m", "viscosity": "Pa s", "heights": None}


def _tolerance(value: object, info: ValidationInfo) -> InputTolerance:
    """Read "10 %", or a number with a unit such as "0.01 MPa" where the input has one."""
    unit = _UNITS.get(info.field_name or "", "Pa")
    expected = "must be a part such as '10 %'"
    if unit is not None:
        expected += f" or an amount with a unit of {unit}"
    if not isinstance(value, str):
        raise ValueError(expected)
    number = value.removesuffix("%").strip()
    if number != value.strip():
        try:
            part = float(number) / 100
        except ValueError:
            raise ValueError(expected) from None
        if not 0 < part < 1:
            raise ValueError("must be above 0 % and below 100 %; leave out what you know exactly")
        return InputTolerance(value, part, is_part=True)
    if unit is None:
        raise ValueError(expected)
    amount = to_si(value, unit)
    if not amount > 0:
        raise ValueError("must be above 0; leave out what you know exactly")
    return InputTolerance(value, amount, is_part=False)


_Tolerance = Annotated[InputTolerance, PlainValidator(_tolerance), PlainSerializer(str)]


class OfContact(Section):
    """Tolerances of [contact]."""

    pressure: _Tolerance | None = Field(None, description="± of contact.pressure")


class OfSeal(Section):
    """Tolerances of [seal]."""

    line_load: _Tolerance | None = Field(None, description="± of seal.line_load")


class OfSolid(Section):
    """Tolerances of [solid]."""

    youngs_modulus: _Tolerance | None = Field(None, description="± of solid.youngs_modulus")
    contact_modulus: _Tolerance | None = Field(None, description="± of solid.contact_modulus")


class OfFluid(Section):
    """Tolerances of [fluid]."""

    viscosity: _Tolerance | None = Field(None, description="± of fluid.viscosity")


class OfFlow(Section):
    """Tolerances of [flow]."""

    pressure_drop: _Tolerance | None = Field(None, description="± of flow.pressure_drop")
    inlet_pressure: _Tolerance | None = Field(None, description="± of flow.inlet_pressure")
    outlet_pressure: _Tolerance | None = Field(None, description="± of flow.outlet_pressure")


class Tolerances(Section):
    """± of what the user does not know exactly."""

    contact: OfContact = Field(OfContact(), description="± of its fields")
    seal: OfSeal = Field(OfSeal(), description="± of its fields")
    solid: OfSolid = Field(OfSolid(), description="± of its fields")
    fluid: OfFluid = Field(OfFluid(), description="± of its fields")
    flow: OfFlow = Field(OfFlow(), description="± of its fields")
    heights: _Tolerance | None = Field(None, description="± of one factor on all heights")

    def given(self) -> Iterator[tuple[str, InputTolerance]]:
        """Names of the inputs, such as "contact.pressure" or "heights", and their tolerances."""
        for name, value in self:
            if isinstance(value, Section):
                yield from ((f"{name}.{key}", one) for key, one in value if one is not None)
            elif value is not None:
                yield name, value
