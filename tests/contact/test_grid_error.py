"""The same contact on finer and finer grids."""

import numpy as np
import pytest
from contact_cases import E_STAR, SLOPE, rough_surface

from fem_seal.contact import ContactState, extrapolate, solve
from fem_seal.errors import InvalidInput
from fem_seal.surface import resample

PRESSURE = 0.1 * E_STAR * SLOPE


def on_grids(seed: int = 0) -> list[ContactState]:
    """One surface on n, 2n, 4n and 8n samples under one pressure."""
    height = rough_surface((48, 48), short=4, seed=seed)
    grids = [resample(height, (48 * factor, 48 * factor)) for factor in (1, 2, 4, 8)]
    return [solve(grid, E_STAR, pressure=PRESSURE) for grid in grids]


@pytest.fixture(scope="module")
def states():
    return on_grids(1)


def test_raw_area_converges_at_first_order():
    """Every pixel of the contact's edge counts whole: an error ∝ perimeter × spacing. Edges are
    short, so that the order of one surface scatters by a quarter; twelve are taken together, to
    three of their standard errors."""
    surfaces = 12
    areas = [[state.contact_area_fraction for state in on_grids(seed)] for seed in range(surfaces)]
    found = extrapolate(np.mean(areas, axis=0))
    assert found.order == pytest.approx(1, abs=3 * 0.25 / np.sqrt(surfaces))


def test_corrected_area_and_mean_gap_converge_faster(states):
    raw, corrected, gap = (
        np.array([getattr(state, name) for state in states])
        for name in ("contact_area_fraction", "contact_area_corrected", "mean_gap")
    )
    limit = extrapolate(raw).limit
    assert abs(corrected[0] - limit) < 0.3 * abs(raw[0] - limit)
    # The load, not its edge, carries the mean gap.
    assert abs(gap[0] / gap[-1] - 1) < 0.02 * abs(raw[0] / raw[-1] - 1)


@pytest.mark.parametrize("order", [0.5, 1, 2])
def test_extrapolation_is_exact_for_one_power(order):
    values = [3 - 0.7 * h**order for h in (1, 1 / 2, 1 / 4)]
    found = extrapolate(values)
    assert found.limit == pytest.approx(3, rel=1e-12)
    assert found.order == pytest.approx(order, rel=1e-9)
    assert found.error == pytest.approx(3 - values[-1], rel=1e-9)


@pytest.mark.parametrize("values", [(1, 2, 1.5), (1, 2, 4), (1, 1, 2)])
def test_no_limit_without_convergence(values):
    found = extrapolate(values)
    assert found.limit == values[-1]
    assert found.error == max(abs(np.diff(values)))
    assert np.isnan(found.order)


def test_two_grids_are_refused():
    with pytest.raises(InvalidInput, match="three grids"):
        extrapolate([1.0, 2.0])
