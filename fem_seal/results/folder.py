"""The result folder: written as a whole, and never over another scene's result by accident."""

import os
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path

from fem_seal.errors import OR_OVERWRITE, OTHER_FOLDER, FemSealError, InvalidInput
from fem_seal.files import PATCHES, locked_folder, staging_folder, to_disk, writing
from fem_seal.results.arrays import CONTACT_FILE, FLOW_FILE
from fem_seal.results.result import RESULT_FILE, Provenance, Result

# Folder with the staged files of a finished run, which are moved out of it one by one. If a run is
# killed meanwhile, the next run moves the rest.
MOVING = ".fem-seal.moving"
_OLD_RESULT = "replaced-result.json"


class ResultFolder:
    """The folder of a result while it is written: files are staged, and `commit` moves them in.

    Use it in a `with` statement, which keeps other runs out of the folder. Without `commit`, after
    an error or Ctrl-C, the folder stays as it was.

    Parameters
    ----------
    path
        The folder; it and its parents are made if they are missing.
    provenance
        Provenance of the new result.
    overwrite
        Whether another scene's result, or files of unknown origin, may be replaced.
    names
        Names of the files that the run may write, beside result.json.
    """

    staged: Path  #: folder to write the files into; it exists inside the `with` statement only

    def __init__(
        self,
        path: str | Path,
        provenance: Provenance,
        overwrite: bool = False,
        names: Iterable[str] = (),
    ):
        self.path = Path(path).absolute()
        self.provenance = provenance
        self._overwrite = overwrite
        self._names = frozenset(names)
        self._open = ExitStack()

    def __enter__(self) -> "ResultFolder":
        """Lock the folder and finish the moves of a killed run.

        InvalidInput is raised if the folder cannot be written, is in use, holds another scene's
        result or files of unknown origin, or if the run would replace its own input.
        """
        with writing(self.path):
            if self.path.exists() and not self.path.is_dir():
                raise InvalidInput(f"the output folder {self.path} is a file; {OTHER_FOLDER}")
        with ExitStack() as opening:
            opening.enter_context(locked_folder(self.path))
            with writing(self.path):
                self._move_in()
            self._refuse_to_replace()
            self.staged = opening.enter_context(staging_folder(self.path))
            self._open = opening.pop_all()
        return self

    def __exit__(self, *error: object) -> None:
        with self._open, writing(self.path):
            self._move_in()  # needed if an interrupt has stopped `commit`

    def commit(self, result: Result) -> None:
        """Move the staged files into the folder; they replace the files of the last result.

        The result names all files of the folder: the staged ones, and old ones that stay.
        """
        with writing(self.path):
            (self.staged / RESULT_FILE).write_text(result.to_json(), encoding="utf-8")
            for path in self.staged.iterdir():
                to_disk(path)
            # After this rename the new result is complete: this run or the next one moves it in.
            self.staged.rename(self.path / MOVING)
            self._move_in()

    def _move_in(self) -> None:
        """Move files from the folder MOVING, where there is one; result.json goes last.

        A run may be killed between any two steps: each step can be repeated.
        """
        moving = self.path / MOVING
        if not moving.is_dir():
            return
        new, old = moving / RESULT_FILE, moving / _OLD_RESULT
        if new.exists():
            if (self.path / RESULT_FILE).exists() and not old.exists():
                os.replace(self.path / RESULT_FILE, old)  # noqa: PTH105 (must be atomic)
            for name in set(_files_of(old)).difference(_files_of(new)):
                (self.path / name).unlink(missing_ok=True)
            for path in moving.iterdir():
                if path not in (new, old):
                    os.replace(path, self.path / path.name)  # noqa: PTH105
            os.replace(new, self.path / RESULT_FILE)  # noqa: PTH105
            to_disk(self.path)
        old.unlink(missing_ok=True)
        moving.rmdir()

    def _refuse_to_replace(self) -> None:
        has_result = (self.path / RESULT_FILE).exists()
        replaced = {*self._names, *(_files_of(self.path / RESULT_FILE) if has_result else ())}
        for name in self.provenance.inputs:
            path = Path(name).absolute()
            if path.parent == self.path and path.name in replaced:
                raise InvalidInput(
                    f"the input {path} lies in the output folder and would be replaced; "
                    f"{OTHER_FOLDER}"
                )
        if self._overwrite:
            return
        if has_result:
            if holds_another_scene(self.path, self.provenance):
                solved = (self.path / PATCHES).is_dir()
                kept = "; patches of the seal that fit are kept" if solved else ""
                raise InvalidInput(
                    f"{self.path} holds the result of another scene; {OR_OVERWRITE}{kept}"
                )
            return
        # Pictures and a mesh without a result come from `fem-seal mesh`, and may be replaced.
        for name in self._names.intersection((CONTACT_FILE, FLOW_FILE)):
            if (self.path / name).exists():
                raise InvalidInput(
                    f"{self.path} holds a file {name} that belongs to no result; {OR_OVERWRITE}"
                )


def holds_another_scene(folder: Path, provenance: Provenance) -> bool:
    """Whether a folder holds the result of another scene than that of a provenance."""
    if not (folder / RESULT_FILE).exists():
        return False
    return not Result.from_folder(folder).provenance.same_scene(provenance)


def _files_of(result: Path) -> tuple[str, ...]:
    """Names of the files that a result names, not of those that a user has put beside them."""
    if not result.exists():
        return ()
    try:
        return Result.model_validate_json(result.read_bytes()).files
    except (ValueError, FemSealError):
        return ()  # a damaged result is overwritten: the names of its files are unknown
