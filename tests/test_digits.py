"""Numbers as text: rounded bounds that enclose, digits by the width of a bracket, prefixes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem_seal.digits import (
    bracket_digits,
    in_digits,
    number_of,
    per_cent,
    rounded_down,
    rounded_up,
    with_error,
    with_prefix,
)
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate, middle_of, rate_text

POSITIVE = st.floats(1e-30, 1e30)
WIDTHS = st.floats(1e-12, 0.999)


@given(lower=st.floats(1e-300, 1e-200), factor=st.floats(1, 1e30))
def test_the_middle_of_bounds_whose_product_is_no_number(lower, factor):
    """As far from both, to four roundings; exact where they agree."""
    upper = lower * factor
    middle = middle_of(lower, upper)
    assert middle / lower == pytest.approx(upper / middle, rel=2e-15)
    assert (middle_of(lower, lower), middle_of(0.0, upper)) == (lower, upper)


@given(middle=POSITIVE, half=WIDTHS, sign=st.sampled_from([1, -1]))
def test_rounded_bounds_enclose_and_are_hardly_wider(middle, half, sign):
    """A unit in the last of d digits is at most 10^(1-d) of the number: a tenth of the half-width.

    1e-9 is for the roundings of this test's own differences.
    """
    low, high = sorted((sign * middle * (1 - half), sign * middle * (1 + half)))
    value, lower, upper = map(float, bracket_digits(sign * middle, low, high))
    width = 0.5 * (high - low)
    assert lower <= low <= high <= upper
    assert max(low - lower, upper - high) <= 0.1 * width * (1 + 1e-9)
    # One digit less, rounded to nearest: at most half of a tenfold unit away.
    assert abs(value - sign * middle) <= 0.5 * width * (1 + 1e-9)


@pytest.mark.parametrize(
    ("bracket", "texts"),
    [
        ((6.8667e-17, 6.7041e-17, 7.0334e-17), ("6.87e-17", "6.704e-17", "7.034e-17")),
        ((2.0, 1.9, 2.1), ("2", "1.9", "2.1")),  # 2.1 is not pushed to 2.2 by its binary digits
        ((86.328, 85.476, 87.1886), ("86.33", "85.476", "87.189")),
        ((1e-15, 0.0, 3e-15), ("1e-15", "0", "3e-15")),
        ((0.0, 0.0, 0.0), ("0", "0", "0")),
        ((1 / 3,) * 3, ("0.333333333333333", "0.333333333333333", "0.333333333333334")),
        ((1.389e-15, 0.0, 1.389e-15), ("1.39e-15", "0", "1.39e-15")),  # not 1.4, beyond the bound
    ],
)
def test_number_of_digits_follows_from_the_width(bracket, texts):
    assert bracket_digits(*bracket) == texts


@pytest.mark.parametrize(
    ("function", "numbers", "text"),
    [
        (with_prefix, (5.3571675e-8, "m"), "53.57 nm"),
        (with_prefix, (9.99999e-7, "m"), "1 um"),
        (with_prefix, (1.5e5, "Pa"), "150 kPa"),
        (with_prefix, (0.0, "m"), "0 m"),
        (with_prefix, (2.5e-2, "m"), "25 mm"),
        (with_prefix, (2e6, "Pa"), "2 MPa"),
        (with_prefix, (3e9, "Pa"), "3 GPa"),
        (with_prefix, (4e-15, "m"), "4 fm"),
        (with_prefix, (7e-12, "m"), "7 pm"),
        (with_prefix, (1e12, "Pa"), "1e+12 Pa"),  # no prefix of ours
        # Two digits of a standard deviation.
        (with_error, (1.0213, 0.169), "1.02 ± 0.17"),
        (with_error, (0.81062, 0.00412), "0.8106 ± 0.0041"),
        (with_error, (123.4, 25.0), "123 ± 25"),
        (with_error, (0.8, 0.0), "0.8 ± 0"),
        (with_error, (0.8, 1e-20), "0.8 ± 1e-20"),
        (number_of, (1, "patch"), "1 patch"),
        (number_of, (2, "mesh"), "2 meshes"),
        (number_of, (4, "seed"), "4 seeds"),
        (per_cent, (0.0412,), "4.1 %"),
        (per_cent, (0.985,), "98 %"),
        (per_cent, (0.995,), "100 %"),
        (rounded_down, (1.23456,), "1.234"),
        (rounded_up, (1.23456,), "1.235"),
        # No zeros behind the last digit, nor in front of an exponent.
        *((in_digits, (float(text),), text) for text in ("1e-9", "0.25", "100", "2.5e+7", "0")),
        *((in_digits, (float(text),), text) for text in ("-1e-12", "inf", "1e-5", "1e+6")),
        (in_digits, (1 / 3,), "0.3333"),
    ],
)
def test_numbers_as_text(function, numbers, text):
    assert function(*numbers) == text


def test_text_of_a_leak_rate():
    leak = LeakRate(6.8667e-17, 6.7041e-17, 7.0334e-17, state="leaking", method="adaptive")
    assert str(leak) == "leaking: 6.87e-17 m^3/s, within [6.704e-17, 7.034e-17] (±2.4 %), flow only"
    assert str(LeakRate.sealed("adaptive")).startswith("sealed: 0 m^3/s")
    ended = LeakRate(2.0, 1.0, 4.0, state="leaking", method="uniform", reason="max_unknowns")
    assert str(ended).endswith("; max_unknowns")
    assert rate_text(2.0, 0.0, 2.0, "ml/h") == "2 ml/h, within [0, 2] (±100 %)"
    assert rate_text(0.0, 0.0, 0.0, "ml/h") == "0 ml/h"
    assert rate_text(np.pi, None, None, "ml/h") == "3.142 ml/h, without bounds"


def test_representation_leaves_the_arrays_out():
    """A notebook shows a leak rate as one line, without its meshes."""
    assert "levels" not in repr(LeakRate(1.0, state="leaking", method="adaptive"))
    field = GridField(np.linspace(-2e-6, 1e-6, 512 * 256).reshape(512, 256), (1e-6, 5e-7), True)
    shown = "GridField(512 x 256, -2e-06 to 1e-06, spacing=(1e-06, 5e-07), periodic=True)"
    assert repr(field) == shown
