"""A few seconds of `python tests/fuzz.py`."""

import fuzz
import pytest


@pytest.mark.parametrize(
    ("kind", "examples"),
    [("scenes", 10), ("maps", 16), ("meshes", 10), ("results", 4)],
)
def test_broken_input(kind, examples):
    tally = fuzz.campaign(examples, [kind])
    assert sum(tally.values()) == examples
    assert tally[kind, 2] > 0
