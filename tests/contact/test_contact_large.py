"""Slow: many random scenes, none of which may fail."""

import numpy as np
import pytest
from contact_cases import E_STAR, SLOPE, check_equilibrium, rough_surface

from fem_seal.contact import solve

SHAPES = [(64, 64), (128, 128), (96, 40), (61, 67), (256, 256), (33, 128)]


@pytest.mark.slow
def test_five_hundred_random_scenes():
    random = np.random.default_rng(2)
    for seed in range(500):
        shape = SHAPES[seed % len(SHAPES)]
        long = max(shape) / random.choice([1, 2, 4, 8])
        short = random.uniform(1, min(8, long / 1.5))
        height = rough_surface(
            shape, hurst=random.uniform(0.05, 1), short=short, long=long, seed=seed
        )
        pressure = 10 ** random.uniform(-5, 0.5) * E_STAR * SLOPE
        state = solve(height, E_STAR, pressure=pressure)
        check_equilibrium(state, height, 1e-6)
        assert state.iterations < 100
