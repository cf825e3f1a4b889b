"""The limit of the leak rate, in customary units."""

from typing import Annotated

from pydantic import Field, PlainSerializer, PlainValidator

from fem_seal.fluid import Drive
from fem_seal.scene.measured import Truth
from fem_seal.scene.sections import Section
from fem_seal.units import StatedRate

LeakRateLimit = Annotated[StatedRate, PlainValidator(StatedRate.parse), PlainSerializer(str)]


class Limit(Section):
    """Largest leak rate that is allowed."""

    leak_rate: LeakRateLimit = Field(description="largest leak rate that is allowed")
    decide: Truth = Field(False, description="refine until the bounds decide, and no further")

    def volume_rate(self, drive: Drive) -> float:
        """The same limit for the solved leak rate, of a gas at reference conditions [m^3/s]."""
        return self.leak_rate.si / drive.rates[self.leak_rate.unit.kind]
