"""Where the fluid presses more, no gap gets smaller: the theorem behind flow.lift = "range".

Half-space, periodic, one total load P₀: p_f <= p_f' everywhere and P₀ > mean(p_f) give g <= g'
everywhere (docs/theory/mathematics.md, theorem 10). The proof needs a stiffness that is negative
off its diagonal, which the band-limited one of the package is not: rough surfaces are tried.
"""

import numpy as np
import pytest
from lifted_scenes import problem_of, scene

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
