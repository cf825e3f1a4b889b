"""Progress: shown on a terminal only, and only after some seconds."""

import io
import sys
import time

import pytest

from fem_seal.progress import Display, Pace

FAST = {"patience": 0.05, "beat": 0.01}  # seconds


class Terminal(io.StringIO):
    def isatty(self):
        return True


def watch(stream, monkeypatch, until, shown=True, **pace):
    """Text that a display writes while a stage reports, until it has written or time is up."""
    monkeypatch.setattr(sys, "stderr", stream)
    with Display(shown, **pace) as report:
        report("contact", "iteration 3")
        end = time.monotonic() + until
        while "iteration 3" not in stream.getvalue() and time.monotonic() < end:
            time.sleep(0.01)
    return stream.getvalue()


def test_shown_on_a_terminal(monkeypatch):
    """One line, cut at the edge of the terminal, drawn over itself and erased at the end."""
    monkeypatch.setenv("COLUMNS", "27")
    written = watch(Terminal(), monkeypatch, until=30, **FAST)
    *drawn, erased, end = written.split("\x1b[K")
    assert "\rcontact: iteration 3  [0:0" in drawn
    assert max(map(len, drawn)) <= len("\r") + 26
    assert {len(line) for line in drawn} == {len("\r") + 26}
    assert (erased, end) == ("\r", "")


@pytest.mark.parametrize(("stream", "shown"), [(io.StringIO(), True), (Terminal(), False)])
def test_silent_without_a_terminal(monkeypatch, stream, shown):
    """In a file, and on all processes but the first."""
    assert watch(stream, monkeypatch, until=0.5, shown=shown, **FAST) == ""


def test_silent_on_quick_computations(monkeypatch):
    """It shows nothing before two seconds have passed."""
    assert watch(Terminal(), monkeypatch, until=0.2) == ""


def test_plain_lines_where_there_is_no_terminal(monkeypatch, capsys):
    """One every half minute, each a line of its own."""
    now = [0.0]
    monkeypatch.setattr("fem_seal.progress.monotonic", lambda: now[0])
    for shown, expected in ((True, ["fem-seal: 2/9 points", "fem-seal: 4/9 points"]), (False, [])):
        now[0] = 0.0
        with Display(shown) as report:
            for done, now[0] in enumerate([10.0, 31.0, 50.0, 62.0, 70.0], start=1):
                report(f"{done}/9 points", "")
        assert capsys.readouterr().err.splitlines() == expected


@pytest.mark.parametrize(
    ("done", "seconds", "text"),
    [
        (0, 50.0, "0 of 8 patches done, about 30 s left"),
        (2, 10.0, "2 of 8 patches done, about 30 s left"),
        (2, 40.0, "2 of 8 patches done, about 2 min left"),
        (1, 1850.0, "1 of 8 patches done, about 4 h left"),
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
    assert heard[-1][0] == text.replace("30 s", "20 s")
