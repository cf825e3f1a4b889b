"""The same contact on finer and finer grids."""

import numpy as np
import pytest
from contact_cases import E_STAR, SLOPE, SOLID, rough_surface

from fem_seal.contact import ContactState, Load, press
from fem_seal.surface import resample

PRESSURE = 0.1 * E_STAR * SLOPE


def on_grids(seed: int = 0) -> list[ContactState]:
    """One surface on n, 2n and 4n samples under one pressure."""
    height = rough_surface((48, 48), short=4, seed=seed)
    grids = [resample(height, (48 * factor, 48 * factor)) for factor in (1, 2, 4)]
    return [press(grid, SOLID, Load("pressure", PRESSURE)) for grid in grids]


@pytest.fixture(scope="module")
def series():
    return [on_grids(seed) for seed in range(12)]


def means(series, name):
    return np.array([[getattr(state, name) for state in of_one] for of_one in series]).mean(axis=0)


def test_raw_area_converges_at_first_order(series):
    """Every pixel of the contact's edge counts whole: an error ∝ perimeter × spacing. Edges are
    short, so that the order of one surface scatters by a quarter; twelve are taken together, to
    three of their standard errors."""
    coarse, middle, fine = means(series, "contact_area_fraction")
    order = np.log2((middle - coarse) / (fine - middle))
    assert order == pytest.approx(1, abs=3 * 0.25 / np.sqrt(len(series)))


def test_corrected_area_and_mean_gap_converge_faster(series):
    """Against the raw area's limit, which is as far from the finest grid as that from the next."""
    raw, corrected, gap = (
        means(series, name)
        for name in ("contact_area_fraction", "contact_area_corrected", "mean_gap")
    )
    limit = 2 * raw[-1] - raw[-2]
    # The coarsest grid is worth more than the finest one.
    assert abs(corrected[0] - limit) < abs(raw[-1] - limit)
    # The load, not its edge, carries the mean gap: its error is of second order.
    assert abs(gap[0] / gap[-1] - 1) < (raw[0] / raw[-1] - 1) ** 2
