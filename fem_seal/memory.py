"""Memory: the need of this process, the memory available to it, and slices of large arrays."""

import ctypes
import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fem_seal.errors import InvalidInput

# Options of mallopt(3) in glibc.
_TRIM, _MMAP_THRESHOLD, _MMAP_MAX = -1, -3, -4


def peak_memory() -> int:
    """Largest resident memory of this process so far [bytes].

    On Linux getrusage would include the peak of the process that started this one; on macOS, which
    has no /proc, it counts bytes.
    """
    own = memory_of(os.getpid())
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss if own is None else own.peak


@dataclass(frozen=True)
class ProcessMemory:
    """Memory of a process."""

    resident: int  #: resident memory now [bytes]
    peak: int  #: its peak [bytes]


def memory_of(process: int) -> ProcessMemory | None:
    """Memory of a process of this machine; None if it has ended, or there is no /proc."""
    try:
        lines = Path(f"/proc/{process}/status").read_text().splitlines()
    except OSError:
        return None
    sizes = {line.split()[0]: int(line.split()[1]) * 1024 for line in lines if line[:2] == "Vm"}
    # A zombie process has no memory any more.
    if "VmRSS:" not in sizes:
        return None
    return ProcessMemory(sizes["VmRSS:"], sizes["VmHWM:"])


def available_memory(root: Path = Path("/")) -> int:
    """Memory that this process can still have without swapping [bytes].

    It is the smallest of the free memory of the machine and what each memory limit of the
    process's control groups (version 1 and 2) leaves. Containers and batch systems such as Slurm
    set such limits. Where there is no /proc, as on macOS, it is all memory of the machine. The
    folder `root` holds proc and sys.
    """
    if not (root / "proc/meminfo").is_file():
        return os.sysconf("SC_PHYS_PAGES") * resource.getpagesize()
    lines = (root / "proc/meminfo").read_text().splitlines()
    line = next(line for line in lines if line.startswith("MemAvailable:"))
    return max(0, min([int(line.split()[1]) * 1024, *_left_of_limits(root)]))


def _left_of_limits(root: Path) -> Iterator[int]:
    """Remaining memory [bytes] under each limit of the control groups of this process."""
    groups = root / "proc/self/cgroup"
    for line in groups.read_text().splitlines() if groups.is_file() else []:
        # Version 2 is the line 0::PATH, version 1 has a line N:CONTROLLERS:PATH for memory.
        _, controllers, path = line.split(":", 2)
        if not controllers:
            mount, names = root / "sys/fs/cgroup", ("memory.max", "memory.current")
        elif "memory" in controllers.split(","):
            mount = root / "sys/fs/cgroup/memory"
            names = ("memory.limit_in_bytes", "memory.usage_in_bytes")
        else:
            continue
        group = mount / path.lstrip("/")
        # The limits of parents hold as well. In a container the path may be the host's; then only
        # the mount point exists.
        for folder in (group, *group.parents):
            limit, used = (_number(folder / name) for name in names)
            if limit is not None and used is not None:
                yield limit - used + _file_cache(folder / "memory.stat")
            if folder == mount:
                break


def _number(path: Path) -> int | None:
    """The number in a file; None if there is no such file, or it contains "max"."""
    try:
        text = path.read_text().strip()
    except OSError:
        return None
    return int(text) if text.isdigit() else None


def _file_cache(statistics: Path) -> int:
    """Inactive file pages [bytes]: a control group counts them as used but frees them on demand."""
    try:
        rows = dict(line.split() for line in statistics.read_text().splitlines())
    except OSError:
        return 0
    # In version 1 the entry without "total_" leaves out the groups below.
    return int(rows.get("total_inactive_file", rows.get("inactive_file", 0)))


def refuse_too_large(size: float, what: str, limit: float | None = None) -> None:
    """Refuse to make data, called `what`, of a size [bytes] above a limit [bytes].

    The limit is flow.max_memory; without it, `available_memory()`.
    """
    most = available_memory() if limit is None else limit
    if size > most:
        whose = "are available" if limit is None else "are all that flow.max_memory allows"
        raise InvalidInput(
            f"{what} would take {size / 1e9:.3g} GB of memory, and {most / 1e9:.3g} GB {whose}; "
            "take fewer samples (of a map: crop it)"
        )


@contextmanager
def within_available_memory(what: str) -> Iterator[None]:
    """Limit the memory of the body to what is available when it starts.

    numpy and the libraries of formats allocate whatever size a file declares. Under the limit such
    an allocation fails at once; without it the machine would run out of memory.
    """
    statistics = Path("/proc/self/statm")
    if not statistics.is_file():  # macOS, which ignores the limit below
        yield
        return
    before, hardest = resource.getrlimit(resource.RLIMIT_AS)
    pages, available = int(statistics.read_text().split()[0]), available_memory()
    limit = pages * resource.getpagesize() + available
    ceilings = [n for n in (before, hardest) if n != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_AS, (min([limit, *ceilings]), hardest))
    try:
        yield
    except MemoryError:
        raise InvalidInput(
            f"reading {what} would take more than the {available / 1e9:.3g} GB of memory that are "
            "available; crop or resample it"
        ) from None
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (before, hardest))


def give_back_freed_memory() -> None:
    """Make the C library return large freed blocks to the system, as it does by default.

    A library that PETSc loads on Debian switches this off (by mallopt). A refinement would then
    take three times the memory: the next, larger mesh does not fit into the blocks freed by the
    last one.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:  # not in every C library
        for option, value in ((_MMAP_MAX, 65536), (_MMAP_THRESHOLD, 1 << 24), (_TRIM, 1 << 26)):
            mallopt(option, value)


def slices(begin: int, end: int, at_once: int) -> Iterator[slice]:
    """Cut the range from begin to end into slices of `at_once`, which bound temporary arrays.

    The last one may be shorter.
    """
    return (slice(k, min(k + at_once, end)) for k in range(begin, end, at_once))
