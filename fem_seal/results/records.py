"""The parts of result.json, each made of the solver's own objects."""

from math import isfinite
from typing import Annotated

import numpy as np
from pydantic import AliasChoices, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from fem_seal.errors import present
from fem_seal.fluid import GasDrive
from fem_seal.leak_rate import Bounded, FlowState, LeakRate
from fem_seal.patch import Patch
from fem_seal.quantities.headline import SI, ShownUnit
from fem_seal.quantities.lift import lift_range
from fem_seal.scene.readable import own_names
from fem_seal.slip_error import knudsen_number
from fem_seal.units import RATES
from fem_seal.upscaling.conductivity import ConductivityTable
from fem_seal.upscaling.path_flow import PathFlow, SealingPart
from fem_seal.upscaling.seal import SealLeak, median_patch

POINTS = 400  # of the leak path in the record

# A number in JSON, which has no infinity: null if it is infinite or not known.
Finite = Annotated[
    float | None,
    BeforeValidator(lambda x: x if not isinstance(x, float) or isfinite(x) else None),
]


class Record(BaseModel):
    """Part of a result: frozen, without unknown fields, made of an object with such attributes."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", populate_by_name=True, from_attributes=True
    )

    def __dir__(self) -> list[str]:
        """Names of a record, without those that pydantic adds."""
        return own_names(self)


class Rate(Record):
    """Leak rate with bounds, which finite differences do not have."""

    value: float
    lower: float | None
    upper: float | None
    unit: str = "m^3/s"

    @classmethod
    def of(cls, leak: LeakRate | None, shown: ShownUnit = SI) -> "Rate | None":
        """Value and bounds of a leak rate in a unit; None if nothing limits it (lifted off)."""
        if leak is None or leak.state == "lifted off":
            return None
        ends = (leak.value, leak.lower, leak.upper)
        value, lower, upper = (None if end is None else end * shown.per_solved for end in ends)
        return cls(value=present(value, "value"), lower=lower, upper=upper, unit=shown.name)


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
        gas = None if leak is None or leak.state == "lifted off" else patch.scene.drive
        if not isinstance(gas, GasDrive):
            return None
        fluid = present(patch.scene.fluid, "[fluid]")
        kinds = ("mass", "amount", "throughput")
        rates = (Rate.of(leak, ShownUnit(RATES[kind], gas.rates[kind])) for kind in kinds)
        mass, amount, throughput = (present(rate, "leak rate") for rate in rates)
        return cls(
            mass_rate=mass,
            amount_rate=amount,
            throughput=throughput,
            reference_temperature=gas.reference_temperature,
            reference_pressure=gas.reference_pressure,
            mean_free_path=gas.mean_free_path(fluid.viscosity),
            knudsen_number=None if patch.scene.seal is not None else knudsen_number(patch),
            slip=None if patch.scene.slip is None else fluid.slip_law,
            accommodation=None if patch.scene.slip is None else fluid.accommodation or 1.0,
        )


class DryRecord(Record):
    """The contact without the fluid's pressure."""

    contact_area_fraction: float
    mean_gap: float


class LiftRecord(Record):
    """Loads, Newton's steps and leak rates of a lift; docs/reference/results.md explains each."""

    model: str
    solid_pressure: float | None = None
    fluid_pressure: float | None = None
    steps: int = 0
    change: Finite = None
    lowest: Finite
    highest: Finite
    dry: DryRecord
    settled: bool = True
    residuals: tuple[float, ...] = ()

    @model_validator(mode="after")
    def _with_both_loads(self) -> "LiftRecord":
        if self.solid_pressure is not None and self.fluid_pressure is None:
            raise ValueError("must hold the fluid's load beside the solid's")
        return self

    @classmethod
    def of(cls, patch: Patch) -> "LiftRecord | None":
        """Record of a patch; None if flow.lift is "none"."""
        model = patch.scene.lift
        if model == "none":
            return None
        dry = DryRecord.model_validate(present(patch.contact, "contact"))
        if model == "range":
            low, high = lift_range(patch)
            lowest, highest = low.range[0], high.range[1]
            return cls(model=model, lowest=lowest, highest=highest, dry=dry)
        state = present(patch.lifted, "lifted state")
        return cls(
            model=model,
            solid_pressure=state.contact.mean_pressure if state.contact else None,
            fluid_pressure=state.fluid_load,
            steps=state.steps,
            change=state.change if state.contact else None,
            lowest=state.lowest,
            highest=state.highest,
            dry=dry,
            settled=state.converged,
            residuals=state.residuals,
        )


