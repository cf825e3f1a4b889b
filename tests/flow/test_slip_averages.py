"""Conductivities that bound that of a gas that slips, and their means over triangles."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_averages import mean_over_triangle

from fem_seal.errors import Inconsistent
from fem_seal.film.law import CUBE, Conductivity, FilmLaw, mean_pressure_law
from fem_seal.film.slip_bounds import PressureWeight, bounding_law
from fem_seal.flow import averages
from fem_seal.flow.averages import (
    conductivity_of_corners,
    inverse_cube_of_corners,
    inverse_square_of_corners,
    resistivity_of_corners,
)
from fem_seal.fluid import Slip
from fem_seal.rarefied import FIRST_ORDER, LEAST_ACCOMMODATION, kinetic

GAPS = [
    *((1, 2, 3), (1e-6, 1, 2), (1e-6, 1e-3, 1), (1, 1, 1.5), (2, 1e-4, 1e-4), (1, 7, 7)),
    # On both sides of where Gauss points take over, and nearly the same.
    *((1, 1.1, 1.25 - 1e-9), (1, 1.1, 1.25 + 1e-9), (1, 1, 1.25 + 1e-9), (1, 1 + 1e-9, 1 + 2e-9)),
    # With (ε, 1, 1) the digits of 1 + (ε - 1) are lost.
    *((1.3, 1.3, 1.3), (1e-15, 1, 1), (1e-17, 1, 1), (1e-40, 1, 1)),
]
GAP = st.floats(1e-4, 1.0)
# Of gaps that differ by less than 1e-5 the mean of a function is that of their centre, but for a
# few times the square of it; at larger differences Gauss points lose five of sixteen digits.
SAME = 1e-9


@pytest.mark.parametrize("gaps", GAPS)
@pytest.mark.parametrize(
    ("mean", "power"), [(inverse_cube_of_corners, -3), (inverse_square_of_corners, -2)]
)
def test_means_of_inverse_powers(gaps, mean, power):
    """Against Gauss points; nearly the same gaps against their centre. The corners may stand in
    any order, and with one in contact the mean is infinite."""
    corners = [np.array([float(g)]) for g in gaps]
    (found,) = mean(*corners)
    assert mean(*corners[::-1]) == mean(*corners[1:], corners[0]) == found
    assert np.isinf(mean(0 * corners[0], *corners[1:]))
    if np.ptp(gaps) < 1e-6:
        exact = np.mean(gaps) ** power  # but for the square of the relative difference
    else:
        exact = mean_over_triangle(lambda g: g**power, gaps)
    assert found == pytest.approx(exact, rel=1e-13)


THREE = np.array([0.0, 0.5, 1.0])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Conductivity(THREE[[0, 2, 1]], THREE), "ascend from 0 to 1"),
        (lambda: Conductivity(THREE[1:], THREE[1:]), "ascend from 0 to 1"),
        (lambda: Conductivity(THREE[[0, 2]], THREE), "one finite value at each"),
        (lambda: Conductivity(THREE, THREE, np.full(3, np.nan)), "one finite value at each"),
        (lambda: Conductivity(THREE, np.sqrt(THREE)), "not convex"),
        (lambda: Conductivity(THREE, THREE, THREE**2), "not concave"),
        (lambda: FilmLaw(Conductivity(THREE, THREE, np.sqrt(THREE)), CUBE.lower), "concave part"),
        (lambda: PressureWeight(1.0, THREE, THREE), "is positive"),
        (lambda: PressureWeight(1.0, 1 - THREE, THREE + 1), "ascending"),
    ],
)
def test_laws_that_would_not_bound(make, words):
    with pytest.raises(Inconsistent, match=words):
        make()


def line(cubic, square):
    """The conductivity α g³ + β g²."""
    return Conductivity(np.array([0.0, 1.0]), np.array([square, square + cubic]))


@given(st.tuples(GAP, GAP, GAP), st.floats(0, 1))
def test_means_under_slip(gaps, alpha):
    """The mean of α g³ + β g² is exact; that of its inverse is bounded from above.

    The bound 1/(1/X + 1/Y), with X and Y the means of 1/(α g³) and 1/(β g²), is exact if one of
    them is zero or the gap is the same, and never above the smaller of X and Y.
    """
    law = line(alpha, 1 - alpha)
    corners = [np.array([g]) for g in gaps]
    exact = [
        mean_over_triangle(function, gaps)
        if np.ptp(gaps) > 1e-5 * max(gaps)
        else function(np.mean(gaps))
        for function in (
            lambda g: alpha * g**3 + (1 - alpha) * g**2,
            lambda g: 1 / (alpha * g**3 + (1 - alpha) * g**2),
        )
    ]
    assert conductivity_of_corners(law, *corners)[0] == pytest.approx(exact[0], rel=SAME)
    bound = resistivity_of_corners(law, *corners)[0]
    ratio = bound / exact[1]
    assert ratio >= 1 - SAME
    single = [
        resistivity_of_corners(line(*pair), *corners)[0]
        for pair in ((alpha, 0.0), (0.0, 1 - alpha))
        if max(pair) > 0
    ]
    assert bound <= min(single) * (1 + SAME)
    if alpha in (0, 1):
        assert ratio == pytest.approx(1, rel=SAME)


PRESSURES = st.tuples(st.floats(0.0, 0.999), st.floats(-3, 3), st.floats(-3, 3))
COEFFICIENTS = st.sampled_from([FIRST_ORDER, kinetic(1.0), kinetic(LEAST_ACCOMMODATION)])
# A table is a sum of up to a thousand terms.
ROUNDING = 1e-11


def of_line(coefficients, gap):
    """α g³ + β g²."""
    cubic, square = coefficients
    return cubic * gap**3 + square * gap**2


TILT = st.sampled_from([0.0, -2.0, 0.7])


def weight_of(slip, g_0, tilt):
    """w(p) = c(g₀ p/B), or that times the exponential of a kinked function."""
    weight = PressureWeight.of_gap(slip, 1.0, g_0)
    if tilt == 0:
        return weight
    pressures = np.linspace(slip.outlet_pressure, slip.inlet_pressure, 4)
    return weight.times(pressures, tilt * np.array([0.0, 0.5, 0.6, 1.0]))


@settings(max_examples=20)
@given(COEFFICIENTS, PRESSURES, st.tuples(GAP, GAP, st.floats(0, 1), st.floats(0, 1)), TILT)
def test_bounding_laws_bound_all_pressures(coefficient, pressures, interval, tilt):
    """On an interval of gaps, for all pressures and weights; from above nowhere wider on a part."""
    p_out, B, g_0 = pressures[0], 10 ** pressures[1], 10 ** pressures[2]
    low, high, first, second = interval
    low, high = np.array([min(low, high)]), np.array([max(low, high)])
    slip = Slip(1.0, p_out, B, coefficient)
    unit = float(coefficient(slip.mean_pressure / B))
    weight = weight_of(slip, g_0, tilt)
    law = bounding_law(slip, 1.0, weight, weight, unit)
    part = np.sort(low + (high - low) * np.array([first, second]))[:, None]
    g = np.linspace(*part, 7)
    above = [of_line(law.upper.upper_line(*span), g) for span in ((low, high), part, (g, g))]
    below = [of_line(law.lower.lower_line(*span), g) for span in ((low, high), part, (g, g))]
    room = 1 + ROUNDING
    for p in np.linspace(p_out, 1.0, 9):
        kappa = g**2 * coefficient(g * p / B) * weight.mean / weight(p) / unit
        for bound in above:
            assert (kappa <= bound * room).all()
        for bound in below:
            assert (bound > 0).all()
            assert (kappa >= bound / room).all()
    for outer, inner in pairwise(above):
        assert (inner <= outer * room).all()
    at_mean = mean_pressure_law(slip, 1.0)
    assert (at_mean.upper.of_gap(g) <= above[2] * room).all()
    assert at_mean.upper.of_gap(1.0) == pytest.approx(1.0)


@settings(max_examples=20)
@given(COEFFICIENTS, PRESSURES, st.tuples(GAP, GAP, GAP), TILT)
def test_means_of_bounding_laws(coefficient, pressures, gaps, tilt):
    """Means on a triangle hold for all pressures; those of its quarters together are no more."""
    p_out, B, g_0 = pressures[0], 10 ** pressures[1], 10 ** pressures[2]
    slip = Slip(1.0, p_out, B, coefficient)
    weight = weight_of(slip, g_0, tilt)
    law = bounding_law(slip, 1.0, weight, weight, 1.0)
    a, b, c = corners = np.array(gaps)[:, None]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    quarters = np.hstack([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]])
    means = (
        conductivity_of_corners(law.upper, *corners),
        resistivity_of_corners(law.lower, *corners),
    )
    parts = (
        conductivity_of_corners(law.upper, *quarters),
        resistivity_of_corners(law.lower, *quarters, span=averages.extremes(*corners)),
    )
    for mean, part in zip(means, parts, strict=True):
        assert part.mean() <= mean[0] * (1 + ROUNDING)
    # Midpoint rules on parts 32 times smaller are below the mean of a convex function of the gap,
    # and above that of a concave one, by far less than the room here.
    weights = (np.indices((33, 33)).reshape(2, -1).T + 1 / 3) / 33
    inside = weights[weights.sum(axis=1) < 1]
    g = a + (b - a) * inside[:, :1].T + (c - a) * inside[:, 1:].T
    # Where the gap is the same nothing is lost but what the table of the smallest one allows for.
    alone = [corners[0]] * 3
    mean = conductivity_of_corners(law.upper, *alone) * resistivity_of_corners(law.lower, *alone)
    lost = law.upper.of_gap(corners[0]) / law.lower.of_gap(corners[0])
    assert mean == pytest.approx(lost, rel=1e-6)
    if max(gaps) < 3 * min(gaps):
        assert law.upper.of_gap(g).mean() <= means[0][0] * 1.01
        assert (1 / law.lower.of_gap(g)).mean() <= means[1][0] * 1.01
