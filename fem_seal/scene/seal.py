"""The section of the whole seal, whose patches the other sections describe."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo

from fem_seal.errors import present
from fem_seal.pressure_profile import Hertz, Profile, read_profile
from fem_seal.scene.section import (
    Count,
    Length,
    LineLoad,
    Number,
    Pressure,
    Seconds,
    Section,
    readable_file,
)

PROFILES = ("uniform", "hertz")
LENGTHS = {  # and what each of them is the length of
    "circumference": "seal across the flow",
    "leak_path": "contact from inlet to outlet",
}
RADII = ("inlet_radius", "outlet_radius")
CYLINDER = ("line_load", "cylinder_radius")


def _profile(value: object, info: ValidationInfo) -> Any:
    """Name of a profile, or the path of a table."""
    if value in PROFILES:
        return value
    if isinstance(value, str) and not value.endswith((".csv", ".txt", ".dat")):
        raise ValueError('must be "uniform", "hertz", or a .csv file with x and pressure')
    return readable_file(value, info)


class Seal(Section):
    """The seal that the patch is a part of; roughness and leak path are scales apart."""

    leak_path: Length | None = Field(
        None, description="length from inlet to outlet, the width of the contact"
    )
    circumference: Length | None = Field(None, description="length of the seal across the flow")
    inlet_radius: Length | None = Field(
        None, description="radius of a flat ring at its inlet, for leak_path and circumference"
    )
    outlet_radius: Length | None = Field(
        None, description="radius of the ring at its outlet; larger or smaller"
    )
    pressure_profile: Annotated[Literal["uniform", "hertz"] | Path, BeforeValidator(_profile)] = (
        Field("uniform", description='"uniform", "hertz", or a .csv file with x and pressure')
    )
    maximum_pressure: Pressure | None = Field(
        None, description="maximum of Hertz's profile, in place of contact.pressure, its mean"
    )
    line_load: LineLoad | None = Field(
        None, description="force per length of a cylinder, for contact.pressure and leak_path"
    )
    cylinder_radius: Length | None = Field(
        None, description="radius of the cylinder that line_load presses; 1/R = 1/R1 + 1/R2"
    )
    patches: Count = Field(
        1, le=1000, description="realizations: seeds, twins of a map, or windows of it"
    )
    window: tuple[Length, Length] | None = Field(
        None, description="[along, across] the flow: patches are windows of a map many waves wide"
    )
    rtol: Number = Field(
        0.2,
        ge=1e-6,
        description="largest (upper - lower) / sqrt(lower upper) of a seal of like patches, for "
        "each patch",
    )
    max_loads: Count = Field(40, ge=4, description="most net loads of each patch")
    max_seconds: Seconds | None = Field(
        None, description="time limit of each patch, at which its bounds so far are taken"
    )

    @property
    def table(self) -> Path | None:
        """File of the pressure profile; None for a named one."""
        return self.pressure_profile if isinstance(self.pressure_profile, Path) else None

    @property
    def is_ring(self) -> bool:
        """Whether the fluid leaks from one radius of a flat ring to the other."""
        return self.inlet_radius is not None

    @property
    def own_load(self) -> str | None:
        """Name of the field that gives the load, in place of contact.pressure."""
        if self.table is not None:
            return "pressure_profile"
        names = ("maximum_pressure", "line_load")
        return next((name for name in names if getattr(self, name) is not None), None)

    def own_profile(self, contact_modulus: float, width: float | None = None) -> Profile | None:
        """Profile of the `own_load`; None without one.

        A table and a line load have widths of their own. Hertz's profile of a maximum pressure is
        as wide as given [m]; without a width, whose choice does not change its mean, 1 m.
        """
        if self.table is not None:
            return read_profile(self.table)
        if self.line_load is not None:
            radius = present(self.cylinder_radius, "seal.cylinder_radius")
            return Hertz.pressed(self.line_load, radius, contact_modulus)
        return Hertz(self.maximum_pressure, width or 1.0) if self.maximum_pressure else None

    def _contradictions(self) -> Iterator[str]:
        for names in (CYLINDER, RADII):
            missing = [name for name in names if getattr(self, name) is None]
            if len(missing) == 1:
                (other,) = set(names) - set(missing)
                yield f"{missing[0]} is missing: {other} needs it"
        for name in ("maximum_pressure", "line_load"):
            if getattr(self, name) is not None and self.pressure_profile != "hertz":
                yield f'{name} is of a cylinder: set pressure_profile = "hertz", or leave it out'
        if self.line_load is not None and self.maximum_pressure is not None:
            yield "maximum_pressure and line_load both give the pressure; leave one of them out"
        given = {}  # lengths that other fields give
        if self.is_ring:
            given = dict.fromkeys(LENGTHS, "the radii of the ring give it")
            if self.line_load is not None:
                yield (
                    "line_load gives the width of the contact, and so do the radii of the ring; "
                    "give circumference in place of the radii, or maximum_pressure in place of "
                    "line_load and cylinder_radius"
                )
            if self.inlet_radius == self.outlet_radius:
                yield "inlet_radius and outlet_radius of the ring must differ"
        elif self.table is not None:
            given["leak_path"] = "it is the length of the table of pressure_profile"
        elif self.line_load is not None:
            given["leak_path"] = "line_load and cylinder_radius give it"
        for name, what in LENGTHS.items():
            if name in given and getattr(self, name) is not None:
                yield f"{name} must be left out: {given[name]}"
            if name not in given and getattr(self, name) is None:
                yield (
                    f"{name} is missing: give the length of the {what}, or inlet_radius and "
                    "outlet_radius of a flat ring"
                )
