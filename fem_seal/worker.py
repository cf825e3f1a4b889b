"""Functions in processes of their own, while this process computes something else.

    python -P -m fem_seal.worker FILE_DESCRIPTOR

calls the pickled functions that it receives, and sends the pickled answers or errors.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from typing import IO, Any, TypeVar

from fem_seal.errors import FemSealError
from fem_seal.interrupts import die_with_parent
from fem_seal.memory import peak_memory
from fem_seal.parallel import OF_MPI

T = TypeVar("T")
_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_ENDING = 10.0  # longest time that a process takes to end [s]
_peak = 0  # largest memory of processes that have ended [bytes]


class Worker:
    """A process with one thread that calls functions of modules, one after the other.

    Functions, arguments and answers are pickled. The process starts MPI on its own, and the system
    ends it with the one that has started it. It prints to the standard error, or into a `log`.
    """

    def __init__(self, log: IO[bytes] | None = None) -> None:
        self._connection, theirs = Pipe()
        with theirs:
            # In a session of its own it does not receive Ctrl-C.
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "fem_seal.worker", str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stderr=log,
                env=environment(),
                pass_fds=[theirs.fileno()],
                start_new_session=True,
            )
        self.number = self._process.pid  #: of the process

    def begin(self, function: Callable[..., object], *arguments: object) -> None:
        """Let the process call a function; ConnectionError if it has ended."""
        self._connection.send(partial(function, *arguments))

    def fileno(self) -> int:
        """File descriptor that `select` finds ready once there is an answer or the process ends."""
        return self._connection.fileno()

    def answer(self) -> Any:
        """Wait for the answer, or raise the error of the function; EOFError if the process ended.

        An error that is none of fem_seal's ends the process.
        """
        try:
            reply, peak = self._connection.recv()
        except (EOFError, OSError):  # OSError: of a connection that is closed
            # It has its own exit status in a moment; `end` would replace that by a signal.
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_ENDING)
            raise EOFError from None
        record_peak(peak)
        if isinstance(reply, FemSealError):
            raise reply
        return reply

    def end(self) -> int:
        """End the process with all that it has started; its exit status, or minus its signal."""
        with suppress(ProcessLookupError):
            os.killpg(self.number, signal.SIGKILL)
        self._connection.close()
        return self._process.wait()


def environment() -> dict[str, str]:
    """Environment in which another process finds the same modules, and starts MPI on its own."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(OF_MPI) or "_MCA_" in k}
    paths = [str(Path(path).absolute()) for path in sys.path]
    return kept | _ONE_THREAD | {"PYTHONPATH": os.pathsep.join(paths)}


@contextmanager
def in_worker(function: Callable[..., T], *arguments: object) -> Iterator[Callable[[], T]]:
    """Compute a function in a process of its own while the block runs.

    The block gets a function that waits for the answer. If the process ends without one, most
    likely since memory is short, this process computes it.
    """
    call, worker = partial(function, *arguments), Worker()
    with suppress(ConnectionError):
        worker.begin(call)

    @cache
    def answer() -> T:
        """Wait for the answer of the process, or compute it here."""
        try:
            reply: T = worker.answer()
        except EOFError:
            reply = call()
        return reply

    try:
        yield answer
    finally:
        worker.end()


def record_peak(memory: int) -> None:
    """Keep the largest memory of other processes, that of all that ran together [bytes]."""
    global _peak
    _peak = max(_peak, memory)


def peak_of_workers() -> int:
    """Largest memory of the processes that this one has started [bytes]."""
    return _peak


def _main(descriptor: int) -> None:
    die_with_parent()
    os.set_inheritable(descriptor, False)
    # Libraries print to the standard output: let it be that of errors.
    os.dup2(2, 1)
    connection = Connection(descriptor)
    with suppress(EOFError):  # The first process has ended, or needs no more.
        while True:
            function = connection.recv()
            try:
                answer = function()
            except FemSealError as error:
                answer = error
            except MemoryError:
                signal.raise_signal(signal.SIGKILL)  # as the system does if memory is short
            del function
            connection.send((answer, peak_memory()))


if __name__ == "__main__":
    _main(int(sys.argv[1]))
