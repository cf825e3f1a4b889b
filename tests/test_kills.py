"""Whatever ends a command at whatever moment, no result is partial or wrong and no row is lost."""

import pytest
from kills import JOBS, campaign

QUICK = tuple(job for job in JOBS if job.name in ("sweep", "two sweeps into one folder"))


@pytest.mark.parametrize("seed", [1])
def test_sweeps_are_killed_and_go_on(seed):
    """Some seconds of what `python tests/kills.py` does for longer."""
    counts, wrong = campaign(4, seed, QUICK, every=2)
    assert not wrong
    assert sum(counts.values()) >= 4


@pytest.mark.slow
def test_all_commands_are_killed_and_go_on():
    counts, wrong = campaign(200, 1, JOBS)
    assert not wrong
    assert {job for job, *_ in counts} == {job.name for job in JOBS}
