"""The lock of a folder, held by one run or by any number of sweeps.

The kernel releases a flock when its process ends, for whatever reason: no lock is ever stale. Over
NFS, Linux turns it into a lock of the server. PyPI's filelock was considered: of its two shared
locks one is that of an SQLite database, the other a file that a thread renews and that counts as
stale after 90 s without.

Who holds a folder alone knows that the processes that staged a result or a point in it have ended.
So a sweep, too, first tries to hold the folder alone, removes what they left, and then takes a
shared lock. The kernel may give the folder to another process between the two locks:

* If that one still holds it alone, the shared lock is refused, and the old one is lost: the next
  trial begins from nothing.
* If it has left again, it has removed the file, and the lock is that of a file without a name,
  which keeps nobody out: `_locked` finds that out and is false.
* If it has become one of several sweeps, both hold the folder, as they may.

Nothing is written before the lock is held for good, so the other one finds nothing of this process.
"""

import errno
import fcntl
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fem_seal.errors import OTHER_FOLDER, InvalidInput
from fem_seal.files.atomic import PREFIX, writing

LOCK_FILE = ".fem-seal.lock"
POINTS, PATCHES = "points", "patches"  # folders within, whose files have the lock of this folder
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
# Seconds before each trial: others hold a folder alone while they clear it, which takes 0.2 s for
# 100 000 points on a local disk, or remove the file.
_PAUSES = 0.0, 0.05, 0.1, 0.2, 0.4, 0.8


@contextmanager
def locked_folder(folder: Path, *, shared: bool = False) -> Iterator[None]:
    """Lock a folder, make it if it is missing, and remove the staging files of killed processes.

    Folders that were made here and are still empty are removed at the end. InvalidInput says that
    another process holds the folder. A shared lock lets others hold a shared one at the same time.
    """
    folder = folder.absolute()
    path = folder / LOCK_FILE
    missing: list[Path] = []
    handle = None
    try:
        with writing(folder):
            missing += [path for path in (folder, *folder.parents) if not path.exists()]
            handle = _acquire(path, shared)
        yield
    finally:
        if handle is not None:
            _release(path, handle)
        for made in missing:
            with suppress(OSError):  # it is not empty, or could not be made
                made.rmdir()


def _acquire(path: Path, shared: bool) -> int:
    """Open and lock the file."""
    for pause in _PAUSES:
        time.sleep(pause)
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        except FileNotFoundError:
            continue  # another process has just removed the folder
        held = False
        try:
            if alone := _locked(handle, path, fcntl.LOCK_EX):
                _clear(path.parent)
            held = _locked(handle, path, fcntl.LOCK_SH) if shared else alone
        except OSError as error:
            # A file system without locks: nobody is kept out, and nothing is removed.
            held = error.errno in _NO_LOCKS
            if not held:
                raise
        finally:
            if not held:
                os.close(handle)
        if held:
            return handle
    raise InvalidInput(
        f"the folder {path.parent} is in use by another process; wait until it has ended, or "
        f"{OTHER_FOLDER}"
    )


def _locked(handle: int, path: Path, kind: int) -> bool:
    """Try to lock the open file; False if others hold it or have removed its name meanwhile."""
    with suppress(BlockingIOError, FileNotFoundError):
        fcntl.flock(handle, kind | fcntl.LOCK_NB)
        return os.path.samestat(os.fstat(handle), path.stat())
    return False


def _clear(folder: Path) -> None:
    """Remove what killed processes have staged in a folder, and in those of its points.

    Staging folders and points are made under the lock of the folder. Pictures and tables are also
    written without it: their staging files go a minute after the last change.
    """
    minute_ago = time.time() - 60
    for path in folder.glob(f"{PREFIX}*"):
        with suppress(OSError):
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            elif path.lstat().st_mtime < minute_ago:
                path.unlink()
    for within in (folder / POINTS, folder / PATCHES):
        with suppress(OSError):  # it cannot be read or written
            if not (within / LOCK_FILE).exists():
                for path in within.glob(f"{PREFIX}*"):
                    path.unlink()


def _release(path: Path, handle: int) -> None:
    """Release the lock; who holds the folder last removes the file, or anyone without locks."""
    try:
        last = _locked(handle, path, fcntl.LOCK_EX)
    except OSError as error:
        last = error.errno in _NO_LOCKS
    try:
        if last:
            path.unlink()
    except OSError:
        pass  # the file is gone, or must stay; the lock ends with its handle
    finally:
        os.close(handle)
