"""The sections [flow], [accuracy], [limit] and [output]: the flow, and what is asked of it."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

from pydantic import Field, PlainSerializer, PlainValidator, field_validator

from fem_seal.flow_settings import FlowSettings, LinkRuleName, MethodName
from fem_seal.fluid import Drive
from fem_seal.grid import GridField, Representation, Sides
from fem_seal.limits import Limits
from fem_seal.scene.messages import ContradictionError
from fem_seal.scene.section import (
    Bytes,
    Count,
    Lift,
    NonNegativePressure,
    Number,
    Pressure,
    Seconds,
    Section,
    Truth,
    is_changed,
)
from fem_seal.units import RateUnit, StatedRate

if TYPE_CHECKING:
    from fem_seal.film.grid_film import GridFilm


class GaugePressures(NamedTuple):
    """Pressures of the fluid above that on the back of the solid [Pa]."""

    inlet: float
    outlet: float


class Flow(Section):
    """Pressures that drive the flow, and the method for its leak rate."""

    pressure_drop: Pressure | None = Field(None, description="inlet minus outlet; of a liquid")
    inlet_pressure: Pressure | None = Field(None, description="absolute; with outlet_pressure")
    outlet_pressure: NonNegativePressure | None = Field(None, description="absolute, 0 is vacuum")
    ambient_pressure: NonNegativePressure | None = Field(
        None, description="absolute, on the back of the solid; else the outlet's, if 1 bar or more"
    )
    lift: Lift | None = Field(
        None, description="effect of the fluid's pressure; resolved under a contact.pressure"
    )
    sides: Sides | None = Field(
        None, description="sides y = 0 and y = Ly; periodic where the gap repeats if left out"
    )
    # Not below 1e-9: the energies are accurate to the solver's tolerance, 1e-8.
    rtol: Number = Field(
        FlowSettings.rtol,
        ge=1e-9,
        description="largest (upper - lower) / sqrt(lower upper); of finite-difference, which has "
        "no bounds, for a lift only",
    )
    representation: Representation = Field(
        "linear", description="gap linear between samples, or constant on square pixels"
    )
    method: MethodName = Field("adaptive", description="how the mesh is refined, or no mesh at all")
    links: LinkRuleName = Field(
        "linear-gap",
        description="mean of g³ on a link between two samples; of finite-difference only",
    )
    max_unknowns: Count | None = Field(
        None, description="most unknowns of a flow, which then ends with its best bounds so far"
    )
    max_seconds: Seconds | None = Field(
        None, description="longest time of a flow, which then ends with its best bounds so far"
    )
    max_memory: Bytes | None = Field(
        None, description="most memory of one process; a flow then ends with its best bounds so far"
    )

    def sides_of(self, gap_repeats: bool) -> Sides:
        """Sides of the film of a gap that repeats or does not."""
        return self.sides or ("periodic" if gap_repeats else "wall")

    def film_of(self, gap: GridField) -> "GridFilm":
        """Film of a gap [m] on a grid: how it is read between the samples, and its sides."""
        from fem_seal.film.grid_film import GridFilm

        return GridFilm(gap, self.sides_of(gap.periodic), self.representation)

    def both_pressures(self, who: str) -> tuple[float, float]:
        """Absolute pressures of inlet and outlet, the higher one at the inlet, that `who` needs."""
        inlet, outlet = self.inlet_pressure, self.outlet_pressure
        if inlet is None or outlet is None:
            name = "inlet_pressure" if inlet is None else "outlet_pressure"
            raise ContradictionError(f"flow.{name} is missing: {who} needs both absolute pressures")
        if inlet <= outlet:
            raise ContradictionError(
                f"flow.inlet_pressure = {inlet:g} Pa must be above flow.outlet_pressure "
                f"= {outlet:g} Pa; swap the gap's ends if it leaks the other way"
            )
        return inlet, outlet

    @property
    def is_driven(self) -> bool:
        """Whether pressures are given."""
        pressures = self.pressure_drop, self.inlet_pressure, self.outlet_pressure
        return any(pressure is not None for pressure in pressures)

    @property
    def gauge_pressures(self) -> GaugePressures:
        """Pressures of inlet and outlet above ambient.

        If the ambient pressure is left out, it is that of the outlet.
        """
        if self.pressure_drop is not None:
            return GaugePressures(self.pressure_drop, 0.0)
        inlet, outlet = self.both_pressures("a leak rate")
        ambient = outlet if self.ambient_pressure is None else self.ambient_pressure
        return GaugePressures(inlet - ambient, outlet - ambient)

    @property
    def limits(self) -> Limits:
        """Limits at which a refinement stops although its tolerance is not reached."""
        return Limits(self.max_unknowns, self.max_seconds, self.max_memory)

    def _contradictions(self) -> Iterator[str]:
        if self.method != "finite-difference" and is_changed(self, "links"):
            yield (
                f"links = {self.links!r} is for method = 'finite-difference' only; "
                f"method = {self.method!r} has no links: leave it out"
            )


Product = Literal[
    "contact",
    "leak_rate",
    "pictures",
    "mesh",
    "constriction",
    "threshold",
    "hydraulic_aperture",
    "trapped_volume",
    "conductivity_tensor",
    "sensitivity",
    "seal",
]


class Needs(NamedTuple):
    """What a product needs besides the film."""

    leak_rate: bool = False
    field: bool = False  #: the flow itself, not only its leak rate
    grid: bool = False  #: the grid of a contact, which a [shape] has not
    folder: bool = False  #: a result folder: it is a file


PRODUCTS: dict[Product, Needs] = {
    "contact": Needs(),
    "leak_rate": Needs(leak_rate=True),
    "pictures": Needs(field=True, folder=True),
    "mesh": Needs(leak_rate=True, field=True, folder=True),
    "constriction": Needs(leak_rate=True, field=True),
    "threshold": Needs(),
    "hydraulic_aperture": Needs(leak_rate=True),
    "trapped_volume": Needs(),
    "conductivity_tensor": Needs(grid=True),
    "sensitivity": Needs(leak_rate=True, grid=True),
    "seal": Needs(grid=True),
}
LeakRateLimit = Annotated[StatedRate, PlainValidator(StatedRate.parse), PlainSerializer(str)]
LeakRateUnit = Annotated[
    RateUnit, PlainValidator(RateUnit.parse), PlainSerializer(lambda unit: unit.name)
]


class Accuracy(Section):
    """Largest total error of the leak rate; contact grid and flow.rtol are chosen for it."""

    total: Number | None = Field(
        None, gt=0, lt=1, description="largest relative error of the leak rate"
    )
    max_refinement: Count = Field(
        4, description="most times the samples of the surface; grids of 2, 4, ... times are tried"
    )
    contact_grid: Truth = Field(
        True, description="whether half of the samples say what the grid of the contact changes"
    )


class Limit(Section):
    """Largest leak rate that is allowed."""

    leak_rate: LeakRateLimit = Field(description="largest leak rate that is allowed")
    decide: Truth = Field(False, description="refine until the bounds decide, and no further")

    def volume_rate(self, drive: Drive) -> float:
        """The same limit for the solved leak rate, of a gas at reference conditions [m^3/s]."""
        return self.leak_rate.si / drive.rates[self.leak_rate.unit.kind]


class Output(Section):
    """Products and units; nothing else is computed."""

    products: tuple[Product, ...] = Field(
        ("contact", "leak_rate", "pictures"), min_length=1, description="what is computed"
    )
    leak_rate_unit: LeakRateUnit | None = Field(None, description="unit beside SI, such as ml/h")

    @field_validator("products")
    @classmethod
    def _sort(cls, products: tuple[Product, ...]) -> tuple[Product, ...]:
        if len(set(products)) < len(products):
            raise ValueError("must name each product once")
        return tuple(sorted(products))
