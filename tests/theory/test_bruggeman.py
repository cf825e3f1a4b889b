"""Bruggeman's effective medium: equation, limits and percolation threshold."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from project import refused_calls

from fem_seal.theory.bruggeman import effective_conductivity, effective_dimension

approx = partial(pytest.approx, rel=1e-12)


@given(
    st.integers(0, 10_000),
    st.floats(1.05, 6.0),
    st.sampled_from([0.0, 1.0, 10.0, 40.0]),
    st.just(0.0) | st.floats(0, 1),
)
def test_root_solves_the_equation(seed, n, decades, contact):
    """Of one gap and of many, with and without contact; from the threshold on nothing flows.

    The residual changes with ln K by n²/4 at most; the bisection ends at 1e-13 in ln K.
    """
    k = 10 ** np.random.default_rng(seed).uniform(-decades, 0, 50)
    K = float(effective_conductivity(k, dimension=n, contact=contact))
    open_part = (1 - contact) * np.mean((k - K) / (k + (n - 1) * K))
    assert 0 <= K <= k.max()
    if K > 0:
        assert open_part == approx(contact / (n - 1), rel=0, abs=1e-12 * n)
    else:
        assert contact >= (n - 1) / n - 1e-12


def test_dimensions_one_and_infinity_are_series_and_parallel():
    k = np.random.default_rng(2).uniform(1, 3, 20)
    assert effective_conductivity(k, dimension=1) == approx(1 / np.mean(1 / k), rel=1e-12)
    # In n dimensions 1/n of the variance over the mean, 0.08 here, is left.
    assert effective_conductivity(k, dimension=1e9) == approx(np.mean(k), rel=1e-8)
    assert effective_conductivity(np.append(k, 0.0), dimension=1) == 0


@pytest.mark.parametrize("least", [1e-30, 1e-250, 1e-310, 5e-324])
@pytest.mark.parametrize("n", [1.0, 1.5, 1.72])
def test_denormal_conductivities_act_like_contact(least, n):
    """Part of the area has k -> 0: it acts like contact and raises no overflow.

    Persson's gap distribution has such parts, whose cubed gaps are denormal.
    """
    few, many = (np.array([1.0] * (10 - closed) + [least] * closed) for closed in (1, 9))
    with np.errstate(all="raise", under="ignore"):
        assert effective_conductivity(many, dimension=n, contact=0.5) == 0.0
        K = effective_conductivity(few, dimension=n)
    # A part c = 0.1 with k -> 0: K = 1 - c n/(n - 1), or K -> 0 beyond the threshold.
    exact = max(0.0, 1 - 0.1 * n / (n - 1)) if n > 1 else 0.0
    tiny = 20 * max(least, np.finfo(float).tiny)
    assert pytest.approx(exact, rel=1e-12, abs=tiny) == K


def test_effective_dimension_of_the_letter():
    """2 at no contact; 1/(1 - A*) at A*, printed as 1.72 for 0.42; percolates at A* by itself."""
    assert effective_dimension(0.0) == 2
    assert effective_dimension(0.42) == approx(1 / 0.58)
    assert round(effective_dimension(0.42), 2) == 1.72
    assert effective_dimension(0.3, threshold=0.5) == 2
    for area, conducts in ((0.419, True), (0.421, False)):
        n = effective_dimension(area)
        assert (effective_conductivity([1.0], dimension=n, contact=area) > 0) == conducts


test_bad_input = refused_calls(
    (lambda: effective_conductivity([1.0, -1.0]), "conductivities"),
    (lambda: effective_conductivity([1.0], dimension=0.5), "dimension"),
    (lambda: effective_conductivity([1.0], contact=1.5), "contact"),
    (lambda: effective_conductivity([1.0], weights=[0.0]), "weights"),
    (lambda: effective_dimension(1.2), "A/A0"),
)
