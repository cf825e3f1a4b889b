"""Every level from every start against bounds that share no code with the package."""

import numpy as np
import pytest
from brute_force import bounds_by_brute_force
from gaps import assert_enclosed, bracketed

from fem_seal.film import GridFilm
from fem_seal.flow import Tuning
from fem_seal.grid import GridField
from fem_seal.theory.closed_forms import piecewise_linear_channel

SIDES = ["wall", "periodic"]
REPRESENTATIONS = ["linear", "constant"]


@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_the_brute_force_itself(representation, sides):
    """Channels g(y) and g(x) in closed form, and a barrier."""
    n = 8
    g = 0.3 + np.random.default_rng(0).random(n)
    g[-1] = g[0]
    for along in (False, True):
        samples = np.repeat(g[None], n, axis=0) if along else np.repeat(g[:, None], n, axis=1)
        if representation == "constant":
            exact = (g**3).mean() if along else 1 / (g**-3.0).mean()
        else:
            a, b = g[:-1], g[1:]
            parallel = ((a + b) * (a * a + b * b) / 4).mean()
            exact = parallel if along else piecewise_linear_channel(g)
        lower, upper = bounds_by_brute_force(samples, (1.0, 1.0), representation, sides, 8)
        assert lower <= exact * (1 + 1e-12)
        assert exact * (1 - 1e-12) <= upper
        assert upper / lower < (1.03 if representation == "linear" else 1 + 1e-9)
    barrier = np.ones((n, n))
    barrier[3] = 0
    assert bounds_by_brute_force(barrier, (1.0, 1.0), representation, sides, 2)[0] == 0


def nasty_gap(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """Low or high contrast, with scattered contact, contact lines, or spots at the sides."""
    gap = 10 ** rng.uniform(-rng.choice([0.1, 0.5, 2.0]), 0, shape)
    kind = rng.integers(4)
    if kind == 1:
        gap[rng.random(shape) < 0.2] = 0
    for _ in range(3 * (kind >= 2)):
        i, j = (int(rng.integers(n)) for n in shape)
        length = int(rng.integers(2, max(shape)))
        if kind == 2:
            gap[i : i + length, j] = 0
        elif rng.random() < 0.5:
            gap[i : i + 2, : min(length, shape[1] - 2)] = 0
        else:
            gap[i : i + 2, max(shape[1] - length, 2) :] = 0
    return gap


@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("representation", REPRESENTATIONS)
@pytest.mark.parametrize("seed", range(4))
def test_every_level_encloses_the_brute_force(representation, sides, seed):
    """Squares of eight, four or one pixel to start from, slender pixels, and any tuning: the bounds
    of all levels meet the independent ones."""
    rng = np.random.default_rng(seed)
    shape = [((16, 8), (8, 16), (16, 16), (9, 7))[seed % 4][axis] for axis in (0, 1)]
    if representation == "linear":
        shape = [n + 1 for n in shape]
    samples = nasty_gap(rng, tuple(shape))
    if representation == "linear" and sides == "periodic":
        samples[:, -1] = samples[:, 0]
    spacing = ((1.0, 1.0), (2.0, 1.0), (1.0, 3.0))[seed % 3]
    low, high = bounds_by_brute_force(samples, spacing, representation, sides, 6)
    tunings = [
        Tuning(coarsest=int(coarsest), cut=cut, floor=floor, ceiling=ceiling)
        for coarsest, cut, floor, ceiling in ((32, 1e-2, 1e-4, 2e3), (1, 0.9, 0.9, 1.5))
    ]
    for method, tuning in (("uniform", tunings[0]), *(("adaptive", t) for t in tunings)):
        film = GridFilm(GridField(samples, spacing), sides, representation)
        flow = bracketed(film, 0.01, 1500, method=method, tuning=tuning)
        assert flow.state == "leaking" or low == 0
        assert_enclosed(flow, low * (1 - 1e-9), high * (1 + 1e-9))
