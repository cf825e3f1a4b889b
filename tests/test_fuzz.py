"""A few seconds of `python tests/fuzz.py`."""

import fuzz
import pytest


@pytest.mark.parametrize(
    ("kind", "examples"),
    [("scenes", 20), ("gaps", 8), ("heights", 20), ("meshes", 20), ("results", 6)],
)
def test_broken_input(kind, examples):
    tally = fuzz.campaign(examples, [kind])
    assert sum(tally.values()) == examples
    assert tally[kind, 2] > 0
