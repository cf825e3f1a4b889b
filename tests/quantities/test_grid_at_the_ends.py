"""Entries that solve the patch under other loads count what the contact's grid errs there.

Next to sealing it errs far more than at the load of the scene.
"""

from math import inf

import pytest

from fem_seal.solved import solve
from tests.coupling.lifted_scenes import scene

N, DROP = 32, 100.0  # Pa


def of_surface(seed, load, n=N, lift="none", drop=DROP, **sections):
    """The scene of `lifted_scenes` on n samples of one surface, with waves of four of N samples."""
    asked = {
        **{"surface.shape": [n, n], "surface.short_wavelength": 1.25e-5},
        **{f"{name}.{key}": value for name, one in sections.items() for key, value in one.items()},
    }
    return scene(load, drop, n=N, seed=seed, rtol=0.1, lift=lift).with_(asked)


def sealing_load(seed):
    output = {"products": ["threshold"]}
    return solve(of_surface(seed, 1e5, output=output)).quantities.threshold.pressure_sealed


def enclosed_on_finer_grids(headline, seed, load, drop):
    """Whether the leak rates under another load, on 4 N and on 8 N samples, meet the headline."""
    low, high = headline.lower or 0.0, inf if headline.upper is None else headline.upper
    found = [solve(of_surface(seed, load, k * N, drop=drop)).leak_rate.bounds for k in (4, 8)]
    return any(lower <= high and upper >= low for lower, upper in found)


def test_a_closing_end_next_to_sealing():
    """At 0.97 of the load that seals N samples; more of them are sealed under less load."""
    seed, inputs = 8, {"contact": {"pressure": "30 %"}}
    closed = 0.97 * sealing_load(seed)
    on = of_surface(seed, closed / 1.3, tolerances=inputs, accuracy={"contact_grid": True})
    solved = solve(on)
    assert solved.state == "leaking"
    assert enclosed_on_finer_grids(solved.headline, seed, closed, DROP)


@pytest.mark.parametrize("by", ["inputs", "range"])
def test_an_opening_end_of_a_sealed_patch(by):
    """At 0.94 of the load that seals: the grid of the scene's own load is sealed by a margin."""
    seed = 85
    load, accuracy = 1.34 * sealing_load(seed), {"contact_grid": True}
    if by == "inputs":
        drop, inputs = DROP, {"contact": {"pressure": "30 %"}}
        on = of_surface(seed, load, tolerances=inputs, accuracy=accuracy)
    else:
        drop = 0.3 * load
        on = of_surface(seed, load, lift="range", drop=drop, accuracy=accuracy)
    solved = solve(on)
    assert solved.state == "sealed"
    assert solved.headline.upper > 0
    assert enclosed_on_finer_grids(solved.headline, seed, 0.7 * load, drop)


def test_an_opening_end_that_a_finer_grid_may_open():
    """At 1.04 of the load that seals, which is nearer than the margin of the grid."""
    load, inputs = 1.3 * sealing_load(85), {"contact": {"pressure": "20 %"}}
    on = of_surface(85, load, tolerances=inputs, accuracy={"contact_grid": True})
    solved = solve(on)
    grid = next(entry for entry in solved.budget if entry.key == "contact_grid")
    assert (solved.state, grid.upper) == ("sealed", 1.0)
    assert solved.headline.upper is None
