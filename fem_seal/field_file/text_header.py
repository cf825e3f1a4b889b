"""Statements of the header of a text file: steps or lengths, units, counts, mark of missing points.

A line of a header is a key and a value, `Width: 10 µm`, `x-step [um] = 0.5`, `"Unit","nm"`, or the
titles of columns, `x [mm]; y [mm]; z [µm]`. Words that `header_words` does not know are ignored.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from math import isclose, isfinite
from pathlib import Path

from fem_seal.errors import InvalidInput
from fem_seal.field_file import header_words as known
from fem_seal.field_file.recorded import in_si
from fem_seal.field_file.text_table import Layout, TextTable

_NUMBER = r"[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?"
# Digits in groups of three, by decimal mark: "1 250", "1'250", "1,250.5" and, with a decimal point,
# "1,250". They may be one number or two, or about one or a thousand.
_THOUSANDS = {
    mark: re.compile(
        r"(?<![\d.,])[1-9]\d{0,2}(?:(?:[ '\u2019\u00a0\u2009\u202f]\d{3})+(?!\d)"
        rf"|(?:(?:[.,]\d{{3}})+[.,]\d+|{other}\d{{3}})(?![\d.,eE]))"
    )
    for mark, other in ((".", ","), (",", r"\."))
}
_QUANTITY = re.compile(rf"({_NUMBER})[\s;,\t\[(]*([A-Za-zµμÅ~]*)")
_BRACKETS = re.compile(r"[\[(]\s*([A-Za-zµμÅ~]+)\s*[\])]")
_TITLE = re.compile(r"([A-Za-z][\w ]*?)\s*[\[(]\s*([A-Za-zµμÅ~]+)\s*[\])]")
# "dx = 1", "Width: 10", "Unit,um"; or words and a number with blanks between, "cellsize 30". The
# comma of "pitch 0,5 um" is a decimal one.
_PAIR = re.compile(r"\s*([^:=;,\t]*?[^\s:=;,\t])\s*(?:[:=;\t]|,(?!(?<=\d,)\d))\s*(.*)")
_BLANK_PAIR = re.compile(r"\s*([A-Za-z][\w\- ]*?)\s+([-+\d.].*)")
_CAMEL = re.compile(r"(?<=[a-zäöü])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
# Several statements on a line, with commas or semicolons between.
_SEVERAL = re.compile(r"[,;]\s*(?=[A-Za-z][\w ]*\s*[=:])")
# "Heights in um", also with "; pixel size 2 um" behind it; headers of ContactMechanics
# (CommandLineInterface/HardWall.py) end with "they are reported in units of m.".
_SENTENCE = re.compile(
    r"\b(?:in units of|(z|heights?|gaps?|höhen?(?:werte)?) in) ([^\s,;]+?)\.?(?:$|[,;]\s*)",
    re.IGNORECASE,
)
# "Spacing (X, Y)": its comma is not the one between key and value.
_BOTH = re.compile(r"[\[(]\s*x\s*[,;/]\s*y\s*[\])]", re.IGNORECASE)
# "Z Scale: 0.001", "Multiplier 1e-3 um".
_FACTOR = re.compile(rf"([^:=\d]*?)[\s:=;,]+({_NUMBER})[\s\[(]*([A-Za-zµμÅ~]*).*")
_AXIS_FIRST = re.compile(
    r"\b([xyz])(?=step|scale|factor|resolution|size|length|range|unit|spacing)"
)
# Titles of columns: "x [mm]", "x/mm" and "x in mm", whose ends must be units; "x_mm", "x mm".
_MARKED = re.compile(r"(.*?)\s*(?:[\[({]\s*([^\[({]*?)\s*[\])}]|/\s*(\S.*?)|\s+in\s+(\S+))\s*")
_UNMARKED = re.compile(r"(.*\w)[\s_,]+([^\s_]+)")
_UNIT = re.compile(r"[A-Za-zµμÅ~][\w·*/^²³~-]{0,15}")
_UNITS_OF = re.compile(r"\s*(units?|einheit(en)?|unités?)\b[\s:=;,]*", re.IGNORECASE)
_BEFORE_UNIT = re.compile(r"\s+(?=[\[(/])|(?<=/)\s+")
_UNIT_WORD = re.compile(r"(?<![^\W_])(?:[nuµμmc]m|inch|mil|[hkMG]Pa|m?bar|psi|ksi|N/mm)(?![^\W_])")
_LETTER = re.compile(r"[^\W\d_]")
ROUNDED = 0.02  # relative difference of two lengths in rounded digits that count as one
QUOTED = 3  # most lines about lengths that a message quotes

# By axis, "x", "y" or "" (both): all that is stated, each a number and its unit or None.
Lengths = dict[str, list[tuple[float, str | None]]]


@dataclass
class Statements:
    """Statements of a header; empty or None where it has none."""

    steps: Lengths = field(default_factory=dict)
    lengths: Lengths = field(default_factory=dict)  #: without a unit perhaps a count
    counts: dict[str, int] = field(default_factory=dict)  #: "x", "y": number of points
    unit: str | None = None  #: of all lengths, those of the values as well
    value_units: list[str] = field(default_factory=list)  #: stated of the values alone
    lateral_unit: str | None = None  #: of lengths without a unit of their own
    axes: set[str] = field(default_factory=set)  #: named by titles of some of the columns
    missing: list[float] = field(default_factory=list)  #: numbers that mark missing points
    #: lines that name a step or a length, whether or not they are understood
    about_lengths: list[str] = field(default_factory=list)
    #: titles of all columns; none in a file that does not name them
    titles: "tuple[Title, ...]" = ()

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
    def length_hint(self) -> str:
        """Quote of the lines about lengths, for a message that asks for them; "" without any."""
        if not self.about_lengths:
            return ""
        return f"; its header says {self.quoted}, but not one length of each side with its unit"

    @property
    def quoted(self) -> str:
        """The lines about lengths."""
        return " and ".join(f"{line!r}" for line in self.about_lengths[:QUOTED])


def statements_of(table: TextTable, path: Path) -> Statements:
    """Read the header of a text file."""
    statements = Statements(titles=column_titles(table))
    for line in table.header:
        text = bare(line).rstrip(" ,;\t")
        if match := _FACTOR.fullmatch(text):
            numbers = _quantities(text[match.start(2) :], None, table.layout.decimal)
            factor, _ = next(numbers, (None, None))
            if _names_a_factor(_words(match[1]), match[3]) and factor != 1:
                raise InvalidInput(
                    f"the header of {path} says {text!r}, a factor: multiply the heights by it "
                    "unless the file holds their products already, and delete the line"
                )
        if (match := _SENTENCE.search(text)) and (unit := _length_unit(match.group(2))):
            if match.group(1):
                statements.value_units.append(unit)
            else:  # of what, the sentence may say anywhere
                statements.unit = statements.unit or unit
        if _about_lengths(text):
            statements.about_lengths.append(text)
        text = _SENTENCE.sub("", text)
        for part in _SEVERAL.split(_BOTH.sub(" x y ", text)):
            # One key with its value, or titles, which may be those of some columns only.
            pairs = [pair for pair in _TITLE.findall(part) if _length_unit(pair[1])]
            match = _PAIR.fullmatch(part) or _BLANK_PAIR.fullmatch(part)
            if match and len(pairs) < 2:
                _understand(match[1], match[2], statements, table.layout.decimal)
            elif not statements.titles:
                statements.axes |= {Title(name).axis for name, _ in pairs}
                for name, unit in pairs:
                    _understand(name, unit, statements, table.layout.decimal)
    return statements


def bare(line: str) -> str:
    """A line without the mark of a comment and quotes."""
    return line.strip().lstrip("#%!/*; \t").replace('"', "")


@dataclass(frozen=True)
class Title:
    """Title of a column, and the text in the place of its unit, be it one or not."""

    name: str
    unit: str = ""

    @classmethod
    def of(cls, cell: str) -> "Title":
        """Read "x [mm]", "x (mm)", "x/mm", "x in mm", "x_mm", "x mm" or "x"."""
        if match := _MARKED.fullmatch(cell):
            return cls(match[1], next(filter(None, match.groups()[1:]), ""))
        match = _UNMARKED.fullmatch(cell)
        return cls(match[1], match[2]) if match and _is_unit(match[2]) else cls(cell)

    @property
    def axis(self) -> str:
        """One of "x", "y", "z" for heights and "p" for pressures, else empty."""
        words = _words(self.name)
        return next((axis for axis, names in known.TITLES.items() if words & names), "")

    def size(self, si: str, path: Path) -> float | None:
        """Size of the unit in "m" or "Pa", None without a unit; refused if it is another one."""
        what = f"the numbers below {self.name!r} in {path}"
        return in_si(self.unit, si, what) if self.unit else None


def column_titles(table: TextTable) -> tuple[Title, ...]:
    """Titles of the columns of a table, with their units in the same line or in one below."""
    titles: list[Title] = []
    units: list[str] = []
    for line in reversed(table.header):
        cells = _cells(_UNITS_OF.sub("", bare(line)), table)
        inside = [cell.strip("[]()- ") for cell in cells]
        if any(inside) and all(not cell or _is_unit(cell) for cell in inside):
            units = inside
        elif cells and all(map(_LETTER.search, cells)):
            line_of_titles = [Title.of(cell) for cell in cells]
            named = any(title.axis or title.unit for title in line_of_titles)
            if named or not titles:
                titles = line_of_titles
            if named:
                break
    titles = titles or [Title("") for _ in units]
    below = units or [""] * len(titles)
    return tuple(
        replace(title, unit=title.unit or unit) for title, unit in zip(titles, below, strict=True)
    )


def _cells(line: str, table: TextTable) -> list[str]:
    """One text for each column; none if the line has another number of them."""
    # Titles may be separated by other marks than numbers; blanks stand inside titles, too.
    for separator in [*sorted("\t;,", key=lambda mark: mark != table.layout.separator), None]:
        # "x [mm] y [mm]": a blank before a bracket separates no columns.
        text = _BEFORE_UNIT.sub("", line) if separator is None else line
        cells = Layout(separator, ".").cells(text)
        if cells[-1:] == [""]:
            cells.pop()
        if len(cells) != table.values.shape[1]:
            continue
        # Words of a sentence may be as many as columns, too.
        titles = [Title.of(cell) for cell in cells] if separator is None else []
        named = [title for title in titles if title.axis or title.unit or _is_unit(title.name)]
        if separator is not None or len(named) > 1:
            return cells
    return []


def unit_in(text: str) -> str | None:
    """Unit of length in brackets, or that is the whole text."""
    match = _BRACKETS.search(text)
    return _length_unit(match[1] if match else text)


def names_units(line: str) -> bool:
    """Whether a word of a line is a unit of length or pressure other than m and Pa."""
    return bool(_UNIT_WORD.search(line))


def _is_unit(text: str, *quantities: str) -> bool:
    """Whether a text is a unit of a quantity, by default of length ("m") or pressure ("Pa")."""
    for si in quantities or ("m", "Pa") if _UNIT.fullmatch(text) else ():
        try:
            in_si(text, si, "")
        except InvalidInput:
            continue
        return True
    return False


def _length_unit(text: str) -> str | None:
    """The unit of length that a text is; None for any other text."""
    return text if _is_unit(text, "m") else None


def _names_a_factor(words: set[str], unit: str) -> bool:
    """Whether a key with a number and a unit is about a factor, and not one of x and y alone."""
    about_heights = bool(words & known.VALUES)
    scales = words & known.SCALES or (words & known.FACTORS and about_heights)
    return (
        bool(scales) and not words & known.NO_FACTOR and (about_heights or not _length_unit(unit))
    )


def _understand(key: str, value: str, statements: Statements, decimal: str) -> None:
    """Add the statement of one key and its value."""
    in_key = _BRACKETS.search(key)
    unit_of_key = _length_unit(in_key.group(1)) if in_key else None
    words = _words(_BRACKETS.sub(" ", key))
    axes = _axes(words)
    unit = _length_unit(value.strip())
    if words & known.UNITS or (unit and words & (known.VALUES | known.LATERAL)):
        if not words <= known.OF_UNITS:
            return
        # Without a word on either it is the unit of both.
        if words & known.VALUES and unit and "resolution" not in words:
            statements.value_units.append(unit)
        elif not words & (known.VALUES | known.LATERAL):
            statements.unit = statements.unit or unit
        if not words & known.VALUES:
            statements.lateral_unit = statements.lateral_unit or unit
        return
    numbers = list(_quantities(value, unit_of_key, decimal))
    if not numbers:
        return
    (number, unit), pair = numbers[0], numbers[:2]
    if marks := [mark for mark in known.MARKS if mark <= words]:
        of_value = words & known.OF_MARKS or words <= {"nodata", "no", "data"}
        if of_value and any(words <= {"data", *mark, *known.OF_MARKS} for mark in marks):
            statements.missing.append(number)
    elif _names_steps(words):
        # A key such as "Z step" is about the heights.
        if not words & {"z"} and _of_the_map(words):
            _put(statements.steps, axes, pair)
    elif words & known.COUNTS or words <= known.DIRECTIONS:
        if len(axes) == 1 and unit is None and number == int(number):
            statements.counts[axes] = int(number)
    elif words & known.LENGTHS and not words & known.NO_LENGTHS and _of_the_map(words):
        _put(statements.lengths, axes, pair)


def _words(text: str) -> set[str]:
    """Words of a text in lower case."""
    return set(re.findall(r"[a-zäöüßé]+", _AXIS_FIRST.sub(r"\1 ", _CAMEL.sub(" ", text).lower())))


def _axes(words: set[str]) -> str:
    """Axes that a key names: "x", "y", both as "xy", or none as ""."""
    if words & {"distance"} and words & {"points"}:
        return "x"
    # "Field width X" and "pixel height Y" are about one axis each.
    along, across = words & {"x", "dx"}, words & {"y", "dy"}
    if not along and not across:
        along, across = words & known.ALONG_LINE, words & known.ACROSS_LINES
    return "x" * bool(along) + "y" * bool(across)


def _names_steps(words: set[str]) -> bool:
    return bool(words & known.STEPS) or any(step <= words for step in known.STEP_PAIRS)


def _of_the_map(words: set[str]) -> bool:
    """Whether a key that names a step or a length is about the map."""
    with_axis = bool(words & known.LATERAL) or not any(key <= words for key in known.WITH_AXIS)
    others = any(other <= words for other in known.OTHERS)
    return with_axis and not others and words <= known.OF_THE_MAP


def _about_lengths(line: str) -> bool:
    """Whether a line names a step, or a length with a number, of the map and not of its heights."""
    words = _words(line)
    if words & known.NO_LENGTHS and not words & {"x", "y", "xy"}:
        return False
    if not re.search(r"\d", line):
        return _names_steps(words)
    # Numbers alone before the others may be counts and lengths.
    return (
        _names_steps(words)
        or not words
        or bool(words & (known.LENGTHS | known.AXES | known.SCALES))
    )


def _put(lengths: Lengths, axes: str, pair: list[tuple[float, str | None]]) -> None:
    """Keep one length, or "10 µm x 8 µm" as those of both axes."""
    if len(pair) == 2 and axes in ("", "xy"):
        (number, unit), second = pair
        lengths.setdefault("x", []).append((number, unit or second[1]))
        lengths.setdefault("y", []).append(second)
    elif pair[0][0] > 0:
        for axis in axes or [""]:
            lengths.setdefault(axis, []).append(pair[0])


def _quantities(value: str, unit: str | None, decimal: str) -> Iterator[tuple[float, str | None]]:
    """Numbers of a value with their units, else with that of the key; none of a doubtful value."""
    if _THOUSANDS[decimal].search(value):
        return
    for text, name in _QUANTITY.findall(value):
        number = float(text.rstrip(".,").replace(",", "."))
        if isfinite(number):
            yield number, _length_unit(name) or unit
