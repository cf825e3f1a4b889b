"""The same contact on finer and finer grids."""

import numpy as np
import pytest
from contact_cases import pressed, rough_surface

from fem_seal.contact import ContactState
from fem_seal.surface import resample


def on_grids(seed: int = 0) -> list[ContactState]:
    """One surface on n, 2n and 4n samples under one pressure."""
    height = rough_surface((48, 48), short=4, seed=seed)
    grids = [resample(height, (48 * factor, 48 * factor)) for factor in (1, 2, 4)]
    return [pressed(grid, 0.1) for grid in grids]


@pytest.fixture(scope="module")
def series():
    return [on_grids(seed) for seed in range(24)]


def measures(series, name):
    """Of each surface a row: on n, 2n and 4n samples."""
    return np.array([[getattr(state, name) for state in of_one] for of_one in series])


@pytest.mark.parametrize(
    ("name", "order", "scatter"),
    [
        # Every pixel of the contact's edge counts whole: an error ∝ perimeter × spacing. Edges are
        # short, so that the order of one surface scatters by a quarter.
        ("contact_area_fraction", 1, 0.25),
        # The correction takes a mean length of the edge for each pixel. Its error and that of the
        # mean gap have either sign: rms values of m normal changes, known to 1/√(2m) each.
        ("contact_area_corrected", 1, 1 / np.log(2)),
        # The load, not its edge, carries the mean gap.
        ("mean_gap", 2, 1 / np.log(2)),
    ],
)
def test_orders(series, name, order, scatter):
    """Of the rms change from grid to grid, to three standard errors."""
    coarse, fine = np.sqrt(np.mean(np.diff(measures(series, name), axis=1) ** 2, axis=0))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=3 * scatter / np.sqrt(len(series)))


def test_corrected_area_is_nearer_to_the_limit(series):
    """The coarsest grid with it is worth more than the finest one without.

    The raw area's limit is as far from the finest grid as that from the next.
    """
    raw, corrected = (
        measures(series, name).mean(axis=0)
        for name in ("contact_area_fraction", "contact_area_corrected")
    )
    limit = 2 * raw[-1] - raw[-2]
    assert abs(corrected[0] - limit) < abs(raw[-1] - limit)
