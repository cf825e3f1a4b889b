"""The whole scene: its sections, and what they demand of each other."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError, model_validator

from fem_seal.errors import InvalidInput
from fem_seal.fluid import Drive
from fem_seal.scene.accuracy import Accuracy, check_accuracy
from fem_seal.scene.files import override, read_toml
from fem_seal.scene.fluid import Fluid, check_ambient, drive, gauge_pressures
from fem_seal.scene.limit import Limit, check_rates, refuse_rates
from fem_seal.scene.measured import FileSurface, Gap
from fem_seal.scene.messages import ContradictionError, explain
from fem_seal.scene.sections import (
    Contact,
    Flow,
    Output,
    Section,
    SelfAffineSurface,
    Solid,
)
from fem_seal.scene.shape import AnyShape, check_shape

Surface = Annotated[SelfAffineSurface | FileSurface, Field(discriminator="kind")]


class Scene(Section):
    """One seal and what is wanted of it. Lengths in m, pressures in Pa, viscosity in Pa s.

    Either `gap`, or `surface` and `contact` (and `solid` for an elastic contact).
    """

    surface: Surface | None = Field(None, description="the rough counter-face")
    solid: Solid | None = Field(None, description="elasticity of the two solids")
    contact: Contact | None = Field(None, description="contact model and load")
    gap: Gap | None = Field(None, description="in place of surface, solid and contact")
    shape: AnyShape | None = Field(None, description="of the seal, if it is not the gap's grid")
    fluid: Fluid | None = Field(None, description="the liquid or gas that leaks")
    flow: Flow = Field(Flow(), description="pressure drop, sides and method")
    accuracy: Accuracy | None = Field(None, description="total error, in place of flow.rtol")
    limit: Limit | None = Field(None, description="what the leak rate is held against")
    output: Output = Field(Output(), description="what is wanted")

    @classmethod
    def from_file(cls, path: str | Path, overrides: Iterable[str] = ()) -> "Scene":
        """Read a TOML scene file.

        Parameters
        ----------
        path : of the scene file; relative paths inside count from its folder
        overrides : "section.key=value" each, in TOML; quotes around strings may be left out,
            and an empty value takes the key away

        Raises
        ------
        InvalidInput
            One sentence that names the file, the field, its value and what is allowed.
        """
        path = Path(path)
        data = read_toml(path)
        for assignment in overrides:
            data = override(data, assignment)
        return cls.from_mapping(data, folder=path.parent, source=str(path))

    @classmethod
    def from_mapping(
        cls, data: Mapping[str, Any], folder: Path | None = None, source: str = ""
    ) -> "Scene":
        """Check nested mappings such as `to_mapping` or tomllib return; see `from_file`.

        Parameters
        ----------
        data : section: {field: value}
        folder : where relative paths count from, the current one if left out
        source : of the data, named first in messages
        """
        try:
            return cls.model_validate(dict(data), context={"folder": folder or Path()})
        except ValidationError as error:
            raise InvalidInput(": ".join(filter(None, (source, explain(error, cls))))) from None
        except UnicodeEncodeError as error:
            text = f"{error.object!r} is not UTF-8 text; result.json could not hold it"
            raise InvalidInput(": ".join(filter(None, (source, text)))) from None

    def to_mapping(self) -> dict[str, Any]:
        """Nested plain dicts of what is set, in SI units; `from_mapping` gives the scene back."""
        # A tolerance beside a total error would be a contradiction when read again.
        chosen = {"flow": {"rtol"}} if self.accuracy else None
        return self.model_dump(mode="json", exclude_none=True, exclude=chosen)

    def with_tolerance(self, rtol: float) -> "Scene":
        """Copy with a tolerance of the flow in place of a total error."""
        flow = self.flow.model_copy(update={"rtol": rtol})
        return self.model_copy(update={"flow": flow, "accuracy": None})

    @property
    def needs_flow(self) -> bool:
        """Whether some product needs the leak rate."""
        wanted = {"leak_rate", "mesh", "constriction", "hydraulic_aperture"}
        return bool(wanted.intersection(self.output.products))

    @property
    def needs_field(self) -> bool:
        """Whether some product needs the flow itself and not only its leak rate."""
        wanted = {"pictures", "mesh", "constriction"}
        return self.limit is not None or bool(wanted.intersection(self.output.products))

    @property
    def drive(self) -> Drive:
        """What pushes the fluid through; for scenes that need the flow."""
        return drive(self.fluid, self.flow)

    @property
    def gauge_pressures(self) -> tuple[float, float]:
        """Pressures of inlet and outlet above ambient [Pa]; for scenes that need the flow."""
        return gauge_pressures(self.flow)

    @property
    def deciding_rate(self) -> float | None:
        """Solved leak rate [m^3/s] whose exceeding is to be decided; None without one."""
        if self.limit is None or not self.limit.decide:
            return None
        return self.limit.volume_rate(self.drive)

    @model_validator(mode="after")
    def _check(self) -> "Scene":
        if check_shape(self):
            self._check_gap()
        check_accuracy(self)
        if self.needs_flow:
            if self.fluid is None:
                raise ContradictionError("[fluid] is missing: a leak rate needs fluid.viscosity")
            check_rates(self, self.drive)
            check_ambient(self)
        else:
            refuse_rates(self)
        if "conductivity_tensor" in self.output.products:
            self._check_tensor()
        if "mesh" in self.output.products and self.flow.method == "finite-difference":
            raise ContradictionError(
                "output.products names 'mesh', but flow.method = 'finite-difference' has none; "
                "choose adaptive or uniform"
            )
        return self

    def _check_tensor(self) -> None:
        if self.fluid is None:
            raise ContradictionError(
                "[fluid] is missing: a conductivity tensor needs fluid.viscosity"
            )
        if self.flow.method != "adaptive":
            raise ContradictionError(
                f"output.products names 'conductivity_tensor', which flow.method = "
                f"{self.flow.method!r} does not compute; choose adaptive"
            )

    def _check_gap(self) -> None:
        if self.gap is not None:
            for name in ("surface", "solid", "contact"):
                if getattr(self, name) is not None:
                    raise ContradictionError(
                        f"[gap] stands in place of [{name}]; give one of the two"
                    )
            return
        for name in ("surface", "contact"):
            if getattr(self, name) is None:
                raise ContradictionError(
                    f"[{name}] is missing; give [surface] and [contact], or [gap]"
                )
        if self.contact.model == "gfmd" and self.solid is None:
            raise ContradictionError(
                "[solid] is missing: contact.model = 'gfmd' needs its contact_modulus"
            )
