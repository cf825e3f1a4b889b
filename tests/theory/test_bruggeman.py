"""Bruggeman's effective medium: equation, limits and percolation threshold."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem_seal.errors import InvalidInput
from fem_seal.theory.bruggeman import (
    effective_conductivity,
    effective_dimension,
)

approx = partial(pytest.approx, rel=1e-12)

dimensions = st.floats(1.05, 6.0)


def residual(k, K, n, contact=0.0):
    return (1 - contact) * np.mean((k - K) / (k + (n - 1) * K)) - contact / (n - 1)


@given(st.integers(0, 10_000), dimensions, st.sampled_from([1.0, 10.0, 40.0]))
def test_root_solves_the_equation(seed, n, decades):
    k = 10 ** np.random.default_rng(seed).uniform(-decades, 0, 50)
    K = float(effective_conductivity(k, dimension=n))
    assert k.min() <= K <= k.max()
    # |d residual / d ln K| <= n²/4·... <= n; the bisection ends at 1e-13 in ln K.
    assert abs(residual(k, K, n)) < 1e-12 * n


@given(st.floats(0, 1), dimensions)
def test_two_phases_of_contact_and_one_gap(contact, n):
    """K/k = 1 - c n/(n-1), a straight line down to the threshold c = (n-1)/n."""
    K = float(effective_conductivity([2.0], dimension=n, contact=contact))
    assert approx(2 * max(0.0, 1 - contact * n / (n - 1)), rel=1e-12, abs=1e-14) == K


def test_dimensions_one_and_infinity_are_series_and_parallel():
    k = np.random.default_rng(2).uniform(1, 3, 20)
    assert effective_conductivity(k, dimension=1) == approx(1 / np.mean(1 / k), rel=1e-12)
    # In n dimensions 1/n of the variance over the mean, 0.08 here, is left.
    assert effective_conductivity(k, dimension=1e9) == approx(np.mean(k), rel=1e-8)
    assert effective_conductivity(np.append(k, 0.0), dimension=1) == 0


def test_two_dimensional_medium_is_self_dual():
    """n = 2: K(1/k) K(k) = 1, hence the geometric mean for ln k symmetric about its mean."""
    ln_k = np.random.default_rng(3).normal(scale=3, size=101)
    forward = effective_conductivity(np.exp(ln_k))
    assert forward * effective_conductivity(np.exp(-ln_k)) == approx(1, rel=1e-12)
    symmetric = np.exp(1.3 + np.concatenate([ln_k, -ln_k]))
    assert effective_conductivity(symmetric) == approx(np.exp(1.3), rel=1e-12)


def test_weak_disorder_to_second_order():
    """K = <k> - <δ²>/(n <k>) + O(δ³), exact for every isotropic medium (Landau and Lifshitz)."""
    delta = np.array([-1.0, 1.0])
    for n in (2.0, 3.0):
        for size in (1e-2, 1e-3):
            K = float(effective_conductivity(1 + size * delta, dimension=n))
            assert approx(1 - size**2 / n, abs=10 * size**4) == K


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


def test_bad_input():
    with pytest.raises(InvalidInput, match="conductivities"):
        effective_conductivity([1.0, -1.0])
    with pytest.raises(InvalidInput, match="dimension"):
        effective_conductivity([1.0], dimension=0.5)
    with pytest.raises(InvalidInput, match="contact"):
        effective_conductivity([1.0], contact=1.5)
    with pytest.raises(InvalidInput, match="weights"):
        effective_conductivity([1.0], weights=[0.0])
    with pytest.raises(InvalidInput, match="A/A0"):
        effective_dimension(1.2)
