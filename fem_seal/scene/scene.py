"""Scene: the content of a scene file, read and checked, and what follows from several sections."""

import json
from collections.abc import Callable, Iterable, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Field, ValidationError, model_validator

from fem_seal.arguments import require_kind
from fem_seal.contact.settings import Load
from fem_seal.errors import InvalidInput, InvalidScene, present
from fem_seal.files import digest, digest_of_sources
from fem_seal.flow_settings import FlowSettings
from fem_seal.fluid import Drive, Slip
from fem_seal.scene.checks import check
from fem_seal.scene.contact import Contact, Solid
from fem_seal.scene.files import override, replaced, scene_text, tables_of
from fem_seal.scene.fluid import Fluid
from fem_seal.scene.measured import FileSurface, Gap, ProfileSurface
from fem_seal.scene.messages import explain
from fem_seal.scene.seal import Seal
from fem_seal.scene.section import Lift, Section
from fem_seal.scene.sections import PRODUCTS, Accuracy, Flow, Limit, Output
from fem_seal.scene.shape import AnyShape, MeshFile
from fem_seal.scene.surface import SelfAffine, SurfaceSection
from fem_seal.scene.tolerances import Tolerances

Surface = Annotated[SelfAffine | FileSurface | ProfileSurface, Field(discriminator="kind")]
KINDS: tuple[type[SurfaceSection], ...] = get_args(get_args(Surface)[0])
#: Names of the fields that make other patches of the same surface.
SEEDS = frozenset(f"surface.{kind.seed_field}" for kind in KINDS)


def require_scene(value: object) -> None:
    """Raise InvalidInput for anything but a Scene."""
    if not isinstance(value, Scene):
        kind = type(value).__name__
        raise InvalidInput(f"a Scene is needed, not a {kind}; Scene.from_file(path) reads one")


