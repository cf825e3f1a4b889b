"""A few seconds of `python tests/fuzz.py`; its check notices faults."""

import fuzz
import pytest


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
