"""The lock of a folder, held by one run or by any number of sweeps.

The kernel releases a flock when its process ends, for whatever reason: no lock is ever stale. Over
NFS, Linux turns it into a lock of the server. PyPI's filelock was considered: of its two shared
locks one is that of an SQLite database, which names no owner for the message, the other a file that
a thread renews and that counts as stale after 90 s without. On systems without flock the owners
listed in the file serve as the lock; two processes that start at the same instant may then both
take it.
"""

import errno
import fcntl
import json
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path

from fem_seal.errors import OTHER_FOLDER, InvalidInput
from fem_seal.files.atomic import writing
from fem_seal.files.owner import Owner, clear_abandoned, this_process

LOCK_FILE = ".fem-seal.lock"
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
# Trials, and seconds between them: a process that gives up a shared lock holds it alone for the
# instant in which it removes the file.
_TRIALS, _PAUSE = 5, 0.05


@contextmanager
def locked_folder(folder: Path, *, shared: bool = False) -> Iterator[None]:
    """Lock a folder, make it if it is missing, and remove the staging files of killed runs.

    Folders that were made here and are still empty are removed at the end. InvalidInput names the
    process that holds the folder. A shared lock lets others hold a shared one at the same time.
    """
    folder = folder.absolute()
    path = folder / LOCK_FILE
    missing: list[Path] = []
    handle = None
    try:
        with writing(folder):
            missing += [path for path in (folder, *folder.parents) if not path.exists()]
            handle = _acquire(path, shared)
        clear_abandoned(folder)
        yield
    finally:
        if handle is not None:
            _release(path, handle)
        for made in missing:
            with suppress(OSError):  # it is not empty, or could not be made
                made.rmdir()


def _acquire(path: Path, shared: bool) -> int:
    """Open and lock the file, which lists its owners, one per line."""
    for trial in range(_TRIALS):
        if trial:
            time.sleep(_PAUSE)
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
        except FileNotFoundError:
            continue  # another process has just removed the folder
        held = False
        try:
            if _lock(handle, path, shared) and _is_file(handle, path):
                if not shared:
                    os.ftruncate(handle, 0)
                since = time.strftime("%Y-%m-%d %H:%M:%S %z")
                signed = {**asdict(this_process()), "since": since}
                os.write(handle, json.dumps(signed).encode() + b"\n")
                held = True
                return handle
        finally:
            if not held:
                os.close(handle)
    holders = (f"process {owner.process} on {owner.host} since {at}" for owner, at in _living(path))
    raise InvalidInput(
        f"the folder {path.parent} is in use by {next(holders, 'another process')}; wait until it "
        f"has ended, or {OTHER_FOLDER}"
    )


def _lock(handle: int, path: Path, shared: bool) -> bool:
    """Try to lock an open file; False if another process holds it."""
    try:
        fcntl.flock(handle, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
        return shared or all(owner == this_process() for owner, _ in _living(path))
    return True


def _is_file(handle: int, path: Path) -> bool:
    """Whether the open file still has its name: the last owner may have removed it meanwhile."""
    with suppress(FileNotFoundError):
        return os.path.samestat(os.fstat(handle), path.stat())
    return False


def _release(path: Path, handle: int) -> None:
    """Release the lock; the last owner removes the file."""
    try:
        if _lock(handle, path, shared=False):
            path.unlink(missing_ok=True)
    except OSError:
        pass  # the folder is gone or full; the lock ends with its handle
    finally:
        os.close(handle)


def _living(path: Path) -> list[tuple[Owner, str]]:
    """Owners that have signed the file and are not known to have ended, with their times."""
    living = []
    with suppress(OSError):
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            with suppress(ValueError, TypeError, KeyError):
                signed = json.loads(line)
                owner = Owner(str(signed["place"]), int(signed["process"]), int(signed["start"]))
                if not owner.gone():
                    living.append((owner, str(signed["since"])))
    return living
