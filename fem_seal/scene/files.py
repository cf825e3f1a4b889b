"""Reading TOML, and single fields from the command line."""

import re
import tomllib
from pathlib import Path
from shlex import quote
from typing import Any

from fem_seal.errors import InvalidInput

# Limit on dots: tomllib needs n² steps for a key of n dotted parts. A scene has about a dozen dots.
MOST_DOTS = 2000
DEEPEST = 10  # tables and lists inside each other; scenes need four


def scene_text(path: Path) -> str:
    """Text of a scene file; InvalidInput if it cannot be read."""
    try:
        return path.read_text(encoding="utf-8-sig")  # some editors begin with a byte order mark
    except UnicodeDecodeError:
        raise _no_scene(path, "it is not UTF-8 text") from None
    except OSError as error:
        raise InvalidInput(f"cannot read the scene file {path}: {error.strerror}") from None


def tables_of(text: str, path: Path) -> dict[str, Any]:
    """Tables of the text of a TOML file; InvalidInput if it is not TOML."""
    lines = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
    if (dots := sum(line.count(".") for line in lines)) > MOST_DOTS:
        raise _no_scene(path, f"it has {dots} dots outside comments, and {MOST_DOTS} are allowed")
    try:
        data = tomllib.loads(text)
        too_deep = _depth(data) > DEEPEST
    except RecursionError:
        too_deep = True
    except ValueError as error:  # of TOML, or of a number with thousands of digits
        raise _no_scene(path, f"{error}{_hint(text, str(error))}") from None
    if too_deep:
        raise _no_scene(path, f"over {DEEPEST} tables and lists are inside each other")
    return data


def _hint(text: str, error: str) -> str:
    """What to do about the line at which reading TOML has ended; "" if that is not clear."""
    place = re.search(r"at line (\d+)", error)
    line = text.split("\n")[int(place[1]) - 1] if place else ""
    if "\\" in line:
        return "; write a path with / in place of \\, or in single quotes"
    comma = re.search(r"=\s*[-+]?\d+,\d", line)
    return "; write a decimal point in place of a comma" if comma else ""


def _no_scene(path: Path, reason: str) -> InvalidInput:
    """Error for a file that is no scene, with the command that takes a map."""
    file, folder = quote(str(path)), quote(str(path.parent))
    if path.suffix.lower() == ".toml":
        return InvalidInput(f"{path} is not a TOML scene file: {reason}")
    if path.name == "result.json":
        return InvalidInput(
            f"{path} is a result, and not a TOML scene file: fem-seal report {folder} and "
            f"fem-seal render {folder} show it"
        )
    return InvalidInput(
        f"{path} is not a TOML scene file: of heights, fem-seal new {file} writes a scene and "
        f"fem-seal surface {file} shows them; of a gap, fem-seal leak {file} computes the leak rate"
    )


def _depth(value: object) -> int:
    """Number of tables and lists inside each other."""
    inner = list(value.values()) if isinstance(value, dict) else value
    return 1 + max(map(_depth, inner), default=0) if isinstance(inner, list) else 0


def parse_assignment(assignment: str) -> tuple[tuple[str, ...], str]:
    """Split "flow.rtol=0.02" into ("flow", "rtol") and "0.02"."""
    name, equals, text = assignment.partition("=")
    keys = tuple(part.strip() for part in name.split("."))
    if not equals or not 2 <= len(keys) <= DEEPEST or not all(keys):
        raise InvalidInput(f"{assignment!r} is not of the form section.key=value")
    return keys, text.strip()


def override(data: dict[str, Any], assignment: str) -> dict[str, Any]:
    """Copy of `data` with one field set by "section.key=value", or removed by "section.key="."""
    keys, text = parse_assignment(assignment)
    return replaced(data, keys, _value(text) if text else None, assignment)


def replaced(
    table: dict[str, Any], keys: tuple[str, ...], value: object, change: str
) -> dict[str, Any]:
    """Copy of nested tables with one value set, or removed by None; messages quote the change."""
    first, *rest = keys
    if rest:
        inner = table.get(first, {})
        if not isinstance(inner, dict):
            raise InvalidInput(f"{change!r}: {first} is a value, not a table")
        return {**table, first: replaced(inner, tuple(rest), value, change)}
    if value is None:
        return {key: other for key, other in table.items() if key != first}
    return {**table, first: value}


def _value(text: str) -> object:
    """TOML value, or the text itself, since a shell removes the quotes of "5 um".

    The same for the parts of a list, and of the lists in it.
    """
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        if not re.fullmatch(r"\[([^][]|\[[^][]*])*]", text):
            return text
    # A comma of an inner list has a "]" behind it, and no "[" before that.
    return [_value(part.strip()) for part in re.split(r",(?![^[]*])", text[1:-1])]
