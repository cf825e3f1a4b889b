"""Progress: shown on a terminal only, and only after some seconds."""

import io
import sys
import time

import pytest

from fem_seal import progress
from fem_seal.progress import Display, Pace


class Terminal(io.StringIO):
    def isatty(self):
        return True


def watch(stream, monkeypatch, until, *, root=True, times=(0.05, 0.01)):
    """Text that a display writes while a stage reports, until it has written or time is up."""
    if times is not None:
        for name in ("ON_TERMINAL", "ELSEWHERE"):
            monkeypatch.setattr(progress, name, times)
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr("fem_seal.parallel.is_root", lambda: root)
    with Display() as report:
        report("contact", "iteration 3")
        end = time.monotonic() + until
        while "iteration 3" not in stream.getvalue() and time.monotonic() < end:
            time.sleep(0.01)
    return stream.getvalue()


def test_shown_on_a_terminal_and_as_plain_lines_elsewhere(monkeypatch):
    """One line, cut at the edge of the terminal, drawn over itself and erased at the end."""
    monkeypatch.setenv("COLUMNS", "27")
    start, *drawn, end = watch(Terminal(), monkeypatch, until=30).split(progress.CLEAR)
    assert drawn[0].startswith("contact: iteration 3  [0:0")
    assert {len(line) for line in drawn} == {26}
    assert (start, end) == ("", "")
    plain = watch(io.StringIO(), monkeypatch, until=30)
    assert set(plain.splitlines()) == {"fem-seal: contact: iteration 3"}


def test_silent_on_quick_computations_and_on_all_processes_but_the_first(monkeypatch):
    """It shows nothing before two seconds have passed, and 30 where there is no terminal."""
    for stream in (io.StringIO(), Terminal()):
        assert watch(stream, monkeypatch, until=0.2, times=None) == ""
    assert watch(Terminal(), monkeypatch, until=0.5, root=False) == ""


@pytest.mark.parametrize(
    ("done", "seconds", "text"),
    [
        (0, 50.0, "0 of 8 patches done, about 30 s left"),
        (2, 10.0, "2 of 8 patches done, about 30 s left"),
        (2, 40.0, "2 of 8 patches done, about 2 min left"),
        (1, 1850.0, "1 of 8 patches done, about 3.6 h left"),
        (8, 99.0, "8 of 8 patches done"),
    ],
)
def test_pace(done, seconds, text, monkeypatch):
    """The points that are left take as long as those that are done, if they take alike.

    Before the first one is done, the expected time runs down; until the next one, that of the last.
    """
    now, heard = [1000.0], []
    monkeypatch.setattr("fem_seal.progress.monotonic", lambda: now[0])
    report = lambda stage, detail: heard.append((stage, detail))  # noqa: E731
    pace = Pace(8, "patches", report, 80.0)
    now[0] += seconds
    for _ in range(done):
        pace.count()
    pace("patch 3 of 8", "iteration 2")
    pace("", "")
    assert heard == [(f"{text}: patch 3 of 8", "iteration 2"), (text, "")]
    now[0] += 10.0
    pace("", "")
    assert heard[-1][0] == text.replace("30 s", "20 s").replace("2 min", "1.8 min")
