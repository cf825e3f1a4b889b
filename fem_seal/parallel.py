"""One process, or several under mpirun; MPI is imported only in the second case."""

import os
import platform
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from importlib.util import find_spec
from types import TracebackType
from typing import TYPE_CHECKING, TypeAlias, TypeVar

from fem_seal.errors import FemSealError, printable

if TYPE_CHECKING:
    from mpi4py import MPI

T = TypeVar("T")
# The processes that work on one problem together; None stands for all of this run.
Comm: TypeAlias = "MPI.Comm | None"

# Prefixes of environment variables. A process in which they are set takes itself for one that
# mpirun (of Open MPI or MPICH) has started. A process that starts MPI on its own has them too.
OF_MPI = ("OMPI_", "PMIX_", "PMI_", "PRTE_", "HYDRA_")
# One of these is set in every process that Open MPI, MPICH or Slurm starts.
_LAUNCHERS = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK")
LONGEST_PAUSE = 0.01  # [s] between two looks of a process that waits for the first


_by_itself = False  # whether this process solves without the others, as a worker of many points


@contextmanager
def by_itself() -> Iterator[None]:
    """Let this process solve without the others of its run, with a PETSc of its own."""
    global _by_itself
    start_petsc(alone())
    before, _by_itself = _by_itself, True
    try:
        yield
    finally:
        _by_itself = before


def _world() -> "MPI.Comm | None":
    """Communicator of all processes of this run, None if there is only one."""
    return None if _by_itself else _started()


@cache
def _started() -> "MPI.Comm | None":
    """Communicator of all processes that mpirun has started, None if there is only one."""
    if not any(name in os.environ for name in _LAUNCHERS):
        return None
    from mpi4py import MPI
    from mpi4py.util.pkl5 import Intracomm

    # The plain communicator cannot broadcast an object of 2 GB, the size of a 16384 x 16384 gap.
    return Intracomm(MPI.COMM_WORLD) if MPI.COMM_WORLD.size > 1 else None


def _together(comm: Comm) -> "MPI.Comm | None":
    """Communicator of more than one process, of all if none is given; None for a single one."""
    if comm is None:
        return _world()
    if comm.size == 1:
        return None
    from mpi4py.util.pkl5 import Intracomm

    return Intracomm(comm)


def alone() -> Comm:
    """Communicator of this process alone, for a problem that it solves without the others."""
    if _world() is None:
        return None
    from mpi4py import MPI

    return MPI.COMM_SELF


def start_petsc(comm: Comm) -> None:
    """Start PETSc for the processes that solve together, if they are fewer than all of this run.

    PETSc starts when it is first imported, and then waits for all processes of MPI.COMM_WORLD. A
    worker that solves alone would wait for ever, because the others may not need PETSc.
    """
    world = _world()
    if comm is None or world is None or comm.size == world.size:
        return
    if "petsc4py.PETSc" in sys.modules or find_spec("petsc4py") is None:
        return
    import petsc4py

    petsc4py.init(comm=comm)


def communicator(comm: Comm = None) -> "MPI.Comm":
    """Communicator for a solver: the given one, or that of all processes of this run."""
    from mpi4py import MPI

    if comm is not None:
        return comm
    return MPI.COMM_SELF if _by_itself else MPI.COMM_WORLD


def processes(comm: Comm = None) -> int:
    """Number of processes of a communicator, or of this run."""
    together = _together(comm)
    return 1 if together is None else together.size


# How many processes now share the cores of this one: 1 while the others wait for it; None for all
# of this run, until they have told each other which cores they may use.
_sharing: int | None = None


def cores() -> int:
    """Cores for one process of this run: those it may use, over those who may; at least 1.

    Processes on other machines, or bound to other cores, share none with it: the first `on_root` of
    all finds out which do. Those of processes that wait there count for the one that computes.
    OMP_NUM_THREADS, where set, is an upper limit; of "2,1", for nested threads, the first number.
    """
    stated = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0].strip()
    limit = int(stated) if stated.isdecimal() and int(stated) else sys.maxsize
    started = _started()
    share = _sharing or (1 if started is None else started.size)
    return max(1, min(usable_cores() // share, limit))


def usable_cores() -> int:
    """Cores that this process may use, by its affinity mask where the system has one."""
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return usable or 1


def is_root(comm: Comm = None) -> bool:
    """Whether this process is the first; only the first one writes, draws and prints."""
    together = _together(comm)
    return together is None or together.rank == 0


def on_root(compute: Callable[[], T], comm: Comm = None) -> T:
    """Compute on the first process; return the answer, or raise its error, on every process."""
    together = _together(comm)
    if together is None:
        return compute()
    answer: T | None = None
    failure: FemSealError | None = None
    with _cores_of_all(together):
        if together.rank == 0:
            try:
                answer = compute()
            except FemSealError as error:
                failure = error
        # Sleep: MPI's own calls wait on a busy core, which the first process could use.
        ready, pause = together.Ibarrier(), 1e-4
        while not ready.Test():
            time.sleep(pause)
            pause = min(2 * pause, LONGEST_PAUSE)
    answer, failure = together.bcast((answer, failure), root=0)
    if failure is not None:
        raise failure
    return answer


@contextmanager
def _cores_of_all(together: "MPI.Comm") -> Iterator[None]:
    """Lend the cores of the processes on its machine to the first one, while they wait for it."""
    global _sharing
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    after, own, machine = _sharing, os.sched_getaffinity(0), platform.node()
    masks = [mask for name, mask in together.allgather((machine, own)) if name == machine]
    if together.size == processes():
        after = sum(not own.isdisjoint(mask) for mask in masks)
        if together.rank == 0:
            # mpirun may have bound each process to a core; threads inherit its mask.
            with suppress(OSError):  # The system may keep them apart.
                os.sched_setaffinity(0, own.union(*masks))
            _sharing = 1
    try:
        yield
    finally:
        _sharing = after
        os.sched_setaffinity(0, own)


def total(number: int, comm: Comm = None) -> int:
    """Sum of a number over the processes of a communicator, or of this run."""
    together = _together(comm)
    return number if together is None else together.allreduce(number)


def abort_together() -> None:
    """End all processes if one fails unexpectedly; the others would wait for it for ever."""
    world = _world()
    if world is None:
        return

    def hook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        sys.__excepthook__(kind, error, trace)
        world.Abort(1)

    sys.excepthook = hook


def fail(message: str, status: int, more: Sequence[str] = ()) -> int:
    """Print an error message once and end all processes with an exit status.

    A single process gets the status back; several are ended here.
    """
    # The name of a file in the message may contain line breaks or control characters.
    lines = (printable(" ".join(line.splitlines())) for line in (message, *more))
    message = "\n".join(lines)
    world = _world()
    if world is None:
        print(message, file=sys.stderr)  # noqa: T201 (the error message of a command)
        return status
    if world.rank:
        # Most errors occur on all processes: wait until the first has printed it and ended them.
        time.sleep(2)
        message = f"{message} (process {world.rank})"
    print(message, file=sys.stderr, flush=True)  # noqa: T201
    world.Abort(status)
    raise SystemExit(status)
