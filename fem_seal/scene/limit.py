"""Leak rates in customary units: what they are shown in, and the limit they are held against."""

from typing import TYPE_CHECKING, Annotated

from pydantic import Field, PlainSerializer, PlainValidator

from fem_seal.fluid import Drive
from fem_seal.scene.measured import Truth
from fem_seal.scene.messages import ContradictionError
from fem_seal.scene.sections import Section
from fem_seal.units import Rate, RateUnit

if TYPE_CHECKING:
    from fem_seal.scene.scene import Scene

MOST = 1e100  # m³/s, of a limit; in any unit it is still a number
LeakRateLimit = Annotated[Rate, PlainValidator(Rate.parse), PlainSerializer(str)]


class Limit(Section):
    """What the seal may leak at most."""

    leak_rate: LeakRateLimit = Field(description="highest leak rate allowed")
    decide: Truth = Field(False, description="refine until the bounds decide, and no further")

    def volume_rate(self, drive: Drive) -> float:
        """The same limit for the solved leak rate, of a gas at reference conditions [m^3/s]."""
        return self.leak_rate.si / drive.rates[self.leak_rate.unit.kind]


def check_rates(scene: "Scene", drive: Drive) -> None:
    """Hold units and limit against the fluid; ContradictionError where they do not fit."""
    if scene.output.leak_rate_unit is not None:
        _require_kind("output.leak_rate_unit", scene.output.leak_rate_unit, drive)
    limit = scene.limit
    if limit is None:
        return
    _require_kind("limit.leak_rate", limit.leak_rate.unit, drive)
    if not 1 / MOST < limit.volume_rate(drive) < MOST:
        raise ContradictionError(
            f"limit.leak_rate = {limit.leak_rate.number:g} {limit.leak_rate.unit.name} is no leak "
            "rate of this world; check its unit"
        )
    flow = scene.flow
    if flow.method == "finite-difference":
        raise ContradictionError(
            "[limit] is decided by bounds, and flow.method = 'finite-difference' has none; choose "
            "adaptive or uniform"
        )
    if limit.decide and scene.accuracy is not None:
        raise ContradictionError(
            "limit.decide and accuracy.total both say when to stop; give one of the two"
        )
    if limit.decide and not (flow.max_unknowns or flow.max_seconds or flow.max_memory):
        raise ContradictionError(
            "limit.decide needs flow.max_unknowns, flow.max_seconds or flow.max_memory, since a "
            "leak rate that equals the limit is never decided"
        )


def refuse_rates(scene: "Scene") -> None:
    """ContradictionError where a scene without a leak rate says how to show or judge it."""
    for what, given in (
        ("[limit]", scene.limit),
        ("output.leak_rate_unit", scene.output.leak_rate_unit),
    ):
        if given is not None:
            raise ContradictionError(
                f"{what} is about the leak rate, which output.products does not name"
            )


def _require_kind(field: str, unit: RateUnit, drive: Drive) -> None:
    if unit.kind in drive.rates:
        return
    raise ContradictionError(
        f"{field} in {unit.name!r} is {_IN_WORDS[unit.kind]} per time, but a liquid leaks a volume "
        "per time, such as ml/h"
    )


_IN_WORDS = {
    "throughput": "a pressure times a volume",
    "amount": "an amount",
    "mass": "a mass",
}
