"""The same contact on finer and finer grids."""

import numpy as np
import pytest
from contact_cases import pressed, rough_surface

from fem_seal.contact import ContactState
from fem_seal.surface import resample


def on_grids(seed: int) -> list[ContactState]:
    """One surface on n, 2n and 4n samples under one pressure."""
    height = rough_surface((32, 32), short=5, seed=seed)
    grids = [resample(height, (32 * factor, 32 * factor)) for factor in (1, 2, 4)]
    return [pressed(grid, 0.1) for grid in grids]


@pytest.fixture(scope="module")
def series():
    return [on_grids(seed) for seed in range(100)]


def measures(series, name):
    """Of each surface a row: on n, 2n and 4n samples."""
    return np.array([[getattr(state, name) for state in of_one] for of_one in series])


@pytest.mark.parametrize(
    ("name", "least", "most", "scatter"),
    [
        # Every pixel of the contact's edge counts whole: an error ∝ perimeter × spacing h. Edges
        # are short: the order of one surface scatters by a half (of 400 surfaces).
        ("contact_area_fraction", 1, 1, 0.5),
        # The correction takes a mean length of the edge for each pixel. A share of the error of
        # order 1 is left, and h² of either sign for each of the 1/h pixels of the edge: h^(3/2).
        ("contact_area_corrected", 1, 1.5, 1 / np.log(2)),
        # An edge that is off by part of a pixel changes the energy by h³ a length, and with the
        # load by h², since it moves on to the next pixel. Along the edge each pixel's h³ has either
        # sign: h³ √(1/h).
        ("mean_gap", 2.5, 2.5, 1 / np.log(2)),
    ],
)
def test_orders(series, name, least, most, scatter):
    """Of the rms change from grid to grid, to three standard errors.

    The rms value of m normal changes of either sign is known to 1/√(2m), and two of them give the
    order to 1/(ln 2 √m) = 0.14, by which 1 and 2.5 are told apart.
    """
    coarse, fine = np.sqrt(np.mean(np.diff(measures(series, name), axis=1) ** 2, axis=0))
    error = 3 * scatter / np.sqrt(len(series))
    assert least - error < np.log2(coarse / fine) < most + error


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
