"""Records and tables of a study, as files."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import TypeAdapter

from fem_seal.files import write_text
from fem_seal.tables import as_csv

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def write_json(path: Path, record: object) -> None:
    """Write a dataclass, or nested containers of them, as JSON."""
    adapter = TypeAdapter(type(record))
    write_text(path, adapter.dump_json(record, indent=1).decode() + "\n")


def write_table(path: Path, rows: "Sequence[DataclassInstance]") -> None:
    """Write flat dataclasses of one type as CSV, None as an empty cell."""
    write_text(path, as_csv(rows))
