"""Scene: the content of a scene file, read and checked."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar

from pydantic import ValidationError, model_validator

from fem_seal.errors import InvalidInput, InvalidScene
from fem_seal.scene.checks import check
from fem_seal.scene.contents import Contents
from fem_seal.scene.files import override, read_toml, replaced
from fem_seal.scene.messages import explain
from fem_seal.scene.readable import rows_of_mapping
from fem_seal.scene.sections import SelfAffine
from fem_seal.tables import html_table


def require_scene(value: object) -> None:
    """Raise InvalidInput for anything but a Scene."""
    if not isinstance(value, Scene):
        raise InvalidInput(f"a {type(value).__name__} is no Scene; Scene.from_file(path) reads one")


class Scene(Contents):
    """One patch of a seal, and the products to compute; lengths in m, pressures in Pa.

    Either `gap`, or `surface` and `contact` (and `solid` for an elastic contact).
    """

    named_in_messages: ClassVar[bool] = False

    @classmethod
    def from_file(cls, path: str | Path, overrides: Iterable[str] = ()) -> "Scene":
        """Read a TOML scene file.

        Parameters
        ----------
        path : path of the scene file; relative paths inside count from its folder
        overrides : "section.key=value" each, in TOML; quotes around strings may be left out,
            and an empty value removes the key

        Raises
        ------
        InvalidInput
            A sentence for each error: the field, its value and what is allowed.
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
        folder : folder to which paths are relative; the current one if left out
        source : name of the data at the beginning of messages
        """
        try:
            return cls.model_validate(dict(data), context={"folder": folder or Path()})
        except ValidationError as error:
            raise InvalidScene(source, explain(error, cls)) from None
        except UnicodeEncodeError as error:
            text = f"{error.object!r} is not UTF-8 text; result.json could not hold it"
            raise InvalidInput(": ".join(filter(None, (source, text)))) from None

    def to_mapping(self) -> dict[str, Any]:
        """All fields as nested plain dicts, in SI units; `from_mapping` gives the scene back."""
        # Leave out flow.rtol beside a total error: reading both again would be a contradiction.
        chosen = {"flow": {"rtol"}} if self.total_error else None
        return self.model_dump(mode="json", exclude_none=True, exclude=chosen)

    def with_(self, changes: Mapping[str, object]) -> "Scene":
        """Copy with other values, checked like a file.

        Parameters
        ----------
        changes
            Values by "section.field", such as {"contact.pressure": "0.2 MPa"}, or whole sections.
            None removes a field or a section.

        Raises
        ------
        InvalidInput
            A sentence for each error: the field, its value and what is allowed.
        """
        data = self._set()
        for name, value in changes.items():
            data = replaced(data, tuple(name.split(".")), value, name)
        return self.from_mapping(data)

    def _repr_html_(self) -> str:
        return html_table(rows_of_mapping(self._set(), type(self)))

    def _set(self) -> dict[str, Any]:
        """Fields that were set, as nested plain dicts in SI units."""
        return self.model_dump(mode="json", exclude_unset=True, exclude_none=True)

    def scaled(self, factors: Mapping[str, float]) -> "Scene":
        """Copy with factors on inputs, named as in [tolerances]."""
        changes: dict[str, Any] = {}
        for name, factor in factors.items():
            if name == "heights":
                name = "surface.height_factor"
                if isinstance(self.surface, SelfAffine):
                    given = "rms_slope" if self.surface.rms_height is None else "rms_height"
                    name = f"surface.{given}"
            section, key = name.split(".")
            value = getattr(getattr(self, section), key)
            several = isinstance(value, tuple)
            changes[name] = tuple(factor * one for one in value) if several else factor * value
        if "flow.outlet_pressure" in factors and self.flow.ambient_pressure is None:
            # The back of the solid keeps the pressure that the outlet has in this scene.
            changes["flow.ambient_pressure"] = self.flow.outlet_pressure
        return self.with_(changes)

    @model_validator(mode="after")
    def _check(self) -> "Scene":
        check(self)
        return self
