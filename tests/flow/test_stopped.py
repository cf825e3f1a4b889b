"""The result if a limit ends the refinement on a mesh of squares of several pixels."""

import time

import numpy as np
import pytest
from sample_gaps import FLUID, rough_gap

from fem_seal.film import GridFilm
from fem_seal.flow import Limits, Tuning, leak_rate
from fem_seal.grid import GridField


@pytest.mark.parametrize("opening", [1, 6])
@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_the_guide_never_becomes_a_bound(opening, representation, sides):
    """A barrier with a narrow or a wide opening of a tenth of the gap, amid coarse cells,
    which are closed: the regularised dual that guides the refinement lets hundreds of times too
    much through them. Whoever stops there gets the true dual's bound, or none."""
    n = 33 if representation == "linear" else 32
    samples = np.ones((n, n))
    samples[13] = 0
    samples[13, 10 : 10 + opening] = 0.1
    film = GridFilm(GridField(samples, (1.0, 1.0)), sides, representation)
    truth = leak_rate(film, rtol=0.1, **FLUID)
    assert truth.converged
    for limits in (Limits(seconds=0.0), Limits(unknowns=40), Limits(memory_bytes=1)):
        stopped = leak_rate(film, limits=limits, tuning=Tuning(coarsest=4), **FLUID)
        assert not stopped.converged
        assert 0 <= stopped.lower <= truth.upper
        assert truth.lower <= stopped.upper
        assert stopped.levels[-1].upper > 10 * truth.upper  # on a mesh that sees little of it


def test_no_level_begins_that_would_not_end_in_time():
    """Of 100 s, 50 are spent: a level of 20 s fits twice, one of 30 s does not."""
    started, limits = time.perf_counter() - 50, Limits(seconds=100)
    assert not limits.exceeded(started, growth=2, last=20)
    assert "longer than the limit of 100 s" in limits.exceeded(started, growth=2, last=30)
    assert "is used up" in Limits(seconds=40).exceeded(started)


@pytest.mark.parametrize("ahead", [0, 2, 4])
def test_a_limit_leaves_both_bounds(ahead):
    """Meshes that look ahead may be four times the last: each that might be the last before a limit
    gets a true dual, so that a run which ends there has a lower bound."""
    gap = rough_gap((64, 64), 0.0, 9, smooth=1)
    gap = GridField(gap.values + 0.3, gap.spacing, gap.periodic)
    for most in (124, 482, 1472, 4148):
        flow = leak_rate(
            GridFilm(gap, sides="periodic"),
            rtol=2e-3,
            limits=Limits(unknowns=most),
            tuning=Tuning(coarsest=8, ahead=ahead),
            **FLUID,
        )
        assert flow.lower > 0
