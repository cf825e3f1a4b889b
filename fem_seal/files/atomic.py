"""Writing a file completely or not at all, and the checksum of one."""

import os
import secrets
import shutil
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import file_digest, sha256
from pathlib import Path

from fem_seal.errors import InvalidInput

PREFIX = ".fem-seal-"  # of the names of staging files


@contextmanager
def writing(path: Path, what: str = "the output folder") -> Iterator[None]:
    """Turn an error of the disk into an InvalidInput that names the file or folder."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error) or type(error).__name__
        # Name the file if it lies elsewhere, such as in a full temporary folder.
        file, parent = error.filename, path.absolute().parent
        below = not isinstance(file, str) or Path(file).absolute().is_relative_to(parent)
        place = "" if below else f" ({file})"
        # Show the final folder in place of the staging folder.
        shown = Path(*(part for part in path.parts if not part.startswith(PREFIX)))
        raise InvalidInput(f"{what} {shown} cannot be written: {reason}{place}") from None


@contextmanager
def atomic_write(path: str | Path, *, durable: bool = True) -> Iterator[Path]:
    """Yield a staging path in the folder of `path`; rename it to `path` if the body succeeds.

    It has the suffix of the path, by which writers choose the format. A durable file is flushed to
    the disk before: after a power cut the old or the new file is there. Tables and pictures do not
    need this, since they can be made again.
    """
    path = Path(path)
    if not path.parent.is_dir() or not os.access(path.parent, os.W_OK):
        raise InvalidInput(f"cannot write {path}: {path.parent} is not a folder one can write to")
    staged = path.with_name(f"{PREFIX}{secrets.token_hex(8)}{path.suffix}")
    with writing(path, "the file"):
        try:
            yield staged
            if durable:
                to_disk(staged)
            os.replace(staged, path)  # noqa: PTH105 (must be atomic)
            if durable:
                to_disk(path.parent)
        finally:
            with suppress(OSError):
                staged.unlink(missing_ok=True)


def write_text(path: Path, text: str, *, durable: bool = True) -> None:
    """Write a file as `atomic_write` does; create its folder if it is missing."""
    with writing(path.parent):
        path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path, durable=durable) as staged:
        staged.write_text(text, encoding="utf-8")


def create_text(path: Path, text: str) -> None:
    """Write a file unless it exists; if several processes try at once, one of them succeeds."""
    with staging_folder(path.parent) as folder, writing(path, "the file"):
        staged = folder / path.name
        write_text(staged, text)
        try:
            path.hardlink_to(staged)
        except FileExistsError:
            return
        except OSError:
            # No hard links here: of two that try at the same instant, the last one replaces it.
            if not path.exists():
                os.replace(staged, path)  # noqa: PTH105 (must be atomic)
        to_disk(path.parent)


def write_npz(path: Path, arrays: Mapping[str, object], *, compressed: bool = False) -> None:
    """Write arrays as `numpy.savez` does, but without its traceback if the disk is full."""
    import numpy as np

    kind = zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED
    # `with` closes the archive after an error; savez leaves that to the garbage collector, which
    # prints the traceback.
    with zipfile.ZipFile(path, "w", kind) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.asanyarray(array), allow_pickle=False)


@contextmanager
def staging_folder(folder: Path) -> Iterator[Path]:
    """Make a temporary folder inside `folder`, so that moving files into `folder` is a rename."""
    with writing(folder):
        staged = Path(tempfile.mkdtemp(prefix=PREFIX, dir=folder))
    try:
        yield staged
    finally:
        shutil.rmtree(staged, ignore_errors=True)


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Make a temporary folder; if the body cannot write, the message is about that folder."""
    parent = Path(tempfile.gettempdir())
    with (
        writing(parent, "the temporary folder (TMPDIR names another)"),
        tempfile.TemporaryDirectory(prefix="fem-seal-", ignore_cleanup_errors=True) as folder,
    ):
        yield Path(folder)


def names_in(folder: Path) -> tuple[str, ...]:
    """Names of the files of a folder, in the order of the alphabet."""
    return tuple(sorted(path.name for path in folder.iterdir()))


def to_disk(path: Path) -> None:
    """Flush a file, or the entries of a folder, to the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError:
        # A file system that cannot flush folders (some network ones) is no reason to fail.
        if not path.is_dir():
            raise
    finally:
        os.close(handle)


@cache
def digest_of_sources(package: Path = Path(__file__).parents[1]) -> str:
    """SHA-256 of the sources of fem_seal: numbers may change between commits of one version."""
    sources = sorted(package.rglob("*.py"))
    return sha256("".join(map(digest, sources)).encode()).hexdigest()


def digest(path: Path) -> str:
    """SHA-256 of the content of a file."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()
