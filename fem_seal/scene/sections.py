"""The sections of a scene file: frozen, validated, in SI units."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    PlainValidator,
    Strict,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from fem_seal.contact import Arithmetic, ContactStopping, ElasticSolid, Layer
from fem_seal.contact import settings as contact_settings
from fem_seal.contact.methods import SMALLEST_TOLERANCE
from fem_seal.errors import InvalidInput, InvalidScene, present
from fem_seal.flow_settings import LinksName, MethodName
from fem_seal.fluid import Drive
from fem_seal.grid import GridField, Representation, Sides
from fem_seal.limits import Limits
from fem_seal.scene.messages import ContradictionError, explain
from fem_seal.scene.readable import own_names, python_rows
from fem_seal.surface.spectrum import Spectrum
from fem_seal.units import RateUnit, StatedRate, require_size, to_si

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass

    from fem_seal.film.grid_film import GridFilm
else:
    ModelMetaclass = type(BaseModel)


def _plain_number(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("should be a number")
    require_size(value)
    return value


def readable_file(value: object, info: ValidationInfo) -> Path:
    """Existing file; relative paths count from the folder of the scene file."""
    if not isinstance(value, str | Path):
        raise ValueError("should be the path of a file, in quotes")
    folder = (info.context or {}).get("folder", Path())
    try:
        path = (folder / value).resolve()
    except (OSError, RuntimeError):  # RuntimeError: Python before 3.13, of links in a circle
        raise ValueError("is not a file: its links lead back to themselves") from None
    try:
        str(path).encode()
    except UnicodeEncodeError:
        # result.json records the path, and JSON is UTF-8.
        raise ValueError("has a name, or lies in a folder, that is not UTF-8; rename it") from None
    if path.is_dir():
        raise ValueError(f"is a folder (looked for {path}); name the file in it")
    if not path.is_file():
        raise ValueError(f"is not a file (looked for {path})")
    return path


Length = Annotated[float, BeforeValidator(partial(to_si, unit="m")), Field(gt=0)]
LineLoad = Annotated[float, BeforeValidator(partial(to_si, unit="N/m")), Field(gt=0)]
Coordinate = Annotated[float, BeforeValidator(partial(to_si, unit="m")), Field(ge=0)]
Pressure = Annotated[float, BeforeValidator(partial(to_si, unit="Pa")), Field(gt=0)]
NonNegativePressure = Annotated[float, BeforeValidator(partial(to_si, unit="Pa")), Field(ge=0)]
Viscosity = Annotated[float, BeforeValidator(partial(to_si, unit="Pa s")), Field(gt=0)]
Seconds = Annotated[float, BeforeValidator(partial(to_si, unit="s")), Field(gt=0)]
Bytes = Annotated[float, BeforeValidator(partial(to_si, unit="byte")), Field(gt=0)]
Number = Annotated[float, BeforeValidator(_plain_number)]
PoissonRatio = Annotated[float, BeforeValidator(_plain_number), Field(gt=-1, le=0.5)]
Count = Annotated[int, Strict(), Field(ge=1)]
Seed = Annotated[int, Strict(), Field(ge=0)]
Truth = Annotated[bool, Strict()]
Lift = Literal["none", "range", "resolved"]
InputFile = Annotated[Path, BeforeValidator(readable_file)]


class SectionType(ModelMetaclass):
    """Class of the sections: one made in Python is refused in the words of a scene file."""

    def __call__(self, *arguments: Any, **fields: Any) -> Any:
        """Make a section; the kind of a section that has one need not be said."""
        section: Any = self
        name = section.__name__
        if arguments and section.__init__ is BaseModel.__init__:
            first = next(name for name in section.model_fields if name != "kind")
            raise InvalidInput(f"{name} takes its fields by name, as in {name}({first}=…)")
        kind = section.model_fields.get("kind")
        choices = get_args(kind.annotation) if kind is not None and kind.is_required() else ()
        own_kind = {"kind": choices[0]} if len(choices) == 1 else {}
        try:
            return super().__call__(*arguments, **(own_kind | fields))
        except ValidationError as error:
            source = name if section.named_in_messages else ""
            raise InvalidScene(source, explain(error, section)) from None


class Section(BaseModel, metaclass=SectionType):
    """Base class of the sections: frozen, no unknown fields, no NaN."""

    #: Whether a message names the section; those of a Scene name it with each field.
    named_in_messages: ClassVar[bool] = True
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def _contradictions(self) -> Iterator[str]:
        """Sentences on fields that contradict each other; the first one counts."""
        yield from ()

    @model_validator(mode="after")
    def _check(self) -> "Section":
        for sentence in self._contradictions():
            raise ContradictionError(sentence)
        return self

    def __dir__(self) -> list[str]:
        """Names of a section, without those that pydantic adds."""
        return own_names(self)

    def __repr__(self) -> str:
        """The fields that were set, with readable units."""
        texts = ", ".join(f"{name}={text}" for name, text in python_rows(self))
        return f"{type(self).__name__}({texts})"

    __str__ = __repr__

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(
            f"{name} of a {type(self).__name__} cannot be set; scene.with_({{...}}) returns a "
            "changed copy of the scene"
        )


def is_changed(section: Section, name: str) -> bool:
    """Whether a field differs from its default.

    A field that is set may have it, as in the scene of a result, which names all fields.
    """
    return bool(getattr(section, name) != type(section).model_fields[name].default)


def not_one(section: Section, names: tuple[str, ...]) -> Iterator[str]:
    """Sentence if none or several of some fields are set."""
    fields = [name for name in names if getattr(section, name) is not None]
    if len(fields) != 1:
        got = f"got {' and '.join(fields)}" if fields else "got none"
        yield f"give exactly one of {', '.join(names)}; {got}"


@dataclass(frozen=True)
class Waves:
    """Waves of a surface on its grid, as a section gives them."""

    samples: tuple[int, int]
    size: tuple[float, float]  #: lengths of the cell [m]
    longest: float  #: wavelength [m]
    shortest: float  #: wavelength [m]


class SurfaceSection(Section):
    """Base class of the kinds of surface: what the steps, checks and texts ask of each."""

    #: fields to which all heights are proportional; [tolerances] scales those that are set
    proportional: ClassVar[tuple[str, ...]]
    #: field whose values make other patches of the same surface; None if there is one patch only
    seed_field: ClassVar[str | None] = None
    #: key and sentence of the entry of the error budget on what the heights lack; None: nothing
    lacks: ClassVar[tuple[str, str] | None] = None

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Files that the heights are read from."""
        return ()

    @property
    def waves(self) -> Waves | None:
        """Waves and grid; None if only the heights themselves show them."""
        return None


