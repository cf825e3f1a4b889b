"""A scene for people: its fields with readable units, for notebooks and pages."""

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from fem_seal.digits import with_prefix
from fem_seal.tables import leaves
from fem_seal.units import to_si


def own_names(model: BaseModel) -> list[str]:
    """Names of a model without pydantic's own, for the completion of names at a prompt."""
    return sorted(set(object.__dir__(model)) - set(dir(BaseModel)))


def unit_of(field: FieldInfo) -> str | None:
    """SI unit of the numbers of a field; None if they have none, or are no numbers."""
    for part in (*parts_of(field.annotation), *field.metadata):
        reader = getattr(part, "func", None)
        if isinstance(reader, partial) and reader.func is to_si:
            return str(reader.keywords["unit"])
    return None


def parts_of(annotation: object) -> Iterator[object]:
    """An annotation and all that is in it, such as the parts of tuple[Length, Length] | None."""
    yield annotation
    for part in get_args(annotation):
        yield from parts_of(part)


def python_rows(section: BaseModel) -> list[tuple[str, str]]:
    """Fields of a section that were set, as they are written in Python, with readable units."""
    rows = []
    for key, field in type(section).model_fields.items():
        value = getattr(section, key)
        if key in section.model_fields_set - {"kind"} and value is not None:
            unit = unit_of(field)
            if unit is None and not isinstance(value, BaseModel):
                value = section.model_dump(include={key})[key]  # of a unit its name
            rows.append((key, repr(value) if unit is None else _quoted(value, unit)))
    return rows


def _quoted(value: object, unit: str) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(_quoted(part, unit) for part in value)})"
    return repr(_text(value, unit))


def sections_in(annotation: object) -> list[type[BaseModel]]:
    """Sections in an annotation such as Annotated[A | B, ...] | None."""
    types = (part for part in parts_of(annotation) if isinstance(part, type))
    return [part for part in types if issubclass(part, BaseModel)]


def rows_of_mapping(data: Mapping[str, Any], model: type[BaseModel]) -> list[tuple[str, str]]:
    """Names and readable values of the fields of a scene, nested mappings in SI units.

    Of files only the names: their folders are private.
    """
    units = {
        f"{key}.{name}": unit
        for key, field in model.model_fields.items()
        for section in sections_in(field.annotation)
        for name, inner in section.model_fields.items()
        if (unit := unit_of(inner)) is not None
    }
    return [(name, _text(value, units.get(name))) for name, value in leaves(data)]


def _text(value: object, unit: str | None) -> str:
    if isinstance(value, list):
        return ", ".join(_text(part, unit) for part in value)
    if isinstance(value, float):
        # Temperatures, angles and bytes are written without a prefix.
        if unit in ("m", "Pa", "s", "Pa s"):
            return with_prefix(value, unit, 8)
        return f"{value:.8g} {unit or ''}".rstrip()
    return Path(value).name if isinstance(value, str) and Path(value).is_absolute() else str(value)
