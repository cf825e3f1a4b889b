"""Filling is exact for harmonic fields, and leaves known points alone."""

import numpy as np
import pytest

from fem_seal.errors import InvalidInput
from fem_seal.field_file import FieldMap
from fem_seal.surface import fill

NX, NY = 24, 17
SPACING = (2.0, 0.5)
X, Y = np.meshgrid(SPACING[0] * np.arange(NX), SPACING[1] * np.arange(NY), indexing="ij")
LINEAR = 3 + 0.2 * X - 0.7 * Y
# Real parts of (x + iy)^2 and its cube: differences of second order are exact up to cubes.
HARMONIC = LINEAR + 0.03 * (X**2 - Y**2) + 0.01 * X * Y + 1e-3 * (X**3 - 3 * X * Y**2)


def with_holes(values):
    """Single points, a block, a slit and two holes that touch at a corner; none at the border."""
    holed = values.copy()
    for hole in (
        *((3, 3), (slice(6, 12), slice(4, 9)), (slice(14, 22), 2)),
        *((slice(15, 18), slice(9, 12)), (slice(18, 21), slice(12, 15))),
    ):
        holed[hole] = np.nan
    return FieldMap(holed, SPACING, None)


def test_exact():
    """To the rounding of some dozen operations on numbers as large as the field."""
    holed, largest = with_holes(HARMONIC), np.abs(HARMONIC).max()
    filled = fill(holed, 0.3)
    known = ~np.isnan(holed.values)
    assert np.array_equal(filled.values[known], HARMONIC[known])
    np.testing.assert_allclose(filled.values, HARMONIC, rtol=0, atol=1e-13 * largest)


def test_harmonic_film_stays_within_its_rim():
    """No point of the film is above or below all of its rim (maximum principle)."""
    values = np.random.default_rng(2).random((20, 20))
    holed = values.copy()
    holed[5:15, 5:15] = np.nan
    rim = np.concatenate([values[4, 5:15], values[15, 5:15], values[5:15, 4], values[5:15, 15]])
    inside = fill(FieldMap(holed, (1, 1), None), 0.3).values[5:15, 5:15]
    assert rim.min() < inside.min()
    assert inside.max() < rim.max()


def test_harmonic_hole_at_the_border_has_no_slope_across_it():
    """A corner that is missing: the film of a constant rim is that constant."""
    holed = np.full((8, 8), 2.5)
    holed[:3, :4] = np.nan
    filled = fill(FieldMap(holed, (1, 2), None), 0.3)
    np.testing.assert_allclose(filled.values, 2.5, rtol=1e-14)


def test_nothing_missing():
    assert np.array_equal(fill(FieldMap(LINEAR, SPACING, None), 0).values, LINEAR)


def test_limit_is_a_fraction_of_all_points():
    """One of 408 points: 0.2451 %."""
    holed = LINEAR.copy()
    holed[5, 5] = np.nan
    assert fill(FieldMap(holed, SPACING, None), 1 / 408).missing == 0
    with pytest.raises(InvalidInput, match=r"1 of 408 points are missing \(0.25 %\), more than"):
        fill(FieldMap(holed, SPACING, None), 0.9 / 408)