class SelfAffine(SurfaceSection):
    """A random rough surface, ``<|h(q)|^2> ~ q^-(2+2H)`` between two cut-offs."""

    proportional = ("rms_height", "rms_slope")
    seed_field = "seed"

    kind: Literal["self-affine"] = Field(description="kind of surface")
    shape: tuple[Count, Count] = Field(description="samples [nx, ny]")
    size: tuple[Length, Length] = Field(description="lengths [Lx, Ly] of the periodic cell")
    hurst: Number = Field(gt=0, le=1, description="Hurst exponent H, 0 < H <= 1")
    long_wavelength: Length = Field(description="long cut-off of the roughness")
    short_wavelength: Length = Field(description="short cut-off of the roughness")
    rolloff_wavelength: Length | None = Field(
        None, description="the spectrum is constant from the long cut-off down to here"
    )
    rms_height: Length | None = Field(None, description="rms height; this or rms_slope")
    rms_slope: Number | None = Field(None, gt=0, description="rms slope; this or rms_height")
    scaling: Literal["exact", "ensemble"] = Field(
        "exact", description="the rms value holds on this sample, or in the ensemble mean"
    )
    seed: Seed = Field(0, description="seed of the random phases")

    @property
    def spectrum(self) -> Spectrum:
        """Cut-offs and Hurst exponent as an argument of the synthesis."""
        return Spectrum(
            self.hurst, self.long_wavelength, self.short_wavelength, self.rolloff_wavelength
        )

    @property
    def waves(self) -> Waves:
        """Cut-offs on the grid."""
        return Waves(self.shape, self.size, self.long_wavelength, self.short_wavelength)

    def _contradictions(self) -> Iterator[str]:
        yield from not_one(self, ("rms_height", "rms_slope"))
        try:
            self.spectrum.require_room(self.shape, self.size)
        except InvalidInput as error:
            yield str(error)


def one_or_more(value: object) -> object:
    """A single value as a list of one."""
    return value if isinstance(value, list | tuple) else [value]


OneOrTwo = BeforeValidator(one_or_more), Field(min_length=1, max_length=2)


