"""How large a step is: what is marked, for which bounds, and what bubbles are expected to gain."""

from dataclasses import replace

import numpy as np
import pytest
from gaps import level_problem, represented
from sample_gaps import rough_gap

from fem_seal.flow.adapt import Strategy, _mark, _Solved, part_of_a_step
from fem_seal.flow.energy import Energy
from fem_seal.flow.level import Stream
from fem_seal.flow.linear import Minimum
from fem_seal.flow.marking import doerfler


def test_the_part_of_a_step():
    """The nearer the bounds the smaller, but never nothing, and all of it where they are far."""
    strategy = Strategy(rtol=0.1)
    assert part_of_a_step(np.inf, strategy) == part_of_a_step(1.0, strategy) == 1
    parts = [part_of_a_step(w, strategy) for w in (0.05, 0.09, 0.1, 0.12, 0.15)]
    assert parts == sorted(parts)
    assert parts[0] == parts[1] > 0.1
    assert parts[-1] < 1
    # 0.63 θ of the difference goes: what is left is 0.9 of the tolerance.
    for width in (0.12, 0.15):
        part = part_of_a_step(width, strategy)
        assert width * (1 - 0.63 * part * strategy.tuning.theta) == pytest.approx(
            0.09, rel=0.02, abs=0
        )


def test_the_gain_of_bubbles():
    """Of bounds 0.2 apart, corrected to 1.04 and 1.12; and none of bounds that agree."""
    pressure, stream = Minimum(None, None, Energy(1.2), 0), Stream(None, Energy(1.0), 0, 0.0)
    assert _Solved(pressure, None, stream).gain(1.04, 1.12) == pytest.approx(
        (1.12 / 1.04 - 1) / 0.2
    )
    exact = _Solved(replace(pressure, total=Energy(1.0)), None, stream)
    assert exact.gain(1.0, 1.0 + 1e-12) == 1


def test_what_is_marked():
    """Far from the tolerance full parts of both, in a last step as much as each has left to do:
    shares by what is expected, blocked cells by what was reached. A last step has no share ahead.
    """
    gap = represented(rough_gap((32, 32), 0.3, 5), cut=1e-3, width=4)
    problem = level_problem(gap, width=4, periodic_sides=True)
    pressure = problem.pressure(np.zeros(problem.unknowns))
    regularised = problem.regularised_stream(problem.mesh.first_guess()[1], 0.1)
    found, strategy = _Solved(pressure, regularised, None), Strategy(rtol=0.01)
    tuning = strategy.tuning
    shares, flow = problem.indicators(pressure, regularised), problem.blocked_flux(regularised)

    def check(expected, reached, theta, theta_flow, ahead):
        marks = _mark(problem, found, expected, reached, strategy)
        large, through = doerfler(shares, theta), doerfler(flow, theta_flow)
        assert np.array_equal(marks.times[problem.kept] > 0, large | through)
        assert not marks.times[~problem.kept].any()
        assert marks.least_indicator == (shares[large].min() if ahead else np.inf)
        assert marks.least_flux == flow[through].min()
        return large.sum(), through.sum()

    part = part_of_a_step(0.011, strategy)
    far = check(1.0, np.inf, tuning.theta, tuning.theta_blocked, True)
    last = check(0.011, np.inf, part * tuning.theta, tuning.theta_blocked, False)
    both = check(0.011, 0.011, part * tuning.theta, part * tuning.theta_blocked, False)
    assert far[0] > last[0]
    assert last[1] > both[1]