class Scene(Section):
    """One patch of a seal, and the products to compute; lengths in m, pressures in Pa.

    Either `gap`, or `surface` and `contact` (and `solid` for an elastic contact); `contact` may be
    left out where `seal` gives the load.
    """

    surface: Surface | None = Field(None, description="the rough counter-face")
    solid: Solid | None = Field(None, description="elasticity of the two solids")
    contact: Contact | None = Field(None, description="contact model and load")
    gap: Gap | None = Field(None, description="a gap in place of surface, solid and contact")
    shape: AnyShape | None = Field(None, description="shape of the film, if not a grid's rectangle")
    fluid: Fluid | None = Field(None, description="the liquid or gas that leaks")
    flow: Flow = Field(Flow(), description="pressure drop, sides and method")
    seal: Seal | None = Field(None, description="the whole seal that the patch is a part of")
    accuracy: Accuracy | None = Field(None, description="total error, in place of flow.rtol")
    tolerances: Tolerances | None = Field(None, description="how well the inputs are known")
    limit: Limit | None = Field(None, description="largest leak rate that is allowed")
    output: Output = Field(Output(), description="products and units")

    named_in_messages: ClassVar[bool] = False

    @classmethod
    def from_file(cls, path: str | Path, overrides: Iterable[str] = ()) -> "Scene":
        """Read a TOML scene file.

        Parameters
        ----------
        path
            Path of the scene file; relative paths inside count from its folder.
        overrides
            "section.key=value" each, in TOML; quotes around strings may be left out, and an empty
            value removes the key.

        Raises
        ------
        InvalidInput
            A sentence for each error: the field, its value and what is allowed.
        """
        return cls.from_text(scene_text(Path(path)), Path(path), overrides)

    @classmethod
    def from_text(cls, text: str, path: Path, overrides: Iterable[str] = ()) -> "Scene":
        """Check the text of a scene file that has been read; see `from_file`."""
        data = tables_of(text, path)
        for assignment in overrides:
            data = override(data, assignment)
        return cls.from_mapping(data, folder=path.parent, source=str(path))

    @classmethod
    def from_mapping(
        cls, data: Mapping[str, Any], folder: Path | None = None, source: str = ""
    ) -> "Scene":
        """Check nested mappings such as `to_mapping` or tomllib return; see `from_file`.

        Paths are relative to the folder, or to the current one. Messages begin with the source.
        """
        require_kind(Mapping, data=data)
        try:
            return cls.model_validate(dict(data), context={"folder": folder or Path()})
        except ValidationError as error:
            raise InvalidScene(source, explain(error, cls)) from None
        except UnicodeEncodeError as error:
            text = f"{error.object!r} is not UTF-8 text; result.json could not hold it"
            raise InvalidInput(": ".join(filter(None, (source, text)))) from None

    def to_mapping(self) -> dict[str, Any]:
        """All fields as nested plain dicts, in SI units; `from_mapping` gives the scene back."""
        # Leave out flow.rtol where another field chooses it: reading both would be a contradiction.
        chosen = {"flow": {"rtol"}} if self.total_error or self.seal else None
        return self.model_dump(mode="json", exclude_none=True, exclude=chosen)

    def fingerprint(self, *more: object, digest_of: Callable[[Path], str] = digest) -> str:
        """Hash of the scene, the content of its input files, the sources of fem_seal, and `more`.

        It names the file of a point that is computed from these.
        """
        inputs = [digest_of(path) for _, path in self.input_files]
        text = json.dumps([self.to_mapping(), inputs, digest_of_sources(), *more], sort_keys=True)
        return sha256(text.encode()).hexdigest()[:32]

    def with_(self, changes: Mapping[str, object]) -> "Scene":
        """Copy with other values, checked like a file.

        The changes are values by "section.field", such as {"contact.pressure": "0.2 MPa"}, or whole
        sections. None removes a field or a section.
        """
        require_kind(Mapping, changes=changes)
        data = self.model_dump(mode="json", exclude_unset=True, exclude_none=True)
        for name, value in changes.items():
            data = replaced(data, tuple(name.split(".")), value, name)
        return self.from_mapping(data)

    def takes(self, changes: Mapping[str, object]) -> bool:
        """Whether these changes, as of `with_`, make a scene."""
        try:
            self.with_(changes)
        except InvalidInput:
            return False
        return True

    def scaled(self, factors: Mapping[str, float]) -> "Scene":
        """Copy with factors on inputs, named as in [tolerances], and without that section.

        The tolerances are about the values of this scene.
        """
        changes: dict[str, Any] = {"tolerances": None}
        for name, factor in factors.items():
            section, _, key = name.partition(".")
            keys: tuple[str, ...] = (key,)
            if name == "heights":
                section, keys = "surface", present(self.surface, "[surface]").proportional
            for key in keys:
                value = getattr(getattr(self, section), key)
                if isinstance(value, tuple):
                    changes[f"{section}.{key}"] = tuple(factor * one for one in value)
                elif value is not None:
                    changes[f"{section}.{key}"] = factor * value
        elastic = self.contact is not None and self.contact.is_elastic
        if elastic and "flow.outlet_pressure" in factors and self.flow.ambient_pressure is None:
            # The back of the solid keeps the pressure that the outlet has in this scene.
            changes["flow.ambient_pressure"] = self.flow.outlet_pressure
        return self.with_(changes)

    @model_validator(mode="before")
    @classmethod
    def _with_contact(cls, data: Any) -> Any:
        """Add an empty [contact] to a [surface]: enough where [seal] gives the load."""
        if not isinstance(data, dict):  # pydantic refuses it in a moment
            return data
        pressed = data.get("surface") is not None and data.get("contact") is None
        return data | {"contact": {}} if pressed else data

    @model_validator(mode="after")
    def _check(self) -> "Scene":
        check(self)
        return self

    @property
    def input_files(self) -> list[tuple[str, Path]]:
        """Files that the scene reads, each with the field that names it, such as "surface.path".

        After a mesh file come those that it names itself.
        """
        named = [
            (f"{name}.{key}", path)
            for name, section in self
            for key, value in section or ()
            for path in (value if isinstance(value, tuple) else (value,))
            if isinstance(path, Path)
        ]
        if isinstance(self.shape, MeshFile):
            from fem_seal.mesh.files import files_within

            named += [("shape.path", path) for path in sorted(files_within(self.shape.path))]
        return named

    @property
    def measured_map(self) -> FileSurface | None:
        """The surface, if it is a map of heights from a file."""
        return self.surface if isinstance(self.surface, FileSurface) else None

    @property
    def own_gap(self) -> bool:
        """Whether [shape] itself defines the gap."""
        return self.shape is not None and self.shape.own_gap

    @property
    def seed(self) -> int | None:
        """Seed of the random surface, or of the twin of a measured map; None without one."""
        return None if self.surface is None else getattr(self.surface, self.surface.seed_field)

    @property
    def total_error(self) -> float | None:
        """Largest relative error of the leak rate that [accuracy] allows; None if it sets none."""
        return None if self.accuracy is None else self.accuracy.total

    @property
    def needs_leak_rate(self) -> bool:
        """Whether some product needs the leak rate."""
        return any(PRODUCTS[name].leak_rate for name in self.output.products)

    @property
    def solves_flow(self) -> bool:
        """Whether the flow is solved: for a product, or since it lifts the solid."""
        return self.needs_leak_rate or self.lift == "resolved"

    @property
    def solves_any_flow(self) -> bool:
        """Whether the flow of the patch is solved, or flows of a [seal]."""
        return self.solves_flow or self.seal is not None

    @property
    def leak_rate_of(self) -> Literal["nothing", "patch", "seal"]:
        """Whose leak rate is asked for, if any."""
        if self.seal is not None:
            return "seal"
        return "patch" if self.needs_leak_rate else "nothing"

    @property
    def load(self) -> Load:
        """Load of the contact: that of [contact], or the mean pressure that [seal] gives.

        InvalidInput for a table of seal.pressure_profile that cannot be read.
        """
        profile = None
        if self.seal is not None:
            profile = self.seal.own_profile(present(self.solid, "[solid]").E_star)
        if profile is not None:
            return Load("pressure", profile.mean)
        return present(self.contact, "[contact]").load

    @property
    def _flowing(self) -> Fluid:
        if self.fluid is None:
            raise InvalidInput("[fluid] is missing: a flow needs fluid.viscosity")
        return self.fluid

    @property
    def drive(self) -> Drive:
        """Fluid with its pressures, which drive the flow; for scenes that need the flow."""
        return self._flowing.drive(self.flow)

    @property
    def viscosity(self) -> float:
        """Dynamic viscosity η of the fluid [Pa s]; for scenes that need the flow or a tensor."""
        return self._flowing.viscosity

    @property
    def slip(self) -> Slip | None:
        """Slip of the gas at the walls; None for a liquid, and if slip is left out."""
        return self._flowing.slip_under(self.flow)

    @property
    def flow_settings(self) -> FlowSettings:
        """Arguments of the flow solver; for scenes that need the flow."""
        wanted = self.limit is not None or any(PRODUCTS[n].field for n in self.output.products)
        return FlowSettings(
            method=self.flow.method,
            viscosity=self.viscosity,
            pressure_drop=self.drive.pressure_drop,
            slip=self.slip,
            rtol=self.flow.rtol,
            decide=self.deciding_rate,
            limits=self.flow.limits,
            field=wanted and self.flow.method != "finite-difference",
            link_rule=self.flow.links,
        )

    @property
    def tolerated(self) -> dict[str, float]:
        """± of each input of [tolerances], as a part of its value."""
        given = () if self.tolerances is None else self.tolerances.given()
        return {name: tolerance.relative(self.value_of(name)) for name, tolerance in given}

    @property
    def scales_exactly(self) -> bool:
        """Whether [tolerances] moves the leak rate by a factor alone, as 1/η without slip."""
        return self.tolerated.keys() == {"fluid.viscosity"} and self.slip is None

    def value_of(self, name: str) -> float:
        """Value of an input that [tolerances] names; 1 for the factor on all heights."""
        if name == "heights":
            return 1.0
        section, key = name.split(".")
        value = getattr(getattr(self, section), key)
        return float(min(value) if isinstance(value, tuple) else value)

    @property
    def lift(self) -> Lift:
        """Model of the fluid's pressure on the solid: "none", "range" or "resolved".

        "none" without a fluid under pressure. If the scene leaves flow.lift out: "resolved" for a
        patch of elastic contact under a pressure, else "none". Products do not count: one scene has
        one film, whichever of its properties are asked for.
        """
        if self.fluid is None or not self.flow.is_driven:
            return "none"
        if self.flow.lift is not None:
            return self.flow.lift
        contact = self.contact
        pressed = contact is not None and contact.is_elastic and contact.pressure is not None
        if not pressed or self.shape is not None or self.seal is not None:
            return "none"
        # Without load the solids only touch, unless the fluid lifts them off.
        unloaded = present(contact, "[contact]").pressure == 0
        touches = unloaded and self.flow.gauge_pressures.inlet <= 0
        return "none" if touches else "resolved"

    @property
    def deciding_rate(self) -> float | None:
        """Limit of the solved leak rate [m³/s] against which the flow decides; None without one."""
        if self.limit is None or not self.limit.decide:
            return None
        return self.limit.volume_rate(self.drive)
