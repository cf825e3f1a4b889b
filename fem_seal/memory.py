"""How much memory this process has needed, and how much there is."""

import ctypes
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fem_seal.errors import InvalidInput

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


def refuse_too_large(size: float, what: str, available: float | None = None) -> None:
    """Refuse what a file wants to have read before the memory for it is asked for.

    Parameters
    ----------
    size : memory that reading takes [bytes]
    what : is to be read, for the message
    available : memory there is [bytes]; that of the machine if left out

    Raises
    ------
    InvalidInput
        If there is less memory than that.
    """
    available = available_memory() if available is None else available
    if size > available:
        raise InvalidInput(
            f"{what} would take {size / 1e9:.3g} GB of memory, and {available / 1e9:.3g} GB are "
            "available; crop or resample it"
        )


@contextmanager
def within_available_memory(what: str) -> Iterator[None]:
    """Let nothing in the body take more memory than is available when it starts.

    For libraries that believe the sizes a file declares: a larger allocation fails there, and not
    when the machine has run out of memory.

    Raises
    ------
    InvalidInput
        If that happened; `what` is named.
    """
    before, hardest = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + available_memory()
    ceilings = [n for n in (before, hardest) if n != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_AS, (min([limit, *ceilings]), hardest))
    try:
        yield
    except MemoryError:
        raise InvalidInput(
            f"reading {what} would take more memory than is available; crop or resample it"
        ) from None
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (before, hardest))


def give_back_freed_memory() -> None:
    """Let the C library hand large freed blocks back to the system, as it does by default.

    A library that PETSc loads on Debian switches that off (mallopt), which triples the memory of
    a refinement: each mesh would leave its holes behind for the next, larger one.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:  # not in every C library
        for option, value in ((_MMAP_MAX, 65536), (_MMAP_THRESHOLD, 1 << 24), (_TRIM, 1 << 26)):
            mallopt(option, value)