class Solid(Section):
    """Elasticity of the two solids, mapped to one contact modulus."""

    contact_modulus: Pressure | None = Field(None, description="E*, or the two keys below")
    youngs_modulus: Annotated[tuple[Pressure, ...], *OneOrTwo] | None = Field(
        None, description="E of both solids, or of one against a rigid counter-face"
    )
    poisson_ratio: Annotated[tuple[PoissonRatio, ...], *OneOrTwo] | None = Field(
        None, description="ν of the solids of youngs_modulus"
    )
    layer_thickness: Length | None = Field(
        None, description="thickness of an elastic layer on a rigid base"
    )
    layer_base: Literal["fixed", "sliding"] = Field(
        "fixed", description="layer bonded to its base, or without friction on it"
    )
    layer_poisson_ratio: PoissonRatio | None = Field(
        None, description="ν of the layer; poisson_ratio, else 0.5, if left out"
    )

    def _contradictions(self) -> Iterator[str]:
        yield from not_one(self, ("contact_modulus", "youngs_modulus"))
        E, ratios = self.youngs_modulus or (), self.poisson_ratio or ()
        if (self.youngs_modulus is None) != (self.poisson_ratio is None):
            yield "youngs_modulus and poisson_ratio belong together; give both"
        if len(E) != len(ratios):
            yield (
                f"youngs_modulus is that of {_solids(len(E))}, and poisson_ratio that of "
                f"{_solids(len(ratios))}; give both for the same solids"
            )
        if self.layer_thickness is None:
            if is_changed(self, "layer_base") or self.layer_poisson_ratio is not None:
                yield (
                    "layer_base and layer_poisson_ratio are those of a layer; give its "
                    "layer_thickness, or leave them out for a half-space"
                )
            return
        if len(E) == 2:
            yield (
                "layer_thickness is for one solid, the layer, and what it touches is taken for "
                "rigid; give youngs_modulus and poisson_ratio of the layer alone, or "
                "contact_modulus, its E/(1 - ν²)"
            )
        if self.layer_poisson_ratio not in (None, *ratios) and ratios:
            yield (
                f"layer_poisson_ratio = {self.layer_poisson_ratio:g} and poisson_ratio = "
                f"{ratios[0]:g} are those of one layer; leave one out"
            )

    @property
    def elastic(self) -> ElasticSolid:
        """The solid as an argument of the contact solver."""
        if self.layer_thickness is None:
            return ElasticSolid(self.E_star)
        (nu,) = self.poisson_ratio or (0.5,)
        if self.layer_poisson_ratio is not None:
            nu = self.layer_poisson_ratio
        return ElasticSolid(self.E_star, Layer(self.layer_thickness, self.layer_base, nu))

    @property
    def E_star(self) -> float:
        """Contact modulus [Pa]: 1/E* = (1 - ν1²)/E1 + (1 - ν2²)/E2 (Johnson 1985, eq. 4.24).

        A rigid counter-face, as that of a single solid, adds nothing to the sum.
        """
        if self.youngs_modulus is None or self.poisson_ratio is None:
            return present(self.contact_modulus, "solid.contact_modulus")
        pairs = zip(self.youngs_modulus, self.poisson_ratio, strict=True)
        return 1 / sum((1 - nu**2) / E for E, nu in pairs)


def _solids(count: int) -> str:
    return "one solid" if count == 1 else "both solids"


LOADS = ("pressure", "area_fraction", "mean_gap")
ITERATION = ("tolerance", "solver", "max_iterations", "precision", "threads")