class SealPatchRecord(Record):
    """Leak rate [m³/s] of a seal all of whose patches are like this one, and the patch's table."""

    state: FlowState
    value: Finite  #: None, as the bounds, if the seal is lifted off
    lower: Finite
    upper: Finite
    #: K [m³/(Pa s)] at net loads [Pa]
    conductivity: ConductivityTable | None = Field(
        None, validation_alias=AliasChoices("conductivity", "table")
    )


class PathRecord(Record):
    """Pressures [Pa] and conductivity [m³/(Pa s)] along the leak path; null where it is open.

    In result.json the total pressure has the key "contact_pressure".
    """

    x: tuple[float, ...] = Field(min_length=2)
    total_pressure: tuple[float, ...] = Field(alias="contact_pressure")
    fluid_pressure: tuple[float, ...]
    conductivity: tuple[Finite, ...]

    @model_validator(mode="after")
    def _of_one_length(self) -> "PathRecord":
        if len({len(getattr(self, name)) for name in type(self).model_fields}) > 1:
            raise ValueError("must hold as many pressures and conductivities as places x")
        return self

    @property
    def ends(self) -> tuple[float, float]:
        """Distances of inlet and outlet from the inlet [m]."""
        return self.x[0], self.x[-1]

    @classmethod
    def of(cls, path: PathFlow) -> "PathRecord":
        """Record of about `POINTS` places of a path, with that of the highest total pressure."""
        last, highest = len(path.x) - 1, path.total_pressure.argmax()
        kept = np.unique([*range(0, last, -(-len(path.x) // POINTS)), highest, last])
        return cls(**{name: tuple(getattr(path, name)[kept].tolist()) for name in cls.model_fields})


class SealRecord(Record):
    """The whole seal; docs/reference/results.md explains each."""

    leak_rate: Rate | None
    patches: tuple[SealPatchRecord, ...] = Field(min_length=1)
    share_sealed: Bounded
    patches_along: int
    patches_around: int
    scatter: float | None
    interval: tuple[float, float] | None = None
    loads: tuple[float, ...]
    sealing: SealingPart | None = None
    path: PathRecord

    @property
    def median(self) -> SealPatchRecord:
        """The patch that `sealing` and `path` are of."""
        return median_patch(self.patches)

    @classmethod
    def of(cls, seal: SealLeak) -> "SealRecord":
        """Record of a seal; it has no leak rates if the seal is lifted off."""
        lifted_off = seal.state == "lifted off"
        tables = [patch.table for patch in seal.patches if patch.table is not None]
        median = median_patch(seal.patches)
        return cls(
            leak_rate=None if lifted_off else Rate.model_validate(seal),
            patches=tuple(map(SealPatchRecord.model_validate, seal.patches)),
            share_sealed=seal.share_sealed,
            patches_along=seal.count.along,
            patches_around=seal.count.across,
            scatter=seal.relative_scatter if len(seal.patches) > 1 and not lifted_off else None,
            interval=None if seal.interval is None else seal.interval.range,
            loads=tuple(sorted({load for table in tables for load in table.loads.tolist()})),
            sealing=median.sealing,
            path=PathRecord.of(present(median.path, "path of the flow")),
        )
