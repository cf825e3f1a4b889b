"""Conversion of pydantic's list of errors into one sentence for the user."""

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING, get_args

from pydantic import BaseModel, ValidationError

from fem_seal.digits import number_of
from fem_seal.scene.readable import sections_in

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails


class ContradictionError(ValueError):
    """Fields or sections contradict each other; each message names some."""


def explain(error: ValidationError, root: type[BaseModel]) -> list[str]:
    """Sentence on each error; unknown keys first, since a misspelt key is also a missing one."""
    errors = error.errors(include_url=False)
    # A list whose entries are refused is also too short.
    lists = {each["loc"][:-1] for each in errors}
    errors = [each for each in errors if each["type"] != "too_short" or each["loc"] not in lists]
    errors.sort(key=lambda each: each["type"] != "extra_forbidden")
    sentences: list[str] = []
    for each in errors:
        place = _Place.of(each["loc"], root)
        reason = each.get("ctx", {}).get("error")
        if isinstance(reason, ContradictionError):
            sentences += [f"{place}: {text}" if place.names else text for text in reason.args]
        else:
            sentences.append(_sentence(each, place, root))
    return sentences


def _sentence(error: "ErrorDetails", place: "_Place", root: type[BaseModel]) -> str:
    given = error.get("input")
    match error["type"]:
        case "extra_forbidden":
            return f"{place} is not a known key; {_nearest(place, root)}"
        case "missing":
            return f"{place} is missing ({place.description})"
        case "union_tag_not_found":
            kinds = " or ".join(map(repr, _kinds(place.choices)))
            return f"{place}.kind is missing; choose from {kinds}"
        case "union_tag_invalid":
            allowed = error["ctx"]["expected_tags"]
            return f"{place}.kind = {error['ctx']['tag']!r} is not allowed; choose from {allowed}"
        case "literal_error":
            return f"{place} = {given!r} is not allowed; choose from {error['ctx']['expected']}"
        case "model_type" | "model_attributes_type" if isinstance(given, BaseModel):
            return f"{place} is a {type(given).__name__}, which does not belong there"
        case "model_type" | "model_attributes_type":
            return f"{place} = {given!r} must be a table of keys, [{place}]"
        case "greater_than_equal":  # pydantic writes 1e-13 with thirteen decimals
            return f"{place} = {given!r} must be at least {error['ctx']['ge']:g}"
        case "less_than_equal":
            return f"{place} = {given!r} must be at most {error['ctx']['le']:g}"
        case "tuple_type":
            return f"{place} = {given!r} must be a list in square brackets ({place.description})"
        case "too_short":
            least = error["ctx"]["min_length"]
            return f"{place} = {given!r} is too short: give at least {number_of(least, 'value')}"
        case "value_error":
            return f"{place} = {given!r} {error['ctx']['error']}"
    text = error["msg"].removeprefix("Input ").removeprefix("Tuple ").replace("should", "must", 1)
    return f"{place} = {given!r} {text}"


@dataclass(frozen=True)
class _Place:
    """Place of an error; as a text, "surface.shape[1]"."""

    names: tuple[int | str, ...]  #: sections, field and index
    section: type[BaseModel]  #: innermost section
    choices: list[type[BaseModel]]  #: sections of which one may stand here

    @classmethod
    def of(cls, location: tuple[int | str, ...], root: type[BaseModel]) -> "_Place":
        """Place of an error of pydantic, which names the kind behind a section of several kinds."""
        names, section, choices = [], root, list[type[BaseModel]]()
        for part in location:
            if part in _kinds(choices):
                choices = [model for model in choices if part in _kinds([model])]
                continue
            section = choices[0] if choices else section
            names.append(part)
            field = section.model_fields.get(str(part))
            choices = sections_in(field.annotation) if field else []
        return cls(tuple(names), section, choices)

    def __str__(self) -> str:
        parts = (f"[{name}]" if isinstance(name, int) else f".{name}" for name in self.names)
        return "".join(parts).removeprefix(".")

    @property
    def description(self) -> str:
        """Description of the field or, for an entry of a list, of the list."""
        fields = self.section.model_fields
        field = next(fields[name] for name in reversed(self.names) if name in fields)
        return field.description or "no description"


def _kinds(models: Sequence[type[BaseModel]]) -> list[str]:
    """Kinds of sections."""
    fields = (model.model_fields.get("kind") for model in models)
    return [kind for field in fields if field for kind in get_args(field.annotation)]


def _nearest(place: _Place, root: type[BaseModel]) -> str:
    fields = list(place.section.model_fields)
    first, key = place.names[0], str(place.names[-1])
    inside = len(place.names) > 1
    others = [
        f"[{name}]"
        for name, field in root.model_fields.items()
        if name != first
        and any(key in model.model_fields for model in sections_in(field.annotation))
    ]
    here = root.model_fields.get(str(first)) if inside else None
    models = sections_in(here.annotation) if here else []
    if kinds := _kinds([model for model in models if key in model.model_fields]):
        return f"it belongs to {first}.kind = {' or '.join(map(repr, kinds))}"
    if "." in key:
        return "a dot in quotes is part of the key, write it without quotes"
    longer = [name for name in fields if key in name.split("_")]  # area for area_fraction
    if inside and others:
        own = f", or did you mean {longer[0]}?" if longer else ""
        return f"it belongs in {' or '.join(others)}{own}"
    near = longer or get_close_matches(key, fields, n=1, cutoff=0.5)
    return f"did you mean {near[0]}?" if near else f"known are {', '.join(fields)}"
