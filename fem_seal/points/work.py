"""How the points of a study are shared among processes."""

from concurrent.futures import Executor
from dataclasses import dataclass

from fem_seal import parallel
from fem_seal.errors import InvalidInput


@dataclass(frozen=True)
class Work:
    """How the points of a study are shared among processes.

    InvalidInput if a value is out of range, or if each process of an mpirun would start jobs.
    """

    jobs: int = 1  #: number of worker processes on this machine
    #: (k, n): compute every n-th chain from the k-th on, k from 1. Parts may run anywhere
    part: tuple[int, int] = (1, 1)
    #: executor that computes the chains in place of processes of this
    #: machine, such as `client.get_executor()` of Dask or mpi4py's `MPIPoolExecutor`. Its workers
    #: must have the same files under the same names
    executor: Executor | None = None
    #: whether to compute nothing, and to make the table of the points computed so far
    gather: bool = False
    #: most memory of all jobs together [bytes]; the available memory of the machine if left out
    memory: int | None = None

    def __post_init__(self) -> None:
        k, n = self.part
        if self.jobs < 1:
            raise InvalidInput(f"--jobs = {self.jobs} must be at least 1")
        if not 1 <= k <= n:
            raise InvalidInput(f"--part = {k}/{n} must be K/N with 1 <= K <= N")
        if self.memory is not None and self.memory <= 0:
            raise InvalidInput(f"--memory = {self.memory / 1e9:g} GB must be above 0")
        if self.jobs > 1 and parallel.processes() > 1:
            raise InvalidInput(
                "with --jobs each point is solved by one process; start the command without mpirun"
            )

    @property
    def comm(self) -> parallel.Comm:
        """Processes that read and write the folder, and compute points unless workers do.

        All of this run; but this one alone if an executor has taken the others as its workers.
        """
        return None if self.executor is None else parallel.alone()
