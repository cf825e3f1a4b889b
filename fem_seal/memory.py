"""How much memory this process has needed, and how much there is."""

import ctypes
from pathlib import Path

# Options of mallopt(3) in glibc.
_TRIM, _MMAP_THRESHOLD, _MMAP_MAX = -1, -3, -4


def peak_memory() -> int:
    """Largest resident memory of this process so far [bytes].

    getrusage would do, but its number is inherited from the process that started this one.
    """
    status = Path("/proc/self/status").read_text()
    line = next(line for line in status.splitlines() if line.startswith("VmHWM:"))
    return int(line.split()[1]) * 1024


def available_memory() -> int:
    """Memory that can still be had on this machine without swapping [bytes]."""
    lines = Path("/proc/meminfo").read_text().splitlines()
    line = next(line for line in lines if line.startswith("MemAvailable:"))
    return int(line.split()[1]) * 1024


def give_back_freed_memory() -> None:
    """Let the C library hand large freed blocks back to the system, as it does by default.

    A library that PETSc loads on Debian switches that off (mallopt), which triples the memory of
    a refinement: each mesh would leave its holes behind for the next, larger one.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:  # not in every C library
        for option, value in ((_MMAP_MAX, 65536), (_MMAP_THRESHOLD, 1 << 24), (_TRIM, 1 << 26)):
            mallopt(option, value)
