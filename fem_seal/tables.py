"""Tables as aligned text, CSV and Markdown, and names for the entries of nested parts."""

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from io import StringIO
from typing import TYPE_CHECKING, Any

from fem_seal.errors import InvalidInput

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def leaves(parts: Mapping[str, Any], head: str = "") -> Iterator[tuple[str, Any]]:
    """Entries of nested dicts under names such as gas.mass_rate.value."""
    for name, part in parts.items():
        if isinstance(part, Mapping):
            yield from leaves(part, f"{head}{name}.")
        else:
            yield f"{head}{name}", part


def csv_text(header: Sequence[object], lines: Iterable[Sequence[object]]) -> str:
    """Write lines of cells as CSV, with all digits of a float; None is an empty cell."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(["" if cell is None else cell for cell in line] for line in lines)
    return text.getvalue()


def as_csv(rows: "Sequence[DataclassInstance]") -> str:
    """Write dataclasses of one kind, at least one, as `csv_text`; their fields are the columns.

    A field that is itself a dataclass is written by its `str`.
    """
    if not rows:
        raise InvalidInput("there is nothing to put into a table")
    names = [field.name for field in fields(rows[0])]
    return csv_text(names, ([getattr(row, name) for name in names] for row in rows))


def aligned(lines: Sequence[Sequence[str]]) -> str:
    """Align lines of cells, the header first, in columns as wide as their widest cell."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )


def as_text(rows: "Sequence[DataclassInstance]", names: Sequence[str]) -> str:
    """Align some fields of dataclasses of one kind, at least one, in columns of four digits.

    Metadata "header" of a field, such as its name with a unit, heads its column; CSV keeps the
    field's name.
    """
    headers = {cell.name: cell.metadata.get("header", cell.name) for cell in fields(rows[0])}
    return aligned(
        [
            [headers[name] for name in names],
            *([_cell(getattr(row, name)) for name in names] for row in rows),
        ]
    )


def markdown(header: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Write lines of cells as a table of a Markdown page."""
    ruled = [header, ["---"] * len(header), *lines]
    return "\n".join(f"| {' | '.join(line)} |" for line in ruled)


def _cell(value: object) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
