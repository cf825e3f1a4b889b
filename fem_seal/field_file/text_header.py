"""Statements of the header of a text file: steps or lengths, units, counts, mark of missing points.

A line of a header is a key and a value, `Width: 10 µm`, `x-step [um] = 0.5`, `"Unit","nm"`, or the
titles of columns, `x [mm]; y [mm]; z [µm]`. Words that are not in the tables below are ignored.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite

from fem_seal.errors import InvalidInput
from fem_seal.field_file.length_units import length_in_metres

# Words of a key, in lower case. German ones are those of instruments sold with German software.
STEPS = {"step", "spacing", "increment", "pitch", "cellsize", "sampling", "calibration", "dx", "dy"}
STEPS |= {"interval", "delta", "xstep", "ystep", "schritt", "schrittweite", "punktabstand"}
STEPS |= {"pixelgröße", "justierung", "pas"}
STEP_PAIRS = [{"pixel", "size"}, {"pixel", "width"}, {"pixel", "height"}, {"point", "distance"}]
STEP_PAIRS += [{"lateral", "resolution"}, {"cell", "size"}, {"x", "resolution"}]
STEP_PAIRS += [{"y", "resolution"}, {"distance", "points"}, {"distance", "lines"}]
LENGTHS = {"width", "height", "length", "range", "size", "extent", "breite", "höhe", "länge"}
LENGTHS |= {"fov", "view"}
COUNTS = {"pixels", "points", "samples", "columns", "rows", "lines", "cols", "ncols", "nrows"}
COUNTS |= {"spalten", "zeilen", "punkte"}
AXES = {"axis", "achse", "axe"}
# These are numbers of points only if they are the whole key, as in files of Keyence.
DIRECTIONS = {"horizontal", "vertical", "horizont", "vertikal"}
UNITS = {"unit", "units", "einheit", "unité"}
ALONG_LINE = {"x", "dx", "xstep", "width", "breite", "horizontal", "columns", "cols", "ncols"}
ALONG_LINE |= {"spalten", "horizont"}
ACROSS_LINES = {"y", "dy", "ystep", "height", "höhe", "vertical", "rows", "nrows", "lines"}
ACROSS_LINES |= {"zeilen", "vertikal"}
LATERAL = {"xy", "lateral", "horizontal", "x", "y"}
VALUES = {"z", "value", "values", "height", "heights", "data", "gap", "wert"}
# Lengths of anything but a side of the map.
NO_LENGTHS = {"z", "wave", "wavelength", "focal", "cut", "file", "tip"}
MARKS = [{"nodata"}, {"no", "data"}, {"missing"}, {"bad"}, {"invalid"}, {"undefined"}]

_NUMBER = r"[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?"
_QUANTITY = re.compile(rf"({_NUMBER})[\s;,\t\[(]*([A-Za-zµμÅ~]*)")
_NAME = re.compile(r"[A-Za-zµÅ~]+")
_BRACKETS = re.compile(r"[\[(]\s*([A-Za-zµμÅ~]+)\s*[\])]")
_TITLE = re.compile(r"([A-Za-z][\w ]*?)\s*[\[(]\s*([A-Za-zµμÅ~]+)\s*[\])]")
# "dx = 1", "Width: 10", "Unit,um"; or words and a number with blanks between, "cellsize 30".
_PAIR = re.compile(r"\s*([^:=;,\t]*?[^\s:=;,\t])\s*[:=;,\t]\s*(.*)")
_BLANK_PAIR = re.compile(r"\s*([A-Za-z][\w\- ]*?)\s+([-+\d.].*)")
_CAMEL = re.compile(r"(?<=[a-zäöü])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
# Several statements on a line, with commas or semicolons between.
_SEVERAL = re.compile(r"[,;]\s*(?=[A-Za-z][\w ]*\s*[=:])")
# "Heights in um"; headers of ContactMechanics (CommandLineInterface/HardWall.py) end with "they are
# reported in units of m.".
_SENTENCE = re.compile(r"(?:\bin units of|\bz in|\bheights? in) (\S+?)\.?$", re.IGNORECASE)
# "Spacing (X, Y)": its comma is not the one between key and value.
_BOTH = re.compile(r"[\[(]\s*x\s*[,;/]\s*y\s*[\])]", re.IGNORECASE)
QUOTED = 3  # most lines about lengths that a message quotes


@dataclass
class Statements:
    """Statements of a header; empty or None where it has none.

    Attributes
    ----------
    steps, lengths : dict
        "x", "y" or "" (both): number and unit or None. A length without a unit may be a count.
    counts : dict
        "x", "y": number of points.
    unit, lateral_unit : str or None
        Unit of the values, and of lengths without a unit of their own.
    units : dict
        Unit of each titled column by its name in lower case.
    missing : list of float
        Numbers that mark missing points.
    about_lengths : list of str
        Lines that name a step or a length, whether or not they are understood.
    """

    steps: dict[str, tuple[float, str | None]] = field(default_factory=dict)
    lengths: dict[str, tuple[float, str | None]] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    unit: str | None = None
    lateral_unit: str | None = None
    units: dict[str, str] = field(default_factory=dict)
    missing: list[float] = field(default_factory=list)
    about_lengths: list[str] = field(default_factory=list)

    @property
    def unit_of_values(self) -> str | None:
        """Unit of the heights."""
        return self.units.get("z") or self.units.get("height") or self.unit

    @property
    def titled_as_profiles(self) -> bool:
        """Whether titles of columns name x and no y."""
        return "x" in self.units and "y" not in self.units

    def unit_along(self, axis: str) -> str | None:
        """Unit of the coordinates along "x" or "y"."""
        return self.units.get(axis) or self.lateral_unit

    def metres(self, numbers: Mapping[str, tuple[float, str | None]], axis: str) -> float | None:
        """Length [m] along an axis out of `steps` or `lengths`; None if they lack it."""
        number, unit = numbers.get(axis) or numbers.get("") or (0.0, None)
        unit = unit or self.lateral_unit
        return None if unit is None or not number else number * length_in_metres(unit, "lengths")

    @property
    def length_hint(self) -> str:
        """Quote of the lines about lengths, for a message that asks for them; "" without any."""
        if not self.about_lengths:
            return ""
        lines = " and ".join(f"{line!r}" for line in self.about_lengths[:QUOTED])
        return f"; its header says {lines}, but no lengths of both sides with their unit"


def statements(header: Iterable[str]) -> Statements:
    """Read the lines of a header.

    Parameters
    ----------
    header : iterable of str
        Lines, with or without the marks of comments.
    """
    statements = Statements()
    for line in header:
        text = line.strip().lstrip("#%!/*; \t").replace('"', "").rstrip(" ,;\t")
        if match := _SENTENCE.search(text):
            statements.unit = statements.unit or _length_unit(match.group(1))
        if _about_lengths(text):
            statements.about_lengths.append(text)
        for part in _SEVERAL.split(_BOTH.sub(" x y ", text)):
            _read(part, statements)
    return statements


def _read(text: str, statements: Statements) -> None:
    """Add one statement, or the units of one line of titles."""
    titles = {name.strip().lower(): unit for name, unit in _TITLE.findall(text)}
    titles = {name: unit for name, unit in titles.items() if _length_unit(unit)}
    match = _PAIR.fullmatch(text) or _BLANK_PAIR.fullmatch(text)
    if match and len(titles) < 2:
        _understand(match.group(1), match.group(2), statements)
    else:
        statements.units |= titles


def _understand(key: str, value: str, statements: Statements) -> None:
    """Add the statement of one key and its value."""
    in_key = _BRACKETS.search(key)
    unit_of_key = _length_unit(in_key.group(1)) if in_key else None
    words = _words(_BRACKETS.sub(" ", key))
    axes = _axes(words)
    unit = _length_unit(value.strip())
    if words & UNITS or (unit and words & VALUES):
        if words & VALUES:
            statements.unit = statements.unit or unit
        elif words & LATERAL:
            statements.lateral_unit = statements.lateral_unit or unit
        elif unit:
            statements.unit, statements.lateral_unit = (
                statements.unit or unit,
                statements.lateral_unit or unit,
            )
        return
    numbers = list(_quantities(value, unit_of_key))
    if not numbers:
        return
    (number, unit), pair = numbers[0], numbers[:2]
    if any(mark <= words for mark in MARKS):
        statements.missing.append(number)
    elif _names_steps(words):
        # A key such as "Z step" is about the heights.
        if not words & {"z"}:
            _put(statements.steps, axes, pair)
    elif words & COUNTS or words <= DIRECTIONS:
        if len(axes) == 1 and unit is None and number == int(number):
            statements.counts[axes] = int(number)
    elif words & LENGTHS and not words & NO_LENGTHS:
        _put(statements.lengths, axes, pair)


def _words(text: str) -> set[str]:
    """Words of a text in lower case."""
    return set(re.findall(r"[a-zäöüßé]+", _CAMEL.sub(" ", text).lower()))


def _axes(words: set[str]) -> str:
    """Axes that a key names: "x", "y", both as "xy", or none as ""."""
    if words & {"distance"} and words & {"points"}:
        return "x"
    # "Field width X" and "pixel height Y" are about one axis each.
    along, across = words & {"x", "dx"}, words & {"y", "dy"}
    if not along and not across:
        along, across = words & ALONG_LINE, words & ACROSS_LINES
    return "x" * bool(along) + "y" * bool(across)


def _names_steps(words: set[str]) -> bool:
    return bool(words & STEPS) or any(step <= words for step in STEP_PAIRS)


def _about_lengths(line: str) -> bool:
    """Whether a line names a step, or a length with a number, of the map and not of its heights."""
    words = _words(line)
    if words & NO_LENGTHS and not words & {"x", "y", "xy"}:
        return False
    return _names_steps(words) or bool(words & (LENGTHS | AXES) and re.search(r"\d", line))


def _put(
    lengths: dict[str, tuple[float, str | None]],
    axes: str,
    pair: list[tuple[float, str | None]],
) -> None:
    """Keep one length, or "10 µm x 8 µm" as those of both axes."""
    if len(pair) == 2 and axes in ("", "xy"):
        unit = pair[1][1]
        lengths["x"], lengths["y"] = (pair[0][0], pair[0][1] or unit), pair[1]
    elif pair[0][0] > 0:
        for axis in axes or [""]:
            lengths.setdefault(axis, pair[0])


def _quantities(value: str, unit: str | None) -> Iterator[tuple[float, str | None]]:
    """Numbers of a value with their units, else with that of the key."""
    for text, name in _QUANTITY.findall(value):
        number = float(text.replace(",", ".").rstrip("."))
        if isfinite(number):
            yield number, _length_unit(name) or unit


def _length_unit(name: str) -> str | None:
    """The name of a unit of length; None for any other text."""
    name = name.replace("μ", "µ")
    if name in ("micron", "microns"):
        return "um"
    if not _NAME.fullmatch(name):
        return None
    try:
        length_in_metres(name, "")
    except InvalidInput:
        return None
    return name
