"""A function in a process of its own, beside what this process computes meanwhile.

    python -P -m fem_seal.beside

reads a pickled function of a module with its arguments, and writes the pickled answer or error.
"""

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Generic, TypeVar

from fem_seal.errors import FemSealError, present
from fem_seal.interrupts import die_with_parent
from fem_seal.memory import peak_memory
from fem_seal.parallel import OF_MPI

T = TypeVar("T")
_peaks = [0]  # largest memory of processes that have ended [bytes]


def environment(**variables: str) -> dict[str, str]:
    """Environment in which another process finds this package, and starts MPI on its own."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(OF_MPI) or "_MCA_" in k}
    paths = [str(Path(__file__).parents[1]), *filter(None, [kept.get("PYTHONPATH")])]
    return kept | {"PYTHONPATH": os.pathsep.join(paths)} | variables


class Beside(Generic[T]):
    """A function in a process with one thread; called, this waits for its answer.

    Function and arguments are pickled. If the process is killed, most likely since memory is short,
    or was ended, this process computes the answer.
    """

    def __init__(self, function: Callable[..., T], *arguments: object) -> None:
        self._call = partial(function, *arguments)
        # In a session of its own it does not receive Ctrl-C, but it ends with this process.
        self._process: subprocess.Popen | None = subprocess.Popen(
            [sys.executable, "-P", "-m", "fem_seal.beside"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1"),
            start_new_session=True,
        )
        with suppress(BrokenPipeError), present(self._process.stdin, "pipe") as stdin:
            pickle.dump(self._call, stdin, protocol=pickle.HIGHEST_PROTOCOL)

    def __call__(self) -> T:
        """Wait for the answer of the process."""
        process, self._process = self._process, None
        if process is None:
            return self._call()
        with process:
            stdout = present(process.stdout, "pipe").read()
        if process.returncode:
            return self._call()
        reply: T | FemSealError
        reply, peak = pickle.loads(stdout)
        record_peak(peak)
        if isinstance(reply, FemSealError):
            raise reply
        return reply

    def end(self) -> None:
        """End the process if nobody has waited for its answer."""
        process, self._process = self._process, None
        if process is not None:
            with process:
                process.kill()


def record_peak(memory: int) -> None:
    """Keep the largest memory of other processes, that of all that ran together [bytes]."""
    _peaks.append(memory)


def peak_beside() -> int:
    """Largest memory of the processes that this one has started [bytes]."""
    return max(_peaks)


def _main() -> None:
    # The system ends it with the process that started it.
    die_with_parent()
    stdin = sys.stdin.buffer.read()  # before the imports that it takes to load it
    # Libraries print to the standard output: let it be that of errors.
    with os.fdopen(os.dup(1), "wb") as stdout:
        os.dup2(2, 1)
        function = pickle.loads(stdin)
        del stdin
        try:
            answer = function()
        except FemSealError as error:
            answer = error
        except MemoryError:
            sys.exit(1)  # The first process computes it when its own work has ended.
        pickle.dump((answer, peak_memory()), stdout)


if __name__ == "__main__":
    _main()
