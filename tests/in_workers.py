"""What workers compute in tests: they start at once, for nothing heavy is imported here."""

import os
import signal
import time
from pathlib import Path
from threading import Timer

from fem_seal.errors import InvalidInput

MB = 1_000_000


def answer(last):
    """End the process a moment after its answer, if that is to be the last one."""
    if last:
        Timer(0.1, os.kill, (os.getpid(), signal.SIGKILL)).start()
    return last


def stay(path):
    Path(path).write_text(str(os.getpid()))
    time.sleep(60)


def no_answer(path):
    raise ZeroDivisionError(path)


def fine():
    return 1


def fail():
    raise InvalidInput("an error of its own")


def exhaust():
    raise MemoryError("8 TB")


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def keep_and_die(path):
    """End as a process does that is killed once it has written its point."""
    path.parent.mkdir(exist_ok=True)
    path.write_text("1")
    die()


def meet(folder):
    """Wait until another process has come, at most 20 s; whether one has."""
    Path(folder, str(os.getpid())).touch()
    end = time.monotonic() + 20
    while len(list(Path(folder).iterdir())) < 2 and time.monotonic() < end:
        time.sleep(0.05)
    return len(list(Path(folder).iterdir())) == 2


def hold_memory(folder):
    """Hold 300 MB for a moment, and write down when; an item for `farm`."""
    start = time.monotonic()
    held = b"1" * (300 * MB)
    time.sleep(0.7)
    path = Path(folder) / f"{start}"
    path.write_text(f"{start} {time.monotonic()} {held[-1]}")


def ended_elsewhere(process, how):
    """The process; any other one ends."""
    if os.getpid() != process:
        if how == "no memory":
            raise MemoryError
        os.kill(os.getpid(), signal.SIGKILL)
    return process
