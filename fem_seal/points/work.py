"""How the points of a study are shared among processes."""

from concurrent.futures import Executor
from dataclasses import dataclass
from math import inf
from numbers import Integral

from fem_seal import parallel
from fem_seal.errors import InvalidInput
from fem_seal.memory import available_memory

# Workers import the libraries themselves: they must save more time than this [s].
START = 5.0
WITHIN = 1.5  # factor by which a point may take more memory than is expected of it
# Memory counted for a point of which nothing is known, if --memory is given: that of a contact on
# 4096 x 4096 samples and its flow [bytes].
UNKNOWN_POINT = 4_000_000_000


@dataclass(frozen=True)
class Expected:
    """Time and memory that a point is expected to take in a process of its own."""

    seconds: float  #: time [s]
    memory: float  #: [bytes]

    @property
    def reserved(self) -> int:
        """Memory kept free for it [bytes]."""
        return int(WITHIN * self.memory)


@dataclass(frozen=True)
class Work:
    """How the points of a study are shared among processes.

    InvalidInput if a value is out of range, or if each process of an mpirun would start jobs.
    """

    #: number of worker processes on this machine; None: as many as `jobs_for` finds to pay
    jobs: int | None = 1
    #: (k, n): compute every n-th point from the k-th on, k from 1. Parts may run anywhere
    part: tuple[int, int] = (1, 1)
    #: executor that computes the points in place of processes of this machine, such as
    #: `client.get_executor()` of Dask or mpi4py's `MPIPoolExecutor`. Its workers must have the same
    #: files under the same names
    executor: Executor | None = None
    #: whether to compute nothing, and to make the table of the points computed so far
    gather: bool = False
    #: memory by which the number of jobs is chosen [bytes]; the available one if left out
    memory: float | None = None

    def __post_init__(self) -> None:
        (k, n), jobs = self.part, 1 if self.jobs is None else self.jobs
        if not isinstance(jobs, Integral) or jobs < 1:
            raise InvalidInput(f"jobs = {self.jobs} must be a whole number of at least 1 (--jobs)")
        if not 1 <= k <= n:
            raise InvalidInput(f"part = {k}/{n} must be K/N with 1 <= K <= N (--part)")
        if self.memory is not None and not 0 < self.memory < inf:
            gigabytes = self.memory / 1e9
            raise InvalidInput(f"memory = {gigabytes:g} GB must be finite and above 0 (--memory)")
        if jobs > 1 and parallel.processes() > 1:
            raise InvalidInput(
                f"jobs = {jobs} (--jobs): each point is then solved by one process; start the "
                "command without mpirun"
            )

    @property
    def open(self) -> bool:
        """Whether `jobs_for` chooses the number of workers; nobody does under mpirun."""
        return self.jobs is None and self.executor is None and parallel.processes() == 1

    def jobs_for(self, points: int, each: Expected | None) -> int:
        """Number of workers for some points, from what each is expected to take.

        No more than the memory holds, where each is expected to take some or `memory` is given. If
        the number is open, one for each core and point, if that saves enough time.
        """
        memory = self.memory or (inf if each is None else available_memory())
        fitting = memory / (UNKNOWN_POINT if each is None else each.reserved)
        if each is None or not self.open:
            return max(1, int(min(self.jobs or 1, fitting)))
        most = max(1, int(min(parallel.usable_cores(), points, fitting)))
        return most if points * each.seconds * (1 - 1 / most) > START else 1

    @property
    def comm(self) -> parallel.Comm:
        """Processes that read and write the folder, and compute points unless workers do.

        All of this run; but this one alone if an executor has taken the others as its workers.
        """
        return None if self.executor is None else parallel.alone()
