"""What is going on, on a terminal, for anything that takes more than two seconds."""

import sys
from collections.abc import Callable
from threading import Event, Thread
from types import TracebackType

from fem_seal.errors import printable

# (stage, detail), such as ("contact", "iteration 40, residual 3e-05")
Report = Callable[[str, str], None]

PATIENCE = 2.0  # seconds before anything is shown
BEAT = 0.5


def silent(stage: str, detail: str) -> None:
    """Report nothing."""


class Display:
    """A line on standard error with the stage, its latest news and the time, while inside `with`.

    Shown after two seconds, and only if standard error is a terminal.
    """

    def __init__(self, shown: bool = True):
        self._shown = shown and sys.stderr.isatty()
        self._line = ""
        self._done = Event()
        self._thread = Thread(target=self._beat, daemon=True)

    def __call__(self, stage: str, detail: str) -> None:
        """Take the news; a `Report`."""
        self._line = printable(f"{stage}: {detail}" if detail else stage)

    def __enter__(self) -> "Display":
        if self._shown:
            self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._done.set()
        if self._shown:
            self._thread.join()

    def _beat(self) -> None:
        """Refresh from a thread: a long solve in a library gives no sign of life by itself."""
        if self._done.wait(PATIENCE):
            return
        from tqdm import tqdm

        with tqdm(bar_format="{desc}  [{elapsed}]", leave=False, file=sys.stderr) as bar:
            bar.start_t -= PATIENCE
            while not self._done.wait(BEAT):
                bar.set_description_str(self._line)
