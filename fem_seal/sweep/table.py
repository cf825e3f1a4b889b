"""The table of a sweep, and the folder that keeps it whole."""

import csv
import os
from dataclasses import astuple, dataclass, fields
from io import StringIO
from pathlib import Path

from pydantic import ValidationError

from fem_seal.errors import InvalidInput
from fem_seal.results.folder import make_aside, writing
from fem_seal.results.result import Provenance, Result

TABLE_FILE, ORIGIN_FILE = "sweep.csv", "sweep.json"


@dataclass(frozen=True)
class Row:
    """The numbers of one point, in SI units; None where they do not exist."""

    state: str | None = None
    decision: str | None = None
    leak_rate: float | None = None
    lower: float | None = None
    upper: float | None = None
    contact_area_fraction: float | None = None
    mean_gap: float | None = None
    mean_pressure: float | None = None
    kkt_residual: float | None = None
    unknowns: int | None = None
    converged: bool = True
    reason: str = ""
    seconds: float | None = None
    peak_memory_bytes: int | None = None

    @classmethod
    def of(cls, result: Result) -> "Row":
        """Take the columns out of a result."""
        leak = result.leak_rate
        return cls(
            state=result.state,
            decision=result.verdict.decision if result.verdict else None,
            leak_rate=leak.value if leak else None,
            lower=leak.lower if leak else None,
            upper=leak.upper if leak else None,
            contact_area_fraction=result.contact_area_fraction,
            mean_gap=result.mean_gap,
            mean_pressure=result.mean_pressure,
            kkt_residual=result.kkt_residual,
            unknowns=result.unknowns,
            converged=result.converged,
            reason=result.reason,
            seconds=result.seconds["total"],
            peak_memory_bytes=result.peak_memory_bytes,
        )

    def cells(self) -> tuple[str, ...]:
        """Text of each column; floats in full, None as nothing."""
        return tuple("" if value is None else str(value) for value in astuple(self))


COLUMNS = tuple(field.name for field in fields(Row))


@dataclass(frozen=True)
class Table:
    """sweep.csv with its origin sweep.json: written anew and moved into place after each point.

    folder : that holds both files
    keys : of the axes, the first columns
    origin : what scene the points vary
    rows : cells by the values of the axes, as text
    """

    folder: Path
    keys: tuple[str, ...]
    origin: Provenance
    rows: dict[tuple[str, ...], tuple[str, ...]]

    @classmethod
    def opened(
        cls, folder: Path, keys: tuple[str, ...], origin: Provenance, overwrite: bool
    ) -> "Table":
        """Take up the table of a folder, or begin one.

        Parameters
        ----------
        folder : made by `write` if it is not there
        keys, origin : of the sweep to come
        overwrite : begin anew, whatever the folder holds

        Raises
        ------
        InvalidInput
            If the folder holds the table of another sweep or a damaged one, or cannot be written.
        """
        table = cls(folder, keys, origin, {})
        with writing(folder):
            make_aside(folder).rmdir()
        if overwrite or not (folder / TABLE_FILE).exists():
            return table
        try:
            before = Provenance.model_validate_json((folder / ORIGIN_FILE).read_bytes())
            with (folder / TABLE_FILE).open(newline="") as file:
                header, *lines = csv.reader(file)
        except (OSError, ValidationError, ValueError):
            raise InvalidInput(
                f"{folder} holds a damaged sweep; choose another --out, or use --overwrite"
            ) from None
        if not before.same_scene(origin) or tuple(header) != (*keys, *COLUMNS):
            raise InvalidInput(
                f"{folder} holds the sweep of another scene or of other fields; "
                "choose another --out, or replace it with --overwrite"
            )
        for line in lines:
            table.rows[tuple(line[: len(keys)])] = tuple(line[len(keys) :])
        return table

    def write(self) -> None:
        """Replace the files by what `rows` hold now.

        Raises
        ------
        InvalidInput
            If the folder cannot be written.
        """
        text = StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow((*self.keys, *COLUMNS))
        writer.writerows((*values, *cells) for values, cells in self.rows.items())
        with writing(self.folder):
            self.folder.mkdir(parents=True, exist_ok=True)
            _replace(self.folder / ORIGIN_FILE, self.origin.model_dump_json(indent=2) + "\n")
            _replace(self.folder / TABLE_FILE, text.getvalue())


def _replace(path: Path, text: str) -> None:
    """Write a file aside and move it into place, so that it is whole at every moment."""
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        aside.write_text(text, encoding="utf-8")
        os.replace(aside, path)  # noqa: PTH105 (must be atomic)
    finally:
        aside.unlink(missing_ok=True)
