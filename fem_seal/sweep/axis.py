"""Points of a sweep: fields of the scene and the values that they take."""

import csv
import re
from collections import Counter
from itertools import product
from pathlib import Path
from typing import TypeAlias

from fem_seal.digits import number_of
from fem_seal.errors import InvalidInput
from fem_seal.scene.files import parse_assignment

# Text without commas, and whole lists and quoted strings with theirs.
_VALUE = re.compile(r"""(?:[^,\[\]"']|\[[^\]]*\]|"[^"]*"|'[^']*')+""")
_KEY = re.compile(r"\s*\w+(\.\w+)+\s*")
_RANGE = re.compile(r"(-?\d+)\.\.(-?\d+)")
MOST_POINTS = 1_000_000


Points: TypeAlias = tuple[tuple[str, ...], list[tuple[str, ...]]]  # keys, and their values


def combinations(*texts: str, folder: Path = Path()) -> Points:
    """Keys of fields such as "key=v1,v2,...", and all combinations of their values.

    Commas inside lists and quotes do not separate. A value may be a range of whole numbers,
    1..1000, both ends included. That of a path may be a pattern such as ``maps/*.npz`` relative to
    `folder`, for all files that match.
    """
    values_of: dict[str, list[str]] = {}
    for text in texts:
        keys, listed = parse_assignment(text)
        written = [value.strip() for value in _VALUE.findall(listed)]
        whole = "".join(",".join(written).split()) == "".join(listed.split())
        if not (whole and written and all(written)):
            raise InvalidInput(f"{text!r} is not of the form section.key=v1,v2,...")
        key = ".".join(keys)
        values = [one for value in written for one in _expanded(key, value, folder)]
        if key in values_of:
            raise InvalidInput(f"{key} is varied twice")
        if len(set(values)) < len(values):
            twice = next(value for value in values if values.count(value) > 1)
            raise InvalidInput(f"{text!r} gives {twice} twice")
        values_of[key] = values
    return tuple(values_of), list(product(*values_of.values()))


def _expanded(key: str, value: str, folder: Path) -> list[str]:
    """Values that a range or a pattern of files stands for."""
    if match := _RANGE.fullmatch(value):
        first, last = int(match[1]), int(match[2])
        if not first <= last < first + MOST_POINTS:
            raise InvalidInput(
                f"the range {value} of {key} must rise, by less than {MOST_POINTS} values"
            )
        return [str(number) for number in range(first, last + 1)]
    if key.endswith(".path") and not {"*", "?"}.isdisjoint(value):
        pattern = Path(value.strip("\"'"))
        base = Path(pattern.anchor) if pattern.is_absolute() else folder
        files = sorted(base.glob(str(pattern.relative_to(pattern.anchor))))
        if not files:
            raise InvalidInput(f"no file matches {value} of {key} in {base.absolute()}")
        # TOML's literal strings: names may hold commas and backslashes, but no quotes.
        names = files if pattern.is_absolute() else [file.relative_to(folder) for file in files]
        return [f"'{name}'" for name in names]
    return [value]


def read_points(path: str | Path) -> Points:
    """Points of a CSV file: a header of keys such as contact.pressure, and a line for each."""
    path = Path(path)
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            head, *lines = [row for row in csv.reader(file) if row]
    except (OSError, ValueError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or "it is no table of comma-separated values"
        raise InvalidInput(f"cannot read the points {path}: {reason}") from None
    if wrong := [key for key in head if not _KEY.fullmatch(key)]:
        raise InvalidInput(
            f"the first line of {path} names {wrong[0]!r}, which is no field such as "
            "surface.seed; fields and values are separated by commas"
        )
    keys = tuple(".".join(parse_assignment(f"{key}=0")[0]) for key in head)
    if len(set(keys)) < len(keys) or not lines:
        raise InvalidInput(
            f"{path} needs a first line that names each field once, and a line for each point; it "
            f"names {', '.join(keys)}, and {number_of(len(lines), 'line')} follow"
        )
    for number, line in enumerate(lines, start=1):
        if len(line) != len(keys):
            raise InvalidInput(
                f"point {number} of {path} has {number_of(len(line), 'value')} for "
                f"{number_of(len(keys), 'field')}"
            )
    points = [tuple(cell.strip() for cell in line) for line in lines]
    point, times = Counter(points).most_common(1)[0]
    if times > 1:
        raise InvalidInput(f"{path} names the point ({', '.join(point)}) {times} times; keep one")
    return keys, points
