"""A folder with a file for each finished point; any number of processes may write into it."""

from functools import cache
from pathlib import Path
from typing import Annotated, Generic, TypeVar

import numpy as np
from pydantic import AfterValidator, GetPydanticSchema, PlainSerializer, TypeAdapter

from fem_seal.errors import InvalidInput
from fem_seal.files import write_text

T = TypeVar("T")

# An array of a point, which its file holds as a list of numbers.
_Listed = Annotated[tuple[float, ...], AfterValidator(np.array), PlainSerializer(np.ndarray.tolist)]
Numbers = Annotated[np.ndarray, GetPydanticSchema(lambda _, schema_of: schema_of(_Listed))]

_json_of = cache(TypeAdapter)  # building one takes as long as reading many points


class PointFolder(Generic[T]):
    """Points of one kind, such as a dataclass, each as JSON in a file of its own.

    The folder is made when the first point is written.
    """

    def __init__(self, folder: Path, kind: type[T]):
        self.folder = folder
        self.kind: type = kind

    def path_of(self, name: str) -> Path:
        """Path of the file of a point."""
        return self.folder / f"{name}.json"

    def load(self, name: str) -> T:
        """Read a point; OSError if it cannot be read, ValueError if its file holds none."""
        point: T = _json_of(self.kind).validate_json(self.path_of(name).read_bytes())
        return point

    def save(self, name: str, point: T) -> None:
        """Write a file that appears whole or not at all; InvalidInput if it cannot be written."""
        text = _json_of(self.kind).dump_json(point, indent=1).decode()
        write_text(self.path_of(name), text + "\n")

    def point(self, name: str) -> T | None:
        """Read a point; None if there is none or its file is damaged.

        OSError if the system cannot read the file: the point may be there.
        """
        try:
            return self.load(name)
        except (FileNotFoundError, ValueError, InvalidInput):
            return None

    def finished(self, name: str) -> bool:
        """Whether a point need not be computed any more."""
        return self.point(name) is not None
