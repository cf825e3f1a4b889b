"""What holds for every gap, however it is solved: finite differences exactly, bounds as bounds.

Finite differences are a network of conductances, to which Rayleigh's monotonicity law applies to
rounding. Two brackets [l, u] and [l', u'] of leak rates Q <= Q' obey l <= u' whatever the mesh.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem_seal.film import GridFilm
from fem_seal.finite_difference import solve
from fem_seal.finite_difference.links import LINKS
from fem_seal.flow import Limits, leak_rate
from fem_seal.grid import GridField

FLUID = {"viscosity": 1 / 12, "pressure_drop": 1.0}
ROUNDING = 1e-9  # of star-mesh elimination over contrasts up to 1e9
EXAMPLES = settings(max_examples=6, deadline=None, derandomize=True)


@st.composite
def gaps(draw, contact=True):
    """Square gaps over three decades with up to two thirds of contact."""
    n = draw(st.integers(3, 7))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    values = 10 ** rng.uniform(-3, 0, (n, n))
    if contact:
        values[rng.random((n, n)) < draw(st.floats(0, 0.65))] = 0.0
    return values


def field(values):
    return GridField(values, (1 / len(values), 1 / len(values)))


def differences(values, links="harmonic", sides="wall"):
    return solve(
        GridFilm(field(values), sides=sides, representation="constant"), links=links, **FLUID
    ).value


def bracket(values, representation="constant", sides="wall"):
    flow = leak_rate(
        GridFilm(field(values), representation=representation, sides=sides),
        rtol=0.1,
        limits=Limits(unknowns=150),
        every_dual=True,
        **FLUID,
    )
    return flow.lower, flow.upper


def at_most(smaller, larger):
    """Whether the leak rates behind two brackets can be in this order."""
    return smaller[0] <= larger[1]


@given(gaps(), st.integers(0, 2**32 - 1), st.sampled_from(sorted(LINKS)))
@EXAMPLES
def test_adding_contact_never_raises_the_leak_rate(values, seed, links):
    more = np.where(np.random.default_rng(seed).random(values.shape) < 0.1, 0.0, values)
    before, after = differences(values, links), differences(more, links)
    assert after <= before * (1 + ROUNDING)
    for representation in ("linear", "constant"):
        assert at_most(bracket(more, representation), bracket(values, representation))


@given(gaps(), st.integers(0, 2**32 - 1), st.sampled_from(sorted(LINKS)))
@EXAMPLES
def test_monotone_in_the_gap(values, seed, links):
    wider = values * (1 + np.random.default_rng(seed).random(values.shape))
    assert differences(values, links) <= differences(wider, links) * (1 + ROUNDING)
    for representation in ("linear", "constant"):
        assert at_most(bracket(values, representation), bracket(wider, representation))


@given(gaps(), st.floats(-6, 6), st.sampled_from(sorted(LINKS)))
@EXAMPLES
def test_cube_of_the_gap(values, decades, links):
    s = 10.0**decades
    expected = s**3 * differences(values, links)
    assert differences(s * values, links) == pytest.approx(expected, rel=ROUNDING, abs=0)
    for one, other in zip(bracket(values), bracket(s * values), strict=True):
        assert other == pytest.approx(s**3 * one, rel=ROUNDING, abs=0)


@given(gaps(), st.sampled_from(["wall", "periodic"]), st.sampled_from(sorted(LINKS)))
@EXAMPLES
def test_mirrors(values, sides, links):
    """Along the flow, which turns it round, and across it."""
    for axis in (0, 1):
        image = np.flip(values, axis)
        same = pytest.approx(differences(values, links, sides), rel=ROUNDING, abs=0)
        assert differences(image, links, sides) == same
        one, other = bracket(values, sides=sides), bracket(image, sides=sides)
        assert at_most(one, other)
        assert at_most(other, one)


@given(gaps(contact=False))
@EXAMPLES
def test_duality(values):
    """Q_x[K] Q_y[1/K] = 1 on a square with walls (Keller 1964): transposed and inverted."""
    lower, upper = bracket(values)
    turned_lower, turned_upper = bracket(1 / values.T)
    assert lower * turned_lower <= 1 <= upper * turned_upper


@given(gaps(), st.sampled_from(sorted(LINKS)))
@EXAMPLES
def test_walls_let_no_more_through_than_periodic_sides(values, links):
    """Without the walls there are more links, and more admissible fluxes."""
    assert differences(values, links) <= differences(values, links, "periodic") * (1 + ROUNDING)
    assert at_most(bracket(values), bracket(values, sides="periodic"))
