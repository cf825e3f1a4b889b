"""Statements of the header of a text file: steps or lengths, units, counts, mark of missing points.

A statement is a key and a value, `Width: 10 µm`, `x-step [um] = 0.5`, `"Unit","nm"`. The words of
its key say what it is about (`header_words`); with a word that is not known it is about something
else, and is ignored. A value about the map must match `_value_in` to its end: if it does not, the
header says no lengths, and the message that asks for them quotes that line.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from math import isclose, isfinite
from pathlib import Path
from typing import NamedTuple

from fem_seal.errors import InvalidInput
from fem_seal.field_file import header_words as known
from fem_seal.field_file.column_titles import Title, bare, column_titles, unit_of_length
from fem_seal.field_file.recorded import in_si
from fem_seal.field_file.text_table import TextTable

_NUMBER = r"[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?"
_NAME = r"[A-Za-zµμÅ~]+"
# "Width: 10", "Unit,um"; the comma of "pitch 0,5 um" is a decimal one.
_PAIR = re.compile(r"\s*([^:=;,\t]*?[^\s:=;,\t])\s*(?:[:=;\t]|,(?!(?<=\d,)\d))\s*(.*)")
# "cellsize 30"
_BLANK_PAIR = re.compile(r"\s*([A-Za-z][\w\- ]*?)\s+([-+\d.].*)")
# "x step = 2 um, y step = 3 um" is two statements.
_SEVERAL = re.compile(r"[,;]\s*(?=[A-Za-z][\w ]*\s*[=:])")
# "Spacing (X, Y): 2 um": its comma is not the one between key and value.
_BOTH = re.compile(r"[\[(]\s*x\s*[,;/]\s*y\s*[\])]", re.IGNORECASE)
# In "Step X [um]".
_BRACKETS = re.compile(rf"[\[(]\s*({_NAME})\s*[\])]")
# "Z [um]", and titles of some columns only, "x [mm]; z [um]".
_TITLE = re.compile(rf"([A-Za-z][\w ]*?)\s*{_BRACKETS.pattern}")
# "Heights in um", also with "; pixel size 2 um" behind it; headers of ContactMechanics
# (CommandLineInterface/HardWall.py) end with "they are reported in units of m.".
_SENTENCE = re.compile(
    r"\b(?:in units of|(z|heights?|gaps?|höhen?(?:werte)?) in) ([^\s,;]+?)\.?(?:$|[,;]\s*)",
    re.IGNORECASE,
)
# "Z Scale: 0.001", "Multiplier 1e-3 um", whatever follows.
_FACTOR = re.compile(rf"([^:=\d]*?)[\s:=;,]+({_NUMBER}[\s\[(]*({_NAME}|).*)")
ROUNDED = 0.02  # relative difference of two lengths in rounded digits that count as one
QUOTED = 3  # most lines about lengths that a message quotes
# What to write in place of a value that is not understood, by what its line is about.
WANTED = {
    "step": "one number with its unit there, as in 'Pixel size: 0.5 um'",
    "length": "one number with its unit there, as in 'Width: 10 um'",
    "count": "one whole number there, as in 'Columns: 256'",
    "mark": "one number there, as in 'NODATA_value: -9999'",
}

Quantity = tuple[float, str | None]  # a number and its unit
# By axis, "x", "y" or "" (both): all that is stated.
Lengths = dict[str, list[Quantity]]


@cache
def _value_in(decimal: str) -> re.Pattern[str]:
    """One or two numbers with units, by decimal mark.

    "30", "0.5 um", "0,5;µm", "0.5 [um]", "0.5 um/pixel", "3 x 1", "0.5 µm, 0.25 µm", "10 10 ~m".
    Not digits in groups of three, which may be one number or two, or about one or a thousand:
    "1 250", "1'250", and with decimal points "1,250".
    """
    other = "," if decimal == "." else r"\."
    number = rf"((?![-+]?[1-9]\d{{0,2}}{other}\d{{3}}(?![\deE])){_NUMBER})"
    unit = rf"(?:\s*[;,\t]?\s*[\[(]?\s*((?!(?:x|by)\b){_NAME})\s*[\])]?)?(?:/(?:pixel|px|point))?"
    between = r"\s*(?:[x×*/;\t]|by|,\s|\s(?!\d{3}(?!\d)))\s*"
    return re.compile(rf"{number}{unit}(?:{between}{number}{unit})?", re.IGNORECASE)


class Unclear(NamedTuple):
    """A line about the map whose value has another form."""

    about: str  #: as `header_words.about` says
    named: set[str]  #: axes of its key, "x" and "y"
    possible: set[str]  #: axes that its key or its value may name
    says: str  #: what it says, and what to write there


class _Statement(NamedTuple):
    """What a key and its value say of the map."""

    about: str  #: "unit", or as `header_words.about` says; "" if nothing that counts
    words: set[str]  #: of the key, without its unit
    #: of a step or a length one or two, else one; of a unit once that; none of an unclear value
    quantities: list[Quantity]


@dataclass
class Statements:
    """Statements of a header; empty or None where it has none."""

    shape: tuple[int, ...]  #: numbers of its lines and columns
    #: titles of all columns; none in a file that does not name them
    titles: tuple[Title, ...]
    steps: Lengths = field(default_factory=dict)
    lengths: Lengths = field(default_factory=dict)  #: without a unit perhaps a count
    counts: dict[str, int] = field(default_factory=dict)  #: "x", "y": number of points
    unit: str | None = None  #: of all lengths, those of the values as well
    value_units: list[str] = field(default_factory=list)  #: stated of the values alone
    lateral_unit: str | None = None  #: of lengths without a unit of their own
    axes: set[str] = field(default_factory=set)  #: named by titles of some of the columns
    missing: list[float] = field(default_factory=list)  #: numbers that mark missing points
    unclear: list[Unclear] = field(default_factory=list)
    #: lines that name a step or a length, whether or not they are understood
    about_lengths: list[str] = field(default_factory=list)

    def add(self, statement: _Statement) -> None:
        """Add what a statement says, if anything."""
        about, words, quantities = statement
        if not quantities:
            return
        (number, unit), axes = quantities[0], known.axes_of(words)
        if about == "unit":
            # Without a word on either it is the unit of both.
            if unit and words & known.VALUES and "resolution" not in words:
                self.value_units.append(unit)
            elif not words & (known.VALUES | known.LATERAL):
                self.unit = self.unit or unit
            if not words & known.VALUES:
                self.lateral_unit = self.lateral_unit or unit
        elif about == "mark":
            self.missing.append(number)
        elif about == "count" and unit is None and number.is_integer():
            self.counts[axes] = int(number)
        elif about != "count" and number > 0:  # else a number of nothing
            # "10 x 8 µm" is of x and y; "10 µm" of the axes of its key, or of whichever side.
            sides = ["x", "y"] if len(quantities) == 2 else [*axes] or [""]
            lengths = self.steps if about == "step" else self.lengths
            for side, (number, unit) in zip(sides, quantities * 2, strict=False):
                # "Width 512" is a number of points if there are so many.
                if about == "length" and side and unit is None and number in self.shape:
                    self.counts.setdefault(side, int(number))
                else:
                    lengths.setdefault(side, []).append((number, unit))

    def unit_of_values(self, columns: Iterable[int] = ()) -> str | None:
        """Unit of the heights, which stand in some of the titled columns or in all of a matrix."""
        titled = sorted({self.titles[k].unit for k in columns if self.titles} - {""})
        stated = titled + self.value_units
        if len(stated) > 1 and len({in_si(unit, "m", "the heights") for unit in stated}) > 1:
            raise InvalidInput(
                f"the file says that its heights are in {' and in '.join(dict.fromkeys(stated))}; "
                "correct its header, or convert them"
            )
        return (*stated, self.unit)[0]

    @property
    def titled_as_points(self) -> bool:
        """Whether titles of columns name x and y."""
        return {"x", "y"} <= {title.axis for title in self.titles}

    @property
    def titled_as_profiles(self) -> bool:
        """Whether titles of columns name x and no y."""
        axes = self.axes.union(title.axis for title in self.titles)
        return "x" in axes and "y" not in axes

    def unit_of_coordinates(self, column: int) -> str | None:
        """Unit of the coordinates in a column, which may have a title."""
        return (self.titles[column].unit if self.titles else "") or self.lateral_unit

    def metres(self, numbers: Lengths, axis: str) -> float | None:
        """Length [m] along an axis out of `steps` or `lengths`; None if they lack or contradict it.

        Beside a length with a unit a number without one may be that of anything.
        """
        stated = numbers.get(axis, []) + numbers.get("", [])
        with_unit = [(number, unit) for number, unit in stated if unit is not None]
        if not with_unit and self.lateral_unit is not None:
            with_unit = [(number, self.lateral_unit) for number, _ in stated]
        found = [number * in_si(unit, "m", "lengths") for number, unit in with_unit if number > 0]
        agree = all(isclose(found[0], other, rel_tol=ROUNDED) for other in found)
        return found[0] if found and agree else None

    @property
    def quoted(self) -> str:
        """The lines about lengths."""
        return " and ".join(f"{line!r}" for line in self.about_lengths[:QUOTED])


def statements_of(table: TextTable, path: Path) -> Statements:
    """Read the header of a text file."""
    statements = Statements(table.values.shape, column_titles(table))
    for line in table.header:
        text = bare(line).rstrip(" ,;\t")
        _refuse_factor(text, table.layout.decimal, path)
        if (match := _SENTENCE.search(text)) and (unit := unit_of_length(match[2])):
            if match[1]:
                statements.value_units.append(unit)
            else:  # of what, the sentence may say anywhere
                statements.unit = statements.unit or unit
        if known.about_lengths(text):
            statements.about_lengths.append(text)
        for part in _SEVERAL.split(_BOTH.sub(" x y ", _SENTENCE.sub("", text))):
            # One key with its value, or titles, which may be those of some columns only.
            pairs = [pair for pair in _TITLE.findall(part) if unit_of_length(pair[1])]
            match = _PAIR.fullmatch(part) or _BLANK_PAIR.fullmatch(part)
            if match and len(pairs) < 2:
                statement = _statement(match[1], match[2].strip(), table.layout.decimal)
                statements.add(statement)
                if statement.about and not statement.quantities:
                    statements.unclear.append(_unclear(statement.about, match[1], match[2], text))
                    if statement.about == "mark":
                        raise InvalidInput(f"the header of {path} {statements.unclear[-1].says}")
            elif not statements.titles:
                statements.axes |= {Title(name).axis for name, _ in pairs}
                for name, unit in pairs:
                    statements.add(_statement(name, unit, table.layout.decimal))
    return statements


def unit_in(text: str) -> str | None:
    """Unit of length in brackets, or that is the whole text."""
    match = _BRACKETS.search(text)
    return unit_of_length(match[1] if match else text)


def _refuse_factor(text: str, decimal: str, path: Path) -> None:
    """Refuse a line with a factor of the heights, and not one of x and y alone."""
    if not (match := _FACTOR.fullmatch(text)):
        return
    words, of_a_length = known.words_of(match[1]), unit_of_length(match[3])
    about_heights = bool(words & known.VALUES)
    scales = words & known.SCALES or (words & known.FACTORS and about_heights)
    if not scales or words & known.NO_FACTOR or (of_a_length and not about_heights):
        return
    if [number for number, _ in _quantities(match[2], None, decimal)] != [1]:
        raise InvalidInput(
            f"the header of {path} says {text!r}, a factor: multiply the heights by it unless the "
            "file holds their products already, and delete the line"
        )


def _statement(key: str, value: str, decimal: str) -> _Statement:
    """The statement of one key and its value."""
    words = known.words_of(_BRACKETS.sub(" ", key))
    unit, nothing = unit_of_length(value), _Statement("", words, [])
    if words & known.UNITS or (unit and words & (known.VALUES | known.LATERAL)):
        of_the_map = unit and words <= known.OF_UNITS
        return _Statement("unit", words, [(1.0, unit)]) if of_the_map else nothing
    about = known.about(words)
    if not about or not re.search(r"\d", value):
        return nothing
    quantities = _quantities(value, unit_in(key), decimal)
    if len(quantities) == 2:
        of_nothing = about in ("step", "length") and min(number for number, _ in quantities) <= 0
        if of_nothing or known.axes_of(words) in ("x", "y"):
            quantities = []
    return _Statement(about, words, quantities)


def _unclear(about: str, key: str, value: str, text: str) -> Unclear:
    named, words = set(known.axes_of(known.words_of(key))), known.words_of(value)
    along, across = bool(words & known.ALONG_LINE), bool(words & known.ACROSS_LINES)
    possible = named | set("x" * along + "y" * across)
    # "Size: ~10 um x ~8 um" may be of x and y.
    if not named and len(re.findall(_NUMBER, value)) > 1:
        possible = {"x", "y"}
    says = f"says {text!r}, which is not understood; write {WANTED[about]}, or delete the line"
    return Unclear(about, named, possible, says)


def _quantities(value: str, unit: str | None, decimal: str) -> list[Quantity]:
    """One or two numbers with their units, else with that of the key; none of an unclear value."""
    match = _value_in(decimal).fullmatch(value)
    texts = match.groups() if match else ()
    found = [
        (float(number.rstrip(".,").replace(",", ".")), unit_of_length(name or "") or unit)
        for number, name in zip(texts[::2], texts[1::2], strict=True)
        if number
    ]
    if not all(isfinite(number) for number, _ in found):
        return []
    # "0.5 x 0.25 µm": the unit of the second is that of both.
    return [(number, unit or found[-1][1]) for number, unit in found]
