"""Bounds of films from the flow through another one on the same mesh."""

import numpy as np
import pytest
from project import leak_rate

from fem_seal.film import GridFilm
from fem_seal.film.law import leak_rate_of_square
from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, self_affine

UNIT = {"viscosity": 1.0, "pressure_drop": 1.0}


def film(values, sides="periodic"):
    return GridFilm(GridField(values, (1.0, 1.0), periodic=True), sides)


def rough(seed, contact=0.2, n=32):
    """Smooth random gap with a part of it in contact."""
    spectrum = Spectrum(0.8, n / 2, 4.0)
    heights = self_affine(spectrum, (n, n), (n, n), rms_height=1.0, seed=seed).values
    return np.maximum(heights - np.quantile(heights, contact), 0)


def solved(one, **more):
    """Leak rate, and the flow on its last mesh."""
    flows = []
    leak = leak_rate(one, **UNIT, keep=flows.append, **more)
    return leak, flows[-1]


def test_own_bounds():
    """For the film itself they are those of its last level."""
    one = film(rough(1))
    leak, flow = solved(one)
    unit = leak_rate_of_square(one.largest_gap, **UNIT)
    (above,), (below,) = flow.conductances_below([one]), flow.resistances_above([one])
    assert unit * above == pytest.approx(leak.upper, rel=1e-9)
    assert unit / below == pytest.approx(leak.lower, rel=1e-9)


@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_uniform_gaps(sides):
    """The pressure of one uniform gap is that of all others: Q ~ g³ exactly."""
    gap = np.full((16, 16), 2.0)
    one = film(gap, sides)
    _, flow = solved(one)
    others = [one, film(0.5 * gap, sides), film(0.1 * gap, sides)]
    cubes = np.array([1, 0.5, 0.1]) ** 3
    length, width = one.size
    assert flow.conductances_below(others) * length / width == pytest.approx(cubes, rel=1e-11)
    larger = [one, film(2 * gap, sides), film(3 * gap, sides)]
    cubes = np.array([1, 2, 3]) ** -3.0
    assert flow.resistances_above(larger) * width / length == pytest.approx(cubes, rel=1e-11)


@pytest.mark.parametrize("seed", range(4))
def test_bounds_of_other_films_hold(seed):
    """Smaller and larger gaps, some with more contact and some with less, solved by themselves."""
    gap = rough(seed)
    one = film(gap)
    _, flow = solved(one)
    unit = leak_rate_of_square(one.largest_gap, **UNIT)
    smaller = [film(np.maximum(gap - 0.02 * k, 0)) for k in (1, 3)]
    larger = [film(gap + 0.05), film(1.3 * gap)]
    for other, upper in zip(smaller, flow.conductances_below([one, *smaller])[1:], strict=True):
        assert unit * upper >= leak_rate(other, **UNIT).lower
    for other, resistance in zip(larger, flow.resistances_above([one, *larger])[1:], strict=True):
        assert unit / resistance <= leak_rate(other, **UNIT).upper


@pytest.mark.parametrize("seed", range(3))
def test_bounds_are_convex_along_a_line(seed):
    """Both integrals are convex along a line of gaps: the middle is not above the chord."""
    gap = rough(seed)
    one = film(gap)
    _, flow = solved(one)
    fall = 0.3 * gap * np.random.default_rng(seed).random(gap.shape)
    below = flow.conductances_below([one, *(film(gap - s * fall) for s in (0.5, 1))])
    # Contact opens in these gaps, and stays contact for the stream function.
    rise = fall + 1e-3
    above = flow.resistances_above([one, *(film(gap + s * rise) for s in (0.5, 1))])
    for start, middle, end in (below, above):
        assert middle <= 0.5 * (start + end) * (1 + 1e-12)
        assert end < middle < start


def test_bounds_are_second_order():
    """The pressure of a film is stationary: what a nearby one conducts is known to second order."""
    gap = rough(2, contact=0.0, n=16) + 1.0
    one = film(gap)
    leak, flow = solved(one, rtol=1e-3)
    unit = leak_rate_of_square(one.largest_gap, **UNIT)
    pattern = np.cos(np.arange(16) / 3.0)[:, None] ** 2
    errors = []
    for size in (0.4, 0.2):
        other = film(gap * (1 - size * pattern))
        exact = leak_rate(other, **UNIT, rtol=1e-3).value
        bound = flow.conductances_below([one, other])[1] * unit
        errors.append(bound / exact - leak.upper / leak.value)
    # A quotient of 4 would be first seen at smaller sizes; first order would give 2.
    assert errors[0] / errors[1] > 3
