"""Entries that solve the patch under other loads count what the contact's grid errs there.

Next to closing it errs far more than at the load of the scene.
"""

from math import inf

import pytest

from fem_seal.solved import solve
from tests.coupling.lifted_scenes import scene

N, DROP = 32, 100.0  # Pa
WITH_GRID = {"accuracy": {"contact_grid": True}}


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
    seed, about = 8, {"tolerances": {"contact": {"pressure": "30 %"}}}
    closed = 0.97 * sealing_load(seed)
    solved = solve(of_surface(seed, closed / 1.3, **about, **WITH_GRID))
    assert solved.state == "leaking"
    assert enclosed_on_finer_grids(solved.headline, seed, closed, DROP)


@pytest.mark.parametrize("by", ["inputs", "range"])
def test_an_opening_end_of_a_sealed_patch(by):
    """At 0.94 of the load that seals: the grid of the scene's own load is sealed by a margin."""
    seed, load = 85, 1.34 * sealing_load(85)
    asked, drop = {"tolerances": {"contact": {"pressure": "30 %"}}}, DROP
    if by == "range":
        asked, drop = {"lift": "range"}, 0.3 * load
    solved = solve(of_surface(seed, load, drop=drop, **asked, **WITH_GRID))
    assert solved.state == "sealed"
    assert solved.headline.upper > 0
    assert enclosed_on_finer_grids(solved.headline, seed, 0.7 * load, drop)


@pytest.mark.parametrize("by", ["inputs", "lift"])
def test_an_opening_end_that_a_finer_grid_may_open(by):
    """At 1.04 of the load that seals, which is nearer than the margin of the grid."""
    load, about, drop = 1.3 * sealing_load(85), {"lift": "range"}, DROP
    if by == "inputs":
        about = {"tolerances": {"contact": {"pressure": "20 %"}}}
    else:
        drop = 0.2 * load
    solved = solve(of_surface(85, load, drop=drop, **about, **WITH_GRID))
    grid, opening = (
        next(entry for entry in solved.budget if entry.key == key) for key in ("contact_grid", by)
    )
    assert (solved.state, grid.upper) == ("sealed", 1.0)
    assert solved.headline.upper is None
    assert "lift off" not in opening.sentence
