"""Files appear whole or not at all: written beside their place and then renamed."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fem_seal.errors import InvalidInput


@contextmanager
def written_aside(path: str | Path) -> Iterator[Path]:
    """Give a temporary path in the same folder; rename it to `path` if the body succeeds.

    Raises
    ------
    InvalidInput
        If the folder does not exist or cannot be written to.
    """
    path = Path(path)
    if not path.parent.is_dir() or not os.access(path.parent, os.W_OK):
        raise InvalidInput(f"cannot write {path}: {path.parent} is not a folder one can write to")
    # The suffix stays last, by which the writers choose the format.
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
