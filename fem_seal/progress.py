"""Progress of a long computation, shown on a terminal after two seconds."""

import sys
from collections.abc import Callable
from datetime import timedelta
from shutil import get_terminal_size
from threading import Event, Thread
from time import monotonic

from fem_seal.errors import printable

# Function of stage and detail, such as ("contact", "iteration 40, residual 3e-05").
Report = Callable[[str, str], None]

LINES_APART = 30.0  # seconds between two plain lines
NOTE = "note"  # stage whose detail is a line that stays


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
    """Time in words, in one unit."""
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * length:
            return f"{seconds / length:.0f} {unit}"
    return f"{seconds:.0f} s"


class Display:
    """Context manager that shows stage, detail and elapsed time in a line on standard error.

    On a terminal it updates one line in place, after a patience and with a beat of some seconds;
    elsewhere it prints a plain line every 30 s. The object is a `Report`: calling it with stage and
    detail updates the line.
    """

    def __init__(self, shown: bool = True, *, patience: float = 2.0, beat: float = 0.5):
        terminal = sys.stderr.isatty()
        self._shown = shown and terminal
        self._lines = shown and not terminal
        self._patience, self._beat_seconds = patience, beat
        self._start = monotonic()
        self._next = self._start + LINES_APART
        self._line = ""
        self._done = Event()
        self._thread = Thread(target=self._refresh, daemon=True)

    def __call__(self, stage: str, detail: str) -> None:
        """Set the stage and the detail to show, or print a note."""
        if stage == NOTE:
            if self._shown or self._lines:
                clear = "\r\x1b[K" if self._shown else ""
                print(f"{clear}fem-seal: {printable(detail)}", file=sys.stderr, flush=True)  # noqa: T201
            return
        self._line = printable(f"{stage}: {detail}" if detail else stage)
        if self._lines and monotonic() > self._next:
            self._next = monotonic() + LINES_APART
            print(f"fem-seal: {self._line}", file=sys.stderr, flush=True)  # noqa: T201

    def __enter__(self) -> "Display":
        if self._shown:
            self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._done.set()
        if self._shown:
            self._thread.join()

    def _refresh(self) -> None:
        """Update the line from a thread, so that the time advances during a long library call."""
        if self._done.wait(self._patience):
            return
        while not self._done.wait(self._beat_seconds):
            elapsed = timedelta(seconds=int(monotonic() - self._start))
            self._draw(f"{self._line}  [{elapsed}]"[: get_terminal_size().columns - 1])
        self._draw("")

    def _draw(self, line: str) -> None:
        """Write a line over the one before."""
        print(f"\r{line}\x1b[K", end="", file=sys.stderr, flush=True)  # noqa: T201