class Contact(Section):
    """Contact of the two faces: the model, exactly one load, and the solver."""

    model: Literal["gfmd", "bearing"] = Field("gfmd", description="elastic, or plain cutting")
    pressure: NonNegativePressure | None = Field(
        None, description="mean pressure, 0 is touch; gfmd only"
    )
    area_fraction: Number | None = Field(None, ge=0, lt=1, description="contact area / A0")
    mean_gap: Length | None = Field(None, description="mean of the gap")
    tolerance: Number = Field(
        1e-6, ge=SMALLEST_TOLERANCE, lt=1, description="of the contact's certificate; gfmd only"
    )
    solver: Literal["free-set-cg", "damped", "fista", "polonsky-keer"] = Field(
        "free-set-cg", description="gfmd only; damped is the letter's own relaxation"
    )
    max_iterations: Count | None = Field(
        None, description="gfmd only; the contact has failed after so many"
    )
    precision: Literal["mixed", "double"] = Field(
        "mixed", description="of search directions, all else is double; gfmd only"
    )
    threads: Count | None = Field(
        None, le=1024, description="gfmd only; the cores of this process if left out"
    )

    def _contradictions(self) -> Iterator[str]:
        # A [seal] may give the load in place of this section: `_load` of `checks`.
        if any(getattr(self, name) is not None for name in LOADS):
            yield from not_one(self, LOADS)
        if self.model == "gfmd":
            return
        if self.pressure is not None:
            yield (
                "pressure has no meaning for model = 'bearing', which knows no elasticity; "
                "give area_fraction or mean_gap"
            )
        for name in ITERATION:
            if is_changed(self, name):
                yield (
                    f"{name} is of the iteration for an elastic contact, and model = 'bearing' "
                    "needs none; leave it out"
                )

    @property
    def is_elastic(self) -> bool:
        """Whether the model knows elasticity and pressures; its state is a `ContactState`."""
        return self.model == "gfmd"

    @property
    def load(self) -> contact_settings.Load:
        """The one load that is set; see `Scene.load` for a scene whose [seal] gives it."""
        return contact_settings.one_load(
            pressure=self.pressure, area_fraction=self.area_fraction, mean_gap=self.mean_gap
        )

    def stopping(self, progress: Callable[[int, float], None] | None = None) -> ContactStopping:
        """Method and tolerance of an elastic contact."""
        return ContactStopping(self.solver, self.tolerance, self.max_iterations, progress)

    @property
    def arithmetic(self) -> Arithmetic:
        """Threads and precision of the transforms."""
        return Arithmetic(self.threads, self.precision)


class Flow(Section):
    """Pressures that drive the flow, and the method for its leak rate."""

    pressure_drop: Pressure | None = Field(None, description="inlet minus outlet; of a liquid")
    inlet_pressure: Pressure | None = Field(None, description="absolute; with outlet_pressure")
    outlet_pressure: NonNegativePressure | None = Field(None, description="absolute, 0 is vacuum")
    ambient_pressure: NonNegativePressure | None = Field(
        None, description="absolute, on the back of the solid; the outlet's if left out"
    )
    lift: Lift | None = Field(
        None, description="effect of the fluid's pressure; resolved under a contact.pressure"
    )
    sides: Sides | None = Field(
        None, description="sides y = 0 and y = Ly; periodic where the gap repeats if left out"
    )
    # Not below 1e-9: the energies are accurate to the solver's tolerance, 1e-8.
    rtol: Number = Field(
        0.05,
        ge=1e-9,
        description="largest (upper - lower) / sqrt(lower upper); of finite-difference, which has "
        "no bounds, for a lift only",
    )
    representation: Representation = Field(
        "linear", description="gap linear between samples, or constant on square pixels"
    )
    method: MethodName = Field("adaptive", description="how the mesh is refined, or no mesh at all")
    links: LinksName = Field(
        "linear-gap", description="conductance between two pixels; of finite-difference only"
    )
    max_unknowns: Count | None = Field(None, description="stop with the best bounds so far")
    max_seconds: Seconds | None = Field(None, description="stop with the best bounds so far")
    max_memory: Bytes | None = Field(None, description="stop with the best bounds so far")

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
    def gauge_pressures(self) -> tuple[float, float]:
        """Pressures of inlet and outlet above that on the back of the solid [Pa].

        If the ambient pressure is left out, it is that of the outlet.
        """
        if self.pressure_drop is not None:
            return self.pressure_drop, 0.0
        inlet, outlet = self.both_pressures("a leak rate")
        ambient = outlet if self.ambient_pressure is None else self.ambient_pressure
        return inlet - ambient, outlet - ambient

    @property
    def limits(self) -> Limits:
        """Limits at which a refinement stops although its tolerance is not reached."""
        return Limits(self.max_unknowns, self.max_seconds, self.max_memory)

    def _contradictions(self) -> Iterator[str]:
        if self.method != "finite-difference":
            if is_changed(self, "links"):
                yield (
                    f"links = {self.links!r} is for method = 'finite-difference' only; "
                    f"method = {self.method!r} has no links: leave it out"
                )
            return
        for name in ("max_unknowns", "max_seconds", "max_memory"):
            if getattr(self, name) is not None:
                yield (
                    f"{name} ends a refinement, and method = 'finite-difference' does not refine; "
                    "leave it out, or choose adaptive or uniform"
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
        4, description="finest contact grid tried, in multiples of the samples of the surface"
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
        return tuple(sorted(set(products)))
