"""The result folder: whole or not there, and never another scene's by accident."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

from fem_seal.errors import InvalidInput
from fem_seal.results.result import RESULT_FILE, Provenance, Result


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn what the disk refuses into an InvalidInput that names the folder."""
    try:
        yield
    except OSError as error:
        raise InvalidInput(
            f"the output folder {path} cannot be written: {error.strerror}"
        ) from None


def make_aside(path: Path) -> Path:
    """Make a temporary folder for what will move into `path`.

    It lies on the same disk, so that moving is one step, and in a folder that is there already,
    so that a failed run does not even leave an empty one.
    """
    path = path.absolute()
    ancestor = next(folder for folder in (path, *path.parents) if folder.exists())
    return Path(tempfile.mkdtemp(prefix=".fem-seal-", dir=ancestor))


class ResultFolder:
    """A folder being filled: everything is written aside and moved in by `commit`.

    Use it in a `with` statement; leaving without `commit`, by an error or Ctrl-C, leaves
    nothing behind.

    Parameters
    ----------
    path : the folder; it and its parents are made by `commit`
    provenance : of the result to come
    overwrite : whether another scene's result may be replaced

    Raises
    ------
    InvalidInput
        If the folder cannot be written or holds another scene's result.
    """

    def __init__(self, path: str | Path, provenance: Provenance, overwrite: bool = False):
        self.path = Path(path).absolute()
        with writing(self.path):
            self._refuse_other_scene(provenance, overwrite)
            self.aside = make_aside(self.path)

    def __enter__(self) -> "ResultFolder":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        shutil.rmtree(self.aside, ignore_errors=True)

    def commit(self, result: Result) -> None:
        """Replace what the folder held by the new result.

        Parameters
        ----------
        result : its `files` are in `aside` already

        Raises
        ------
        InvalidInput
            If the folder cannot be written after all.
        """
        self._move_in(result.files, result, replaced=self._old_files())

    def add(self, names: tuple[str, ...], result: Result) -> None:
        """Put more files beside those that are there.

        Parameters
        ----------
        names : of the new files, in `aside` already
        result : that names all files, old and new
        """
        self._move_in(names, result, replaced=())

    def _move_in(self, names: tuple[str, ...], result: Result, replaced: tuple[str, ...]) -> None:
        """Move files in; result.json goes last and marks the folder as whole."""
        with writing(self.path):
            (self.aside / RESULT_FILE).write_text(result.to_json(), encoding="utf-8")
            self.path.mkdir(parents=True, exist_ok=True)
            (self.path / RESULT_FILE).unlink(missing_ok=True)
            for name in replaced:
                (self.path / name).unlink(missing_ok=True)
            for name in (*names, RESULT_FILE):
                os.replace(self.aside / name, self.path / name)  # noqa: PTH105 (must be atomic)

    def _refuse_other_scene(self, provenance: Provenance, overwrite: bool) -> None:
        if self.path.exists() and not self.path.is_dir():
            raise InvalidInput(f"the output folder {self.path} is a file; choose another --out")
        if overwrite or not (self.path / RESULT_FILE).exists():
            return
        if not Result.from_folder(self.path).provenance.same_scene(provenance):
            raise InvalidInput(
                f"{self.path} holds the result of another scene; "
                "choose another --out, or replace it with --overwrite"
            )

    def _old_files(self) -> tuple[str, ...]:
        """List what the last run left; what a user has put beside it stays."""
        if not (self.path / RESULT_FILE).exists():
            return ()
        try:
            return Result.from_folder(self.path).files
        except InvalidInput:
            return ()  # --overwrite of a damaged result: its other files are not known to be ours
