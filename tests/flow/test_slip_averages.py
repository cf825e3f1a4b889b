"""Conductivities that bound that of a gas that slips, and their means over triangles."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_averages import mean_over_triangle

from fem_seal.film.law import Conductivity, bounding_law, mean_pressure_law
from fem_seal.flow.averages import (
    conductivity_of_corners,
    inverse_square_of_corners,
    resistivity_of_corners,
)
from fem_seal.fluid import Slip

GAPS = [
    *((1, 2, 3), (1e-6, 1, 2), (1e-6, 1e-3, 1), (1, 1, 1.5), (2, 1e-4, 1e-4), (1, 7, 7)),
    # On both sides of where Gauss points take over, and nearly the same.
    *((1, 1.1, 1.25 - 1e-9), (1, 1.1, 1.25 + 1e-9), (1, 1, 1.25 + 1e-9), (1, 1 + 1e-9, 1 + 2e-9)),
]
GAP = st.floats(1e-4, 1.0)


@pytest.mark.parametrize("gaps", GAPS)
def test_mean_of_the_inverse_square(gaps):
    """Against numerical integration asked for 1e-11; nearly the same gaps against their centre."""
    found = float(inverse_square_of_corners(*(np.array([float(g)]) for g in gaps))[0])
    if np.ptp(gaps) < 1e-6:
        exact = np.mean(gaps) ** -2  # but for the square of the relative difference
    else:
        exact = mean_over_triangle(lambda g: g**-2, gaps)
    assert found == pytest.approx(exact, rel=1e-9)


def test_inverse_square_of_equal_gaps_in_any_order_and_at_contact():
    a, b, c = np.random.default_rng(0).uniform(0.5, 2.0, (3, 50))
    found = inverse_square_of_corners(a, b, c)
    np.testing.assert_array_equal(inverse_square_of_corners(c, a, b), found)
    np.testing.assert_allclose(inverse_square_of_corners(a, a, a), a**-2.0, rtol=1e-14)
    assert np.isinf(inverse_square_of_corners(0 * a, b, c)).all()


@given(st.tuples(GAP, GAP, GAP), st.floats(0, 1))
def test_means_under_slip(gaps, alpha):
    """The mean of α g³ + β g² is exact; that of its inverse is bounded from above.

    The bound 1/(1/X + 1/Y), with X and Y the means of 1/(α g³) and 1/(β g²), is exact if one of
    them is zero or the gap is the same, and never above the smaller of X and Y.
    """
    law = Conductivity((alpha, 1 - alpha))
    corners = [np.array([g]) for g in gaps]
    exact = [
        mean_over_triangle(function, gaps) if np.ptp(gaps) > 1e-6 else function(np.mean(gaps))
        for function in (
            lambda g: alpha * g**3 + (1 - alpha) * g**2,
            lambda g: 1 / (alpha * g**3 + (1 - alpha) * g**2),
        )
    ]
    assert conductivity_of_corners(law, *corners)[0] == pytest.approx(exact[0], rel=1e-8)
    bound = resistivity_of_corners(law, *corners)[0]
    ratio = bound / exact[1]
    assert ratio >= 1 - 1e-8
    single = [
        resistivity_of_corners(Conductivity(pair), *corners)[0]
        for pair in ((alpha, 0.0), (0.0, 1 - alpha))
        if max(pair) > 0
    ]
    assert bound <= min(single) * (1 + 1e-8)
    if alpha in (0, 1):
        assert ratio == pytest.approx(1, rel=1e-8)


PRESSURES = st.tuples(st.floats(0.0, 0.999), st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))


@given(PRESSURES, st.tuples(GAP, GAP, st.floats(0, 1), st.floats(0, 1)))
def test_bounding_laws_bound_all_pressures(pressures, interval):
    """On an interval of gaps, for all pressures between the two and s, nowhere wider on a part."""
    p_out, B, s = pressures
    low, high, first, second = interval
    low, high = np.array([min(low, high)]), np.array([max(low, high)])
    slip = Slip(1.0, p_out, B)
    law = bounding_law(slip, 1.0, s, s)
    scale = (slip.mean_pressure + s) / (slip.mean_pressure + B)
    part = np.sort(low + (high - low) * np.array([first, second]))[:, None]
    g = np.linspace(*part, 7)
    above, below = (
        [cubic * g**3 + square * g**2 for cubic, square in (c.coefficients(*i) for i in spans)]
        for c, spans in (
            (law.above, ((low, high), part, (g, g))),
            (law.below, ((low, high), part, (g, g))),
        )
    )
    room = 1 + 1e-12
    for p in np.linspace(p_out, 1.0, 5):
        kappa = scale * (p * g**3 + B * g**2) / (p + s)
        assert (kappa <= above[2] * room).all()
        assert (kappa >= below[2] / room).all()
    for outer, inner in pairwise(above):
        assert (inner <= outer * room).all()
    for outer, inner in pairwise(below):
        assert (inner >= outer / room).all()
    at_mean = mean_pressure_law(slip, 1.0)
    assert (at_mean.above.of_gap(g) <= above[2] * room).all()
    assert at_mean.above.of_gap(1.0) == pytest.approx(1.0)
