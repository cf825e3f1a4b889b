"""Progress of a long computation, shown on a terminal after two seconds."""

import sys
from collections.abc import Callable
from datetime import timedelta
from shutil import get_terminal_size
from threading import Event, Thread
from time import monotonic

from fem_seal import parallel
from fem_seal.digits import in_digits
from fem_seal.errors import printable

# Function of stage and detail, such as ("contact", "iteration 40, certificate 3e-05").
Report = Callable[[str, str], None]

# Seconds until the first line, and between two, on a terminal and elsewhere.
ON_TERMINAL, ELSEWHERE = (2.0, 0.5), (30.0, 30.0)
NOTE = "note"  # stage whose detail is a line that stays
CLEAR = "\r\x1b[K"  # goes back to the start of the terminal's line and erases it


def silent(stage: str, detail: str) -> None:
    """Report nothing."""


class Pace:
    """A `Report` that puts first how many points are done, and about how long the others take.

    The estimate counts on points that take alike. It is made when a point is done, and runs down
    until the next one is; before the first one it is the time [s] that all are expected to take, if
    that is known. The points have a name, such as "patches".
    """

    def __init__(self, total: int, name: str, report: Report, expected: float | None = None):
        self.done = 0
        self._total, self._name, self._report = total, name, report
        self._start = monotonic()
        self._end = None if expected is None else self._start + expected

    def count(self, done: int | None = None) -> None:
        """Count one more point as done, or say how many are."""
        done = self.done + 1 if done is None else done
        if done > self.done:
            spent = monotonic() - self._start
            self.done, self._end = done, self._start + spent * self._total / done

    def __call__(self, stage: str, detail: str) -> None:
        """Report a stage of the present point."""
        text = f"{self.done} of {self._total} {self._name} done"
        left = 0.0 if self._end is None else self._end - monotonic()
        if left > 0 and self.done < self._total:
            text += f", about {duration(left)} left"
        self._report(f"{text}: {stage}" if stage else text, detail)


def duration(seconds: float) -> str:
    """Time in words, in one unit and to two digits."""
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * length:
            return f"{in_digits(seconds / length, 2)} {unit}"
    return f"{in_digits(seconds, 2)} s"


class Display:
    """Context manager that shows stage, detail and elapsed time in a line on standard error.

    On a terminal it updates one line in place; elsewhere it prints a plain line every 30 s; of
    several processes the first one alone shows it. The object is a `Report`: calling it with stage
    and detail changes the line.
    """

    def __init__(self) -> None:
        self._terminal, self._shown = sys.stderr.isatty(), parallel.is_root()
        self._start, self._line, self._done = monotonic(), "", Event()
        self._thread = Thread(target=self._refresh, daemon=True)

    def __call__(self, stage: str, detail: str) -> None:
        """Set the stage and the detail to show, or print a note."""
        if stage != NOTE:
            self._line = printable(f"{stage}: {detail}" if detail else stage)
        elif self._shown:
            self._write(f"{CLEAR if self._terminal else ''}fem-seal: {printable(detail)}\n")

    def __enter__(self) -> "Display":
        if self._shown:
            self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._done.set()
        if self._shown:
            self._thread.join()

    def _refresh(self) -> None:
        """Show the line from a thread, so that the time advances during a long library call."""
        patience, beat = ON_TERMINAL if self._terminal else ELSEWHERE
        ended = self._done.wait(patience)
        while not ended:
            elapsed = timedelta(seconds=int(monotonic() - self._start))
            if self._terminal:
                width = get_terminal_size().columns - 1
                self._write(f"{CLEAR}{f'{self._line}  [{elapsed}]'[:width]}")
            elif self._line:
                self._write(f"fem-seal: {self._line}\n")
            ended = self._done.wait(beat)
            if ended and self._terminal:
                self._write(CLEAR)

    @staticmethod
    def _write(text: str) -> None:
        print(text, end="", file=sys.stderr, flush=True)  # noqa: T201 (the progress)
