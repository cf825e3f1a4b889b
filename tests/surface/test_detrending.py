"""Exactly the trend is subtracted, whatever points are missing."""

import numpy as np
import pytest

from fem_seal.field_file import FieldMap
from fem_seal.surface import MapStatistics, detrended

NX, NY = 20, 31
X, Y = np.meshgrid(np.linspace(0, 3, NX), np.linspace(-1, 5, NY), indexing="ij")
TRENDS = {
    "mean": 4 + 0 * X,
    "plane": 4 - 2 * X + 0.5 * Y,
    "quadratic": 4 - 2 * X + 0.5 * Y + X**2 - 3 * X * Y + 0.2 * Y**2,
}


@pytest.mark.parametrize("trend", TRENDS)
def test_trend_changes_nothing(trend):
    """The rest is the same with a trend and without one; test_preparation shows what it is."""
    noise = np.random.default_rng(3).normal(size=X.shape)
    noise[2:9, 5:20] = np.nan
    left, alone = (
        detrended(FieldMap(heights, (1, 1), None), trend).values
        for heights in (noise + TRENDS[trend], noise)
    )
    np.testing.assert_allclose(left, alone, rtol=0, atol=1e-13 * np.abs(TRENDS[trend]).max())


@pytest.mark.parametrize(
    ("trend", "shape"),
    [("mean", X), ("plane", X * Y), ("quadratic", X**3), ("quadratic", X * Y**2)],
)
def test_higher_orders_stay(trend, shape):
    assert detrended(FieldMap(shape, (1, 1), None), trend).values.std() > 0.1


@pytest.mark.parametrize("trend", TRENDS)
def test_nothing_is_left_of_the_trend_itself(trend):
    """Its rounding error would be the roughness of a flat face, which no solver presses flat."""
    heights = np.where(X < 2.9, 1e-6 * TRENDS[trend], np.nan)
    left = detrended(FieldMap(heights, (1, 1), None), trend).values
    np.testing.assert_array_equal(left, 0 * heights)


def test_map_that_repeats_keeps_its_seam():
    """A sine of one period has a plane of least squares, and a jump where that is taken away."""
    sine = np.sin(2 * np.pi * np.arange(NX) / NX)[:, None] * np.ones((NX, NY))
    assert MapStatistics.of(detrended(FieldMap(sine, (1, 1), None), "plane")).seam > 5
    level = detrended(FieldMap(sine + 4, (1, 1), True), "mean")
    assert level.periodic
    np.testing.assert_allclose(level.values, sine, rtol=0, atol=1e-14)
