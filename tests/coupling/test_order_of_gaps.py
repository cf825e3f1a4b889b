"""Where the fluid presses more, no gap gets smaller: the theorem behind flow.lift = "range".

Half-space, periodic, one total load P₀: p_f <= p_f' everywhere and P₀ > mean(p_f) give g <= g'
everywhere (docs/theory/mathematics.md, theorem 10). The proof needs a stiffness that is negative
off its diagonal. That of the package is so on one row of an odd number of samples and on 3² of
them, where the theorem is exact. On most grids it is not, and rough surfaces are tried.
"""

import numpy as np
import pytest
from lifted_scenes import problem_of, scene

from fem_seal.grid import GridField

TOLERANCE = 1e-13  # of the certificate


def error(problem, fluid, state):
    """Largest error of a gap [m]: of the displacement, of its level as much, and what is cut off.

    The certificate bounds the energy e·Se/2 of the error e of the pressures by Σp rms heights, and
    |Se| <= √(e·Se S₀₀), with S₀₀ the displacement of a sample under a pressure of 1 on it alone.
    """
    rms = (problem.height.values - problem.displacement(fluid)).std()
    own = 1 / (problem.half_space.point_stiffness * problem.stiffness)
    moved = np.sqrt(2 * TOLERANCE * rms * state.pressure.values.sum() * own)
    return 2 * moved + rms * (2 * TOLERANCE + state.pressed_gap)


@pytest.mark.parametrize("floats", [False, True])
@pytest.mark.parametrize("shape", [(31, 1), (3, 3)])
def test_gaps_are_ordered_as_the_fluid_pressures(shape, floats):
    """Any two ordered pressures, of which the lower leaves a load to the solid."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        low = 1e5 * rng.random(shape) * rng.integers(0, 2, shape)
        high = low + 1e5 * rng.random(shape) * rng.integers(0, 2, shape)
        load = high.mean() + (0 if floats else 1e5 * rng.uniform(0.05, 1))
        heights = GridField(1e-7 * rng.normal(size=shape), (1e-6, 1e-6), periodic=True)
        contact = {"pressure": load, "tolerance": TOLERANCE}
        problem = problem_of(scene(contact=contact), heights)
        row = problem.half_space.pressure(np.eye(1, heights.values.size).reshape(shape))
        assert (row.ravel()[1:] < 0).all()
        tight, wide = (problem.contact_under(fluid) for fluid in (low, high))
        assert wide.pressure.values.any() != floats
        slack = error(problem, low, tight) + error(problem, high, wide)
        change = wide.gap.values - tight.gap.values
        assert change.max() > slack
        assert change.min() > -slack


KINDS = {
    "step": lambda x, y, rng: (x > 0.5) * 1.0,
    "stripes": lambda x, y, rng: 0.5 + 0.5 * np.cos(8 * np.pi * y),
    "blocks": lambda x, y, rng: rng.random((8, 8)).repeat(4, axis=0).repeat(4, axis=1),
    "noise": lambda x, y, rng: rng.random(x.shape),
    "samples": lambda x, y, rng: (rng.random(x.shape) > 0.9) * 1.0,
    "falling": lambda x, y, rng: 1 - x + 0 * y,
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rough_gaps_lie_between_those_of_constant_pressures(seed, kind):
    """The package's stiffness: p_f = 0 <= p_f <= p_in.

    Each contact is that of heights to 1e-4 of the rms height (docs/theory/contact.md), which move
    a gap by that and its level by as much.
    """
    problem = problem_of(scene(seed=seed))
    rng = np.random.default_rng(seed)
    shape = problem.height.shape
    x, y = np.meshgrid(*(np.arange(n) / n for n in shape), indexing="ij")
    some = problem.inlet * KINDS[kind](x, y, rng)
    pressures = np.zeros(shape), some, np.full(shape, problem.inlet)
    gaps = [problem.contact_under(pressure).gap.values for pressure in pressures]
    slack = 4e-4 * problem.height.values.std()
    assert (gaps[1] - gaps[0]).min() > -slack
    assert (gaps[2] - gaps[1]).min() > -slack
    assert gaps[0].mean() < gaps[1].mean() < gaps[2].mean()
