"""What the adaptive bounds must cost: rates stated before they are observed, and budgets."""

from functools import cache
from itertools import product

import numpy as np
import pytest
from gaps import bracketed

from fem_seal.contact import ContactStopping, ElasticSolid, Load, press
from fem_seal.fenicsx import HAS_HYPRE
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, self_affine


@cache
def elastic_gap(n: int, hurst: float, short: float, area: float, seed: int) -> GridField:
    # Two octaves at least, where the short cut-off comes near to n/8.
    spectrum = Spectrum(hurst, max(n / 8, 4 * short) * 1e-6, short * 1e-6)
    height = self_affine(spectrum, (n, n), (n * 1e-6, n * 1e-6), rms_slope=0.1, seed=seed)
    return press(
        height, ElasticSolid(1e7), Load("area_fraction", area), ContactStopping(tolerance=1e-6)
    ).gap


ROUGH = [(64, 0.8, 4, 0.35, 1, "periodic"), (64, 0.8, 1, 0.2, 1, "wall")]
LARGE = [(128, *one, 0.25, 2, "periodic") for one in product((0.4, 0.8), (1, 4, 16))]


@pytest.mark.parametrize(
    ("gap", "rtol", "most"),
    [
        *((row, 0.06, 60_000) for row in ROUGH),
        # Down to a third of a per cent.
        *(pytest.param(row, 0.006, 1_500_000, marks=pytest.mark.slow) for row in LARGE),
    ],
)
def test_half_width_falls_like_one_over_unknowns(gap, rtol, most):
    """Linear elements refined where it matters lose energy error like N^-1 (optimal in 2-D).

    The order has a bound from one side: on the few meshes of a small scene a step that opens a
    channel may gain more than any order, which holds in the limit alone.
    """
    *of_gap, sides = gap
    leak = bracketed(GridFilm(elastic_gap(*of_gap), sides), rtol, most)
    assert leak.converged, leak.reason
    late = [level for level in leak.levels if 0 < level.half_width < 0.1]
    unknowns, half_width = np.array([(level.unknowns, level.half_width) for level in late]).T
    # From ±10 % on; the rate before that is faster, as channels open. A tenth is left for the
    # last step, which is a small one.
    slope = np.polyfit(np.log(unknowns), np.log(half_width), 1)[0]
    assert slope < -0.9, (slope, unknowns, half_width)
    most = 10 if HAS_HYPRE else 25
    assert max(i for level in leak.levels for i in level.iterations.values()) <= most


def test_adaptive_needs_a_fraction_of_the_uniform_mesh_near_percolation():
    film = GridFilm(elastic_gap(64, 0.8, 4, 0.38, 3), "periodic")
    uniform = bracketed(film, 1e-3, 30_000, method="uniform")
    half_width = uniform.levels[-1].half_width
    adaptive = bracketed(film, 2 * half_width, uniform.unknowns, every_dual=False)
    assert adaptive.levels[-1].half_width <= half_width
    # The advantage grows with the size: a constriction is a point in ever more channel.
    assert 5 * adaptive.unknowns < uniform.unknowns
    assert "'adaptive' needs fewer" in uniform.reason
    # Same gap, two certificates: they must have the leak rate in common.
    assert max(adaptive.lower, uniform.lower) <= min(adaptive.upper, uniform.upper)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n", "area", "half_width", "budget"),
    [
        (256, 0.41, 0.025, 22_000),
        (256, 0.41, 0.01, 38_000),
        (256, 0.23, 0.015, 75_000),
        (512, 0.22, 0.01, 230_000),
        (512, 0.40, 0.015, 85_000),
    ],
)
def test_unknowns_stay_within_the_budget(n, area, half_width, budget):
    """Walls, H = 0.8, four samples per shortest wavelength, median of three surfaces."""
    needed = []
    for seed in (1, 2, 3):
        film = GridFilm(elastic_gap(n, 0.8, 4, area, seed))
        leak = bracketed(film, 2 * half_width, 2 * budget, every_dual=False)
        if leak.state == "leaking":
            needed.append(leak.unknowns if leak.converged else np.inf)
    assert needed, "every surface is sealed: choose another seed"
    assert np.median(needed) <= budget, needed
