"""Size of a refinement step: marked cells, bounds to narrow, expected gain of the bubbles."""

import numpy as np
import pytest
from sample_gaps import FLUID, rough_gap

from fem_seal.film import GridFilm
from fem_seal.flow import leak_rate
from fem_seal.flow.adapt import width_ratio
from fem_seal.flow.bounds import Bounds
from fem_seal.flow.marking import Strategy, part_of_a_step
from fem_seal.leak_rate import relative_width


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


def test_the_ratio_of_widths_by_bubbles():
    """Of bounds 0.2 apart, corrected to 1.04 and 1.12; and none of bounds that agree."""
    solved, corrected = Bounds(1.0, 1.2), Bounds(1.04, 1.12)
    assert width_ratio(corrected.excess, solved.excess) == pytest.approx((1.12 / 1.04 - 1) / 0.2)
    assert width_ratio(1e-12, 0.0) == 1


def test_a_step_near_the_tolerance_is_smaller():
    """From the same mesh: the nearer the bounds are to the tolerance, the fewer unknowns are added,
    and the tolerance is met all the same."""
    gap = rough_gap((32, 32), 0.3, 5)
    far = leak_rate(GridFilm(gap), rtol=0.01, every_dual=True, **FLUID).levels
    widths = [relative_width(level.lower, level.upper) for level in far]
    last = max(k for k, width in enumerate(widths) if width > 0.1)
    # Only this step is smaller: all before it are full ones with either tolerance.
    near = leak_rate(GridFilm(gap), rtol=0.8 * widths[last], every_dual=True, **FLUID)
    assert near.converged
    assert [level.unknowns for level in near.levels[: last + 1]] == [
        level.unknowns for level in far[: last + 1]
    ]
    assert near.levels[last + 1].unknowns < far[last + 1].unknowns
