"""Titles of the columns of a text file, with their units: "x [mm]; y [mm]; z [µm]"."""

import re
from dataclasses import dataclass, replace
from pathlib import Path

from fem_seal.errors import InvalidInput
from fem_seal.field_file import header_words as known
from fem_seal.field_file.recorded import in_si
from fem_seal.field_file.text_table import Layout, TextTable

# "x [mm]", "x/mm" and "x in mm", whose ends must be units.
_MARKED = re.compile(r"(.*?)\s*(?:[\[({]\s*([^\[({]*?)\s*[\])}]|/\s*(\S.*?)|\s+in\s+(\S+))\s*")
# "x_mm", "x mm".
_UNMARKED = re.compile(r"(.*\w)[\s_,]+([^\s_]+)")
# "um", "N/mm²".
_UNIT = re.compile(r"[A-Za-zµμÅ~][\w·*/^²³~-]{0,15}")
# "units: um mm mm", a line below the titles.
_UNITS_OF = re.compile(r"\s*(units?|einheit(en)?|unités?)\b[\s:=;,]*", re.IGNORECASE)
# "x [mm] y / mm": blanks before a unit separate no columns.
_BEFORE_UNIT = re.compile(r"\s+(?=[\[(/])|(?<=/)\s+")
# "pressure in MPa".
_UNIT_WORD = re.compile(r"(?<![^\W_])(?:[nuµμmc]m|inch|mil|[hkMG]Pa|m?bar|psi|ksi|N/mm)(?![^\W_])")


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
        return cls(match[1], match[2]) if match and is_unit(match[2]) else cls(cell)

    @property
    def axis(self) -> str:
        """One of "x", "y", "z" for heights and "p" for pressures, else empty."""
        words = known.words_of(self.name)
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
        if any(inside) and all(not cell or is_unit(cell) for cell in inside):
            units = inside
        elif cells and all(any(map(str.isalpha, cell)) for cell in cells):
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
        text = _BEFORE_UNIT.sub("", line) if separator is None else line
        cells = Layout(separator, ".").cells(text)
        if cells[-1:] == [""]:
            cells.pop()
        if len(cells) != table.values.shape[1]:
            continue
        # Words of a sentence may be as many as columns, too.
        titles = [Title.of(cell) for cell in cells] if separator is None else []
        named = [title for title in titles if title.axis or title.unit or is_unit(title.name)]
        if separator is not None or len(named) > 1:
            return cells
    return []


def names_units(line: str) -> bool:
    """Whether a word of a line is a unit of length or pressure other than m and Pa."""
    return bool(_UNIT_WORD.search(line))


def is_unit(text: str, *quantities: str) -> bool:
    """Whether a text is a unit of a quantity, by default of length ("m") or pressure ("Pa")."""
    for si in quantities or ("m", "Pa") if _UNIT.fullmatch(text) else ():
        try:
            in_si(text, si, "")
        except InvalidInput:
            continue
        return True
    return False


def unit_of_length(text: str) -> str | None:
    """The unit of length that a text is; None for any other text."""
    return text if is_unit(text, "m") else None
