"""The section of the whole seal, whose patches the other sections describe."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from fem_seal.scene.messages import ContradictionError
from fem_seal.scene.sections import Count, Length, Number, Section, readable_file

PROFILES = ("uniform", "hertz")


def _profile(value: object, info: ValidationInfo) -> Any:
    """Name of a profile, or the path of a table."""
    if value in PROFILES:
        return value
    if isinstance(value, str) and not value.endswith((".csv", ".txt", ".dat")):
        raise ValueError('should be "uniform", "hertz", or a .csv file with x and pressure')
    return readable_file(value, info)


class Seal(Section):
    """The seal that the patch is a part of; scales apart."""

    leak_path: Length | None = Field(
        None, description="length from inlet to outlet, the width of the contact"
    )
    circumference: Length = Field(description="length of the seal across the flow")
    pressure_profile: Annotated[Literal["uniform", "hertz"] | Path, BeforeValidator(_profile)] = (
        Field("uniform", description='"uniform", "hertz", or a .csv file with x and pressure')
    )
    patches: Count = Field(1, le=1000, description="realizations: seeds, or twins of a map")
    rtol: Number = Field(
        0.2, ge=1e-6, description="(upper - lower) / sqrt(lower upper) wanted of each patch"
    )
    max_loads: Count = Field(40, ge=4, description="most net loads of each patch")

    @property
    def table(self) -> Path | None:
        """File of the pressure profile; None for a named one."""
        return self.pressure_profile if isinstance(self.pressure_profile, Path) else None

    @model_validator(mode="after")
    def _check(self) -> "Seal":
        if self.table is None and self.leak_path is None:
            raise ContradictionError(
                "leak_path is missing: give the length of the contact from inlet to outlet"
            )
        if self.table is not None and self.leak_path is not None:
            raise ContradictionError(
                "leak_path is the length of the table of pressure_profile already; leave it out"
            )
        return self
