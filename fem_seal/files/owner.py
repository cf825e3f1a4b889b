"""The process that owns a staging file or a lock, and whether it still runs."""

import os
import re
import secrets
import shutil
import socket
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

PREFIX = ".fem-seal-"
# prefix, host and namespace, process, start, random part with the suffix of the final file.
_NAME = re.compile(rf"{re.escape(PREFIX)}(.+)-(\d+)-(\d+)-[0-9a-f]+(\.\w+)?")


@dataclass(frozen=True)
class Owner:
    """A process, distinguished from any later process of the same number."""

    #: host name and process namespace; each container of a host counts its processes separately
    place: str
    process: int  #: number of the process
    #: clock ticks between the start of the machine and that of the process; 0 if the system does
    #: not tell
    start: int

    def gone(self) -> bool:
        """Whether the process has ended; False on another host, where that is not known."""
        if self.place != _place():
            return False
        try:
            os.kill(self.process, 0)
        except ProcessLookupError:
            return True
        except PermissionError:
            pass  # another user's process
        return self.start != 0 and _start_of(self.process) not in (0, self.start)

    @property
    def host(self) -> str:
        """Host name."""
        return self.place.rpartition("+")[0]


def this_process() -> Owner:
    """The present process as an owner of staging files."""
    return Owner(_place(), os.getpid(), max(_start_of(os.getpid()), 0))


@cache
def _place() -> str:
    try:
        namespace = Path("/proc/self/ns/pid").stat().st_ino
    except OSError:
        namespace = 0  # a system without process namespaces
    return f"{re.sub('[^A-Za-z0-9.-]', '_', socket.gethostname())}+{namespace}"


def _start_of(process: int) -> int:
    """Start of a running process; 0 if the system does not tell, -1 if it is a zombie."""
    try:
        text = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return 0
    # The second field is the program's name in brackets, which may hold spaces and brackets.
    fields = text.rpartition(")")[2].split()
    return -1 if fields[0] in ("Z", "X") else int(fields[19])


def staging_name(suffix: str = "") -> str:
    """A new name for a staging file or folder of this process."""
    owner = this_process()
    token = secrets.token_hex(4)
    return f"{PREFIX}{owner.place}-{owner.process}-{owner.start}-{token}{suffix}"


def clear_abandoned(folder: Path) -> None:
    """Remove the staging files that ended processes of this host and user left in a folder."""
    try:
        names = [entry.name for entry in os.scandir(folder) if entry.name.startswith(PREFIX)]
    except OSError:
        return  # no such folder, hence nothing to clear
    for name in names:
        match = _NAME.fullmatch(name)
        if not match or not Owner(match[1], int(match[2]), int(match[3])).gone():
            continue
        path = folder / name
        with suppress(OSError):
            if path.lstat().st_uid != os.getuid():
                continue  # another user's file in a shared temporary folder
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            with suppress(OSError):
                path.unlink(missing_ok=True)
