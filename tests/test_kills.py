"""Whatever ends a command at whatever moment, no result is partial or wrong and no row is lost."""

import pytest
from kills import JOBS, campaign


def test_sweeps_are_killed_and_go_on():
    """Some seconds of what `python tests/kills.py` does for longer."""
    name = "two sweeps into one folder"
    counts, wrong = campaign(2, 1, tuple(job for job in JOBS if job.name == name), every=2)
    assert not wrong
    assert counts[name, "", "next run"] == 1


@pytest.mark.slow
def test_all_commands_are_killed_and_go_on():
    counts, wrong = campaign(200, 1, JOBS)
    assert not wrong
    assert {job for job, *_ in counts} == {job.name for job in JOBS}
