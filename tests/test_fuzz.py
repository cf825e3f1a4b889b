"""A few seconds of `python tests/fuzz.py`; its check notices faults."""

from pathlib import Path

import fuzz
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st


@pytest.mark.parametrize(
    ("kind", "examples"),
    [("scenes", 30), ("gaps", 30), ("heights", 20), ("meshes", 20), ("results", 6)],
)
def test_broken_input(kind, examples):
    tally = fuzz.campaign(examples, [kind])
    assert sum(tally.values()) == examples
    assert tally[kind, 2] > 0


@pytest.mark.slow
def test_campaign():
    assert sum(fuzz.campaign(2000).values()) == 2000 * len(fuzz.KINDS)


def writes_beside(command):
    Path("beside").touch()
    return 0


def refuses_in_silence(command):
    return 2


@pytest.mark.parametrize("command", [writes_beside, refuses_in_silence])
def test_the_judge_says_no(command, monkeypatch):
    monkeypatch.setattr(fuzz.cli, "main", command)

    @settings(max_examples=1, derandomize=True, database=None)
    @given(st.data())
    def case(data):
        with pytest.raises(AssertionError):
            fuzz.check("scenes", data.draw)

    case()
