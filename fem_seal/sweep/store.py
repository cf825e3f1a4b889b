"""The folder of a sweep: a file for each finished point, and the table of all that are there."""

import re
from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from fem_seal.errors import InvalidInput
from fem_seal.files import create_text, write_text, writing
from fem_seal.results.result import Provenance
from fem_seal.sweep.point import COLUMNS, Point
from fem_seal.tables import csv_text

TABLE_FILE, ORIGIN_FILE, POINTS = "sweep.csv", "sweep.json", "points"
_POINT_FILE = re.compile(r"[0-9a-f]{32}\.json")


class SweepFolder:
    """The points of one sweep; any number of processes may write into the folder at once.

    Parameters
    ----------
    path : the folder
    keys : of the axes
    """

    def __init__(self, path: Path, keys: tuple[str, ...]):
        self.path = path
        self.keys = keys
        self._points = path / POINTS
        # By name; a point never changes once it is there, unless it is to be tried again.
        self._read: dict[str, Point] = {}

    def open(self, origin: Provenance) -> None:
        """Begin a sweep, or go on with one.

        Parameters
        ----------
        origin : the scene that all points share

        Raises
        ------
        InvalidInput
            If the folder holds another sweep or a damaged one, or cannot be written.
        """
        path = self.path / ORIGIN_FILE
        if not path.exists() and (self.path / TABLE_FILE).exists():
            raise InvalidInput(
                f"{self.path} holds a {TABLE_FILE} without {ORIGIN_FILE}; choose another --out, "
                "or use --overwrite"
            )
        origin = origin.model_copy(update={"scene": {**origin.scene, "vary": list(self.keys)}})
        create_text(path, origin.model_dump_json(indent=2) + "\n")
        try:
            before = Provenance.model_validate_json(path.read_bytes())
        except (OSError, ValidationError):
            raise InvalidInput(
                f"{self.path} holds a damaged sweep; choose another --out, or use --overwrite"
            ) from None
        if not before.same_scene(origin):
            raise InvalidInput(
                f"{self.path} holds the sweep of another scene or of other fields; "
                "choose another --out, or replace it with --overwrite"
            )

    def clear(self) -> None:
        """Remove a sweep; other files stay."""
        with writing(self.path):
            for name in (TABLE_FILE, ORIGIN_FILE):
                (self.path / name).unlink(missing_ok=True)
            for name in self._names():
                (self._points / f"{name}.json").unlink(missing_ok=True)

    def point(self, name: str) -> Point | None:
        """Read a point that need not be computed; None if there is none, or it is damaged."""
        point = self._point(name)
        return None if point is None or point.again else point

    def there(self, name: str) -> bool:
        """Whether there is a point, even one to be tried again."""
        return self._point(name) is not None

    def write(self, name: str, point: Point) -> None:
        """Keep a point."""
        write_text(self._points / f"{name}.json", point.to_json())

    def gather(self, first: Sequence[str] = ()) -> list[Point]:
        """Write the table of all points that are there.

        Parameters
        ----------
        first : names of the points in the order in which they begin the table; the points of
            other sweeps into the folder follow, the newest first, and one of each values

        Returns
        -------
        Points of the table.
        """
        before: set[str] | None = None
        rows: list[Point] = []
        # Repeated until nothing has come meanwhile: the last table then misses no finished point.
        while (names := self._names()) != before:
            before = names
            asked = [point for point in map(self._point, first) if point is not None]
            others = [self._point(name) for name in names.difference(first)]
            newest = sorted(filter(None, others), key=lambda point: point.finished, reverse=True)
            kept: dict[tuple[str, ...], Point] = {}
            for point in (*asked, *newest):
                kept.setdefault(point.values, point)
            rows = list(kept.values())
            write_text(self.path / TABLE_FILE, self._table(rows), durable=False)
        return rows

    def _names(self) -> set[str]:
        if not self._points.is_dir():
            return set()
        files = (path.name for path in self._points.iterdir())
        return {name.removesuffix(".json") for name in files if _POINT_FILE.fullmatch(name)}

    def _point(self, name: str) -> Point | None:
        if name not in self._read:
            try:
                point = Point.from_json((self._points / f"{name}.json").read_text("utf-8"))
            except (OSError, ValueError):
                return None
            if len(point.values) != len(self.keys):
                return None
            if point.again:
                return point
            self._read[name] = point
        return self._read[name]

    def _table(self, rows: list[Point]) -> str:
        columns = dict.fromkeys(COLUMNS)
        for row in rows:
            columns.update(dict.fromkeys(row.numbers))
        lines = ((*row.values, *map(row.numbers.get, columns)) for row in rows)
        return csv_text((*self.keys, *columns), lines)
