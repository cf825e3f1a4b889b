"""Tables of numbers in text files: encoding, separators, decimal commas, marks, headers.

No library reads them all: numpy.genfromtxt and pandas must know separator, decimal mark and length
of the header. Here these are chosen such that most lines can be read.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fem_seal.digits import number_of
from fem_seal.errors import InvalidInput
from fem_seal.field_file.containers import whole
from fem_seal.field_file.recorded import FEWEST

# Texts that programs write for a point without a height, in lower case, besides those that float()
# takes for NaN; "": an empty cell.
MISSING = {
    "", "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#ind", "1.#ind", "#n/a",
    "bad", "nodata", "no-data", "n/a", "na", "null", "none", "invalid", "masked", "missing",
    "*", "**", "***", "****", "*****", "-", "--", "---", "----", "?",
}  # fmt: skip
COMMENT = ("#", "%", "!", "//")
SAMPLE = 200  # number of lines by which the separators are chosen
_LOOK = 2000  # bytes examined at the beginning and at the end
_UTF_16 = b"\xff\xfe", b"\xfe\xff"  # byte-order marks
_CONTROL = re.compile(rb"[\x00-\x08\x0b\x0e-\x1a\x1c-\x1f]")
SHOWN = 40  # characters of a file that a message quotes

_ASIDE = re.compile(r"\s#(?!n/a).*", re.IGNORECASE)
_NO_DATA = re.compile(r"\bno[ _]data\b", re.IGNORECASE)
_DECIMAL_COMMA_ONLY = re.compile(r"[^.]*\d,\d[^.]*")


@dataclass(frozen=True, eq=False)
class TextTable:
    """Numbers of a text file."""

    values: np.ndarray  #: (lines, columns), NaN where a point is missing
    header: tuple[str, ...]  #: lines before the numbers, and comments
    line: np.ndarray  #: (lines,), number of each line in the file, counted from 1
    layout: "Layout"  #: separator and decimal mark
    #: text in the place of the first number, above a column and beside a line of coordinates
    corner: str | None = None


@dataclass(frozen=True)
class Layout:
    """How the numbers of a line are written."""

    separator: str | None  #: separator of numbers; None: blanks
    decimal: str  #: decimal mark, "." or ","
    indent: int = 0  #: number of tabs before the first column

    def cells(self, line: str) -> list[str]:
        """Texts between the separators of a line, without blanks and quotes around them."""
        line = line.replace('"', "")
        if "#" in line:
            line = _ASIDE.sub("", line)
        if self.separator is None:
            return _NO_DATA.sub("nodata", line).split()
        cells = [cell.strip() for cell in line.split(self.separator)]
        return cells if any(cells[: self.indent]) else cells[self.indent :]

    def number(self, cell: str) -> float | None:
        """The number of a cell, NaN for a mark of a missing point, and None for other text."""
        if self.decimal == "," and ("." in cell or cell.endswith(",") or cell.startswith(",")):
            return float("nan") if cell.lower() in MISSING else None
        try:
            # float() takes 1_000 for a thousand, which no instrument writes.
            return float(cell.replace(self.decimal, ".")) if "_" not in cell else None
        except ValueError:
            marks = cell.lower() in MISSING or _NO_DATA.fullmatch(cell)
            return float("nan") if marks else None

    def numbers(self, cells: list[str]) -> Sequence[float | None]:
        """Numbers of the cells of a line by `number`."""
        return [self.number(cell) for cell in cells]

    def row(self, line: str) -> Sequence[float | None]:
        """Numbers of a line, one for each cell."""
        return self.numbers(self.cells(line))


# The first of the layouts that read most lines is chosen.
LAYOUTS = [
    Layout(separator, decimal)
    for separator in ("\t", ";", ",", None)
    for decimal in ".,"
    if separator != decimal
]


def read_table(path: Path, columns: int | None = None) -> TextTable:
    """Read the numbers of a text file, in a number of columns if it is given.

    Lines before the first line of numbers are its header. Separators are tabs, semicolons, commas
    or blanks, with decimal points or commas; the text is UTF-8, UTF-16 or Windows-1252.
    """
    with whole(path, "text"):
        data = path.read_bytes()
    lines = re.split(r"\r\n|\r|\n", decoded(data, path))
    layout, width = _layout(lines, columns, path)
    return _table(lines, layout, width, path)


def decoded(data: bytes, path: Path) -> str:
    """Text of a file in UTF-8, UTF-16 or Windows-1252, with or without a byte-order mark."""
    encoding = "utf-8-sig"
    if data.startswith(_UTF_16):
        encoding = "utf-16"
    else:
        # In UTF-16 every second byte of digits and separators is 0.
        zeros = [data[k:200:2].count(0) / max(len(data[k:200:2]), 1) for k in (0, 1)]
        if max(zeros) > 0.5 and min(zeros) == 0:
            encoding = "utf-16-be" if zeros[0] else "utf-16-le"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        if encoding != "utf-8-sig":
            raise InvalidInput(
                f"{path} cannot be read: byte {error.start + 1} is no text in UTF-16"
            ) from None
        text = data.decode("cp1252", errors="replace")
    if "\0" in text:
        raise InvalidInput(
            f"{path} cannot be read: it is no text file, character {text.index(chr(0)) + 1} is 0"
        )
    return text


def is_text(path: Path) -> bool:
    """Whether beginning and end of a file are text."""
    with whole(path, "text"), path.open("rb") as file:
        head = file.read(_LOOK)
        file.seek(max(path.stat().st_size - _LOOK, 0))
        tail = file.read()
    return head.startswith(_UTF_16) or not _CONTROL.search(head + tail)


def is_comment(line: str) -> bool:
    """Whether a line begins with the mark of a comment."""
    return line.lstrip().startswith(COMMENT)


def _layout(lines: list[str], width: int | None, path: Path) -> tuple[Layout, int]:
    """Layout that reads most lines, and its number of columns."""
    used = [line for line in lines if line.strip() and not is_comment(line)]
    if not used:
        raise InvalidInput(f"{path} holds no numbers: it is empty, or has comments only")
    every, used = used, used[:: -(-len(used) // SAMPLE)]
    readings: list[tuple[int, int, Layout]] = []
    for layout in LAYOUTS:
        rows = _cells_of_numbers(layout, used)
        if layout.separator == "\t" and rows and not any(cells[0] for cells in rows):
            layout = replace(layout, indent=_indent(layout, every))
            rows = _cells_of_numbers(layout, used)
        # A separator at the end of every line begins no column.
        lengths = Counter(
            len(cells)
            for cells in rows
            if width in (None, len(cells), len(cells) - (not cells[-1]))
        )
        if not lengths:
            continue
        length, frequency = max(lengths.items(), key=lambda item: (item[1], item[0]))
        of_length = (cells for cells in map(layout.cells, every) if len(cells) == length)
        empty = not any(cells[-1] and _is_data(layout.numbers(cells)) for cells in of_length)
        if width in (None, length - empty):
            readings.append((frequency, length - empty, layout))
    if not readings:
        number = lines.index(every[0]) + 1
        numbers = "numbers" if width is None else f"{width} numbers"
        raise InvalidInput(
            f"{path} holds no line of {numbers}; line {number} is {_quoted(lines[number - 1])}"
        )
    most = max(frequency for frequency, _, _ in readings)
    best = [(columns, layout) for frequency, columns, layout in readings if frequency == most]
    columns, layout = max(best, key=lambda reading: reading[0])
    example = used[-1].strip()
    unclear = ", " in example or len({count for count, _ in best}) > 1
    by_commas = width is None and layout.separator == ","
    if by_commas and unclear and _DECIMAL_COMMA_ONLY.fullmatch(example):
        raise InvalidInput(
            f"{path} has lines such as {_quoted(example)}, whose commas may be decimal commas or "
            "stand between numbers; put semicolons between numbers, or write decimal points"
        )
    return layout, columns


def _cells_of_numbers(layout: Layout, lines: list[str]) -> list[list[str]]:
    """Cells of the lines that hold numbers."""
    return [cells for cells in map(layout.cells, lines) if _is_data(layout.numbers(cells))]


def _indent(layout: Layout, lines: list[str]) -> int:
    """Number of tabs with which all lines begin, from the first line of numbers on.

    They are blanks before the lines, as many programs write. Commas and semicolons are not: they
    begin with a column of missing points.
    """
    first = next(k for k, line in enumerate(lines) if _is_data(layout.row(line)))
    blanks = (line[: len(line) - len(line.lstrip())] for line in lines[first:])
    return min(before.count("\t") for before in blanks)


def _is_data(row: Sequence[float | None]) -> bool:
    """Whether a line holds numbers and marks of missing points alone."""
    return None not in row and any(number == number for number in row)


def _table(lines: list[str], layout: Layout, columns: int, path: Path) -> TextTable:
    """Numbers of all lines, from the first line with `columns` numbers on."""
    header: list[str] = []
    corner = None
    rows: list[np.ndarray] = []
    numbers_of_lines: list[int] = []
    for k, line in enumerate(lines, 1):
        cells = layout.cells(line)
        # Tabs alone are a row of missing points in a matrix, and nothing in a list of x, y, height.
        row_of_tabs = layout.separator == "\t" and len(cells) >= columns > FEWEST
        if not line.strip() and not row_of_tabs:
            continue
        if is_comment(line):
            header.append(line)
            continue
        if len(cells) == columns + 1 and not cells[-1]:
            cells.pop()
        row = layout.numbers(cells)
        if not (rows or _begins(row, cells, columns, bool(header))):
            header.append(line)
            continue
        if not rows and len(cells) == columns > FEWEST and None not in row[1:] and row[0] is None:
            corner, row = cells[0], [float("nan"), *row[1:]]
        if len(cells) != columns:
            raise InvalidInput(
                f"line {k} of {path} has {number_of(len(cells), 'number')}, and other lines have "
                f"{columns}: {_quoted(line)}"
            )
        if None in row:
            column = row.index(None)
            comma = layout.decimal == "," and re.fullmatch(r"[-+]?\d*\.\d+", cells[column])
            mark = " (other numbers have decimal commas)" if comma else ""
            raise InvalidInput(
                f"line {k}, column {column + 1} of {path} is {_quoted(cells[column])}, which is no "
                f"number{mark}, nor a mark of a missing point such as NaN, BAD, *** or nothing at "
                "all"
            )
        numbers_of_lines.append(k)
        rows.append(np.array(row, dtype=float))
    if not rows:
        raise InvalidInput(
            f"{path} holds no lines of {number_of(columns, 'number')} below its header"
        )
    return TextTable(np.array(rows), tuple(header), np.array(numbers_of_lines), layout, corner)


def _begins(row: Sequence[float | None], cells: list[str], columns: int, headed: bool) -> bool:
    """Whether a line is the first one of the numbers, not of the header.

    A line with a few words among many numbers is not a header but a fault. A line of separators
    alone is an empty header line of a spreadsheet; without a header before it, a row of missing
    points.
    """
    if len(row) != columns:
        return False
    if None not in row:
        return not headed or any(cells)
    return 2 * sum(number is not None and number == number for number in row) > columns


def _quoted(text: str) -> str:
    text = text.strip()
    return repr(text if len(text) <= SHOWN else f"{text[:SHOWN]} …")
