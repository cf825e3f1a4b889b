"""Points of a study, each in a file of its own, so that no point is computed twice."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Generic, TypeVar

from pydantic import TypeAdapter, ValidationError

from fem_seal.errors import InvalidInput
from fem_seal.files import write_text
from fem_seal.tables import as_csv

Point = TypeVar("Point")


def write_json(path: Path, record: object) -> None:
    """Write a dataclass, or nested containers of them, as JSON."""
    adapter = TypeAdapter(type(record))
    write_text(path, adapter.dump_json(record, indent=1).decode() + "\n")


def write_table(path: Path, rows: Sequence[object]) -> None:
    """Write flat dataclasses of one type as CSV, None as an empty cell."""
    write_text(path, as_csv(rows))


class PointStore(Generic[Point]):
    """Points of one kind in a folder, one JSON each.

    Parameters
    ----------
    folder : made when the first point is written
    kind : dataclass of the points
    """

    def __init__(self, folder: Path, kind: type[Point]):
        self.folder = folder
        self._points = TypeAdapter(kind)

    def point(
        self, name: str, compute: Callable[[], Point], same: Callable[[Point], bool]
    ) -> Point:
        """Read a point, or compute and write it.

        Parameters
        ----------
        name : of the file, without suffix
        compute : called if the folder does not hold the point
        same : whether a stored point has the settings of this run

        Raises
        ------
        InvalidInput
            If the file is damaged or has other settings, or the folder cannot be written.
        """
        path = self.folder / f"{name}.json"
        if not path.exists():
            point = compute()
            write_text(path, self._points.dump_json(point, indent=1).decode() + "\n")
            return point
        try:
            point = self._points.validate_json(path.read_bytes())
        except ValidationError:
            raise InvalidInput(f"{path} is no point of this study; remove it") from None
        if not same(point):
            raise InvalidInput(f"{path} was computed with other settings; choose another --out")
        return point

    def there(self, pattern: str) -> list[Point]:
        """Points of the folder, by this process or others, whose names match a glob.

        Files that cannot be read are left out; `point` raises InvalidInput for them.
        """
        points = []
        for path in sorted(self.folder.glob(f"{pattern}.json")):
            with suppress(ValidationError):
                points.append(self._points.validate_json(path.read_bytes()))
        return points
