"""The folder of a sweep: a file for each finished point, and the table of these points."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from pydantic import ValidationError

from fem_seal.errors import OR_OVERWRITE, InvalidInput
from fem_seal.files import POINTS, create_text, write_text, writing
from fem_seal.points import PointFolder
from fem_seal.results.result import Provenance
from fem_seal.sweep.point import COLUMNS, Point
from fem_seal.sweep.summary import SUMMARY_FILE, write_summary
from fem_seal.tables import csv_text

TABLE_FILE, ORIGIN_FILE = "sweep.csv", "sweep.json"
_POINT_FILE = re.compile(r"[0-9a-f]{32}\.json")


class SweepFolder(PointFolder[Point]):
    """The points of one sweep; any number of processes may write into the folder at once.

    The `keys` are the names of the fields that vary.
    """

    def __init__(self, path: Path, keys: tuple[str, ...]):
        super().__init__(path / POINTS, Point)
        self.path = path
        self.keys = keys

    def open(self, origin: Provenance) -> None:
        """Begin a sweep, or go on with one, from the scene that all points share."""
        path = self.path / ORIGIN_FILE
        if not path.exists() and (self.path / TABLE_FILE).exists():
            raise InvalidInput(
                f"{self.path} holds a {TABLE_FILE} without {ORIGIN_FILE}; {OR_OVERWRITE}"
            )
        origin = origin.model_copy(update={"scene": {**origin.scene, "vary": list(self.keys)}})
        if not path.exists():
            create_text(path, origin.model_dump_json(indent=2) + "\n")
        try:
            before = Provenance.model_validate_json(path.read_bytes())
        except (OSError, ValidationError):
            raise InvalidInput(f"{self.path} holds a damaged sweep; {OR_OVERWRITE}") from None
        if not before.same_scene(origin):
            raise InvalidInput(
                f"{self.path} holds the sweep of another scene or of other fields; {OR_OVERWRITE}"
            )

    def clear(self) -> None:
        """Remove a sweep; other files stay."""
        with writing(self.path):
            for name in (TABLE_FILE, SUMMARY_FILE, ORIGIN_FILE):
                (self.path / name).unlink(missing_ok=True)
            for name in self._names():
                self.path_of(name).unlink(missing_ok=True)

    def finished(self, name: str) -> bool:
        """Whether a point has a result, or a failure that need not be tried again."""
        point = self.point(name)
        return point is not None and not point.again

    def gather(self, first: Mapping[str, tuple[str, ...]]) -> list[Point]:
        """Write the table of all finished points and its summary, and return them.

        The table begins with the points named `first`, which have the values given with their
        names: an earlier sweep may have written 100 kPa for 0.1 MPa. Then come the points of other
        sweeps in the folder, the newest first, and only one for equal values.
        """
        before: set[str] | None = None
        rows: list[Point] = []
        # Repeat until no other process has added a point meanwhile: the table then misses none.
        while (names := self._names()) != before:
            before = names
            asked = [replace(p, values=first[name]) for name in first if (p := self.point(name))]
            others = [self.point(name) for name in names.difference(first)]
            newest = sorted(filter(None, others), key=lambda point: point.finished, reverse=True)
            kept: dict[tuple[str, ...], Point] = {}
            for point in (*asked, *newest):
                kept.setdefault(point.values, point)
            rows = list(kept.values())
            write_text(self.path / TABLE_FILE, self._table(rows), durable=False)
            write_summary(self.keys, rows, self.path)
        return rows

    def _names(self) -> set[str]:
        if not self.folder.is_dir():
            return set()
        files = (path.name for path in self.folder.iterdir())
        return {name.removesuffix(".json") for name in files if _POINT_FILE.fullmatch(name)}

    def _table(self, points: list[Point]) -> str:
        rows = [point.row for point in points]
        columns = dict.fromkeys([*COLUMNS, *(column for row in rows for column in row)])
        lines = ((*p.values, *map(row.get, columns)) for p, row in zip(points, rows, strict=True))
        return csv_text((*self.keys, *columns), lines)
