"""Conversion of pydantic's list of errors into one sentence for the user."""

from difflib import get_close_matches
from itertools import pairwise
from typing import TYPE_CHECKING, get_args

from pydantic import BaseModel, ValidationError

from fem_seal.scene.readable import sections_in

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails


class ContradictionError(ValueError):
    """Fields or sections contradict each other; each message names some."""


# Sections with several kinds: pydantic puts the kind into the path of the error.
_KINDS = {"self-affine", "file", "profiles"}
_KINDS |= {"rectangle", "strip", "face-seal", "sector", "plate-with-holes"}


def explain(error: ValidationError, root: type[BaseModel]) -> list[str]:
    """Sentence on each error; unknown keys first, since a misspelt key is also a missing one."""
    errors = error.errors(include_url=False)
    # A list whose entries are refused is also too short.
    lists = {each["loc"][:-1] for each in errors}
    errors = [each for each in errors if each["type"] != "too_short" or each["loc"] not in lists]
    errors.sort(key=lambda each: each["type"] != "extra_forbidden")
    return [sentence for each in errors for sentence in _sentences(each, root)]


def _sentences(error: "ErrorDetails", root: type[BaseModel]) -> list[str]:
    """Sentence on an error; several sentences if contradictions are reported together."""
    reason = error.get("ctx", {}).get("error")
    if isinstance(reason, ContradictionError):
        where = _path(error["loc"])
        return [f"{where}: {text}" if where else text for text in reason.args]
    return [_sentence(error, root)]


def _sentence(error: "ErrorDetails", root: type[BaseModel]) -> str:
    location, given = error["loc"], error.get("input")
    where = _path(location)
    match error["type"]:
        case "extra_forbidden":
            return f"{where} is not a known key; {_nearest(location, root)}"
        case "missing":
            return f"{where} is missing ({_description(location, root)})"
        case "union_tag_not_found":
            kinds = " or ".join(map(repr, _kinds(location, root)))
            return f"{where}.kind is missing; choose from {kinds}"
        case "union_tag_invalid":
            allowed = error["ctx"]["expected_tags"]
            return f"{where}.kind = {error['ctx']['tag']!r} is not allowed; choose from {allowed}"
        case "literal_error":
            return f"{where} = {given!r} is not allowed; choose from {error['ctx']['expected']}"
        case "model_type" | "model_attributes_type" if isinstance(given, BaseModel):
            return f"{where} is a {type(given).__name__}, which does not belong there"
        case "model_type" | "model_attributes_type":
            return f"{where} = {given!r} should be a table of keys, [{where}]"
        case "greater_than_equal":  # pydantic writes 1e-13 with thirteen decimals
            return f"{where} = {given!r} should be greater than or equal to {error['ctx']['ge']:g}"
        case "value_error":
            return f"{where} = {given!r} {error['ctx']['error']}"
    text = error["msg"].removeprefix("Input ").replace("Tuple should", "should")
    return f"{where} = {given!r} {text}".replace("a valid tuple", "a list")


def _path(location: tuple[int | str, ...]) -> str:
    path = ""
    for part in location:
        if isinstance(part, int):
            path += f"[{part}]"
        elif part not in _KINDS:
            path += f".{part}" if path else part
    return path


def _section(location: tuple[int | str, ...], root: type[BaseModel]) -> type[BaseModel]:
    """Find the innermost model on the way to `location`."""
    model = root
    for part, following in pairwise(location):
        field = model.model_fields.get(str(part))
        choices = sections_in(field.annotation) if field else []
        if following in _KINDS:
            model = next(m for m in choices if following in get_args(_kind(m)))
        elif choices:
            model = choices[0]
    return model


def _kind(model: type[BaseModel]) -> object:
    return model.model_fields["kind"].annotation


def _kinds(location: tuple[int | str, ...], root: type[BaseModel]) -> list[str]:
    """Kinds of the section at `location`."""
    field = _section(location, root).model_fields[str(location[-1])]
    return [kind for model in sections_in(field.annotation) for kind in get_args(_kind(model))]


def _nearest(location: tuple[int | str, ...], root: type[BaseModel]) -> str:
    fields = list(_section(location, root).model_fields)
    key = str(location[-1])
    others = [
        f"[{name}]"
        for name, field in root.model_fields.items()
        if name != location[0]
        and any(key in model.model_fields for model in sections_in(field.annotation))
    ]
    here = root.model_fields.get(str(location[0])) if len(location) > 1 else None
    models = sections_in(here.annotation) if here else []
    kinds = [k for model in models if key in model.model_fields for k in get_args(_kind(model))]
    if kinds:
        return f"it belongs to {location[0]}.kind = {' or '.join(map(repr, kinds))}"
    longer = [name for name in fields if key in name.split("_")]  # area for area_fraction
    if len(location) > 1 and others:
        own = f", or did you mean {longer[0]}?" if longer else ""
        return f"it belongs in {' or '.join(others)}{own}"
    near = longer or get_close_matches(key, fields, n=1, cutoff=0.5)
    return f"did you mean {near[0]}?" if near else f"known are {', '.join(fields)}"


def _description(location: tuple[int | str, ...], root: type[BaseModel]) -> str:
    """Description of the field or, for an entry of a list, of the list."""
    fields = _section(location, root).model_fields
    described = (fields[str(part)].description for part in reversed(location) if part in fields)
    return next(described) or "no description"
