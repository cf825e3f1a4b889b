"""Closed forms against quadrature, series, limits, finite differences and one another."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import comb, gamma

from fem_seal.errors import InvalidInput
from fem_seal.theory import closed_forms

approx = partial(pytest.approx, rel=1e-12)

conductivity = st.floats(1e-3, 1e3)


@pytest.mark.parametrize("a", [0.0, 0.3, 0.9])
def test_cosine_channel_by_quadrature(a):
    def mean(power):
        return quad(lambda t: (1 + a * np.cos(t)) ** power, 0, np.pi, epsabs=0, epsrel=1e-11)[0] / (
            np.pi
        )

    assert closed_forms.cosine_channel(a, across=True) == approx(1 / mean(-3), rel=1e-9)
    assert closed_forms.cosine_channel(a, across=False) == approx(mean(3), rel=1e-9)


def test_channels_close_where_they_touch():
    """The piecewise linear one is held against finite differences: finite_difference/."""
    assert closed_forms.piecewise_linear_channel(np.array([1.0, 0.0, 1.0])) == 0
    assert closed_forms.cosine_channel(1.0, across=True) == 0
    with pytest.raises(InvalidInput, match="amplitude"):
        closed_forms.cosine_channel(1.1, across=True)


@given(conductivity, conductivity)
def test_four_phases_include_layers_and_the_checkerboard(a, b):
    """Equal neighbours are layers across or along the flow; equal diagonals a checkerboard."""
    series, parallel = 2 * a * b / (a + b), (a + b) / 2
    assert closed_forms.four_phase_checkerboard(a, b, b, a) == approx((series, parallel))
    assert closed_forms.four_phase_checkerboard(a, a, b, b) == approx((parallel, series))
    board = closed_forms.checkerboard(a, b)
    assert closed_forms.four_phase_checkerboard(a, b, a, b) == approx((board, board))


@given(conductivity, conductivity, conductivity, conductivity)
def test_four_phases_obey_duality(a, b, c, d):
    """Kxx(K) Kyy(1/K) = 1 (Keller 1964)."""
    forward, _ = closed_forms.four_phase_checkerboard(a, b, c, d)
    _, crosswise = closed_forms.four_phase_checkerboard(1 / a, 1 / b, 1 / c, 1 / d)
    assert forward * crosswise == approx(1, rel=1e-12)


def rayleigh(f, order=24):
    """Conductivity of a square array of impermeable discs: Rayleigh's equations to high order.

    Around a disc the pressure is Σ (A_l r^l + B_l r^-l) cos lθ with A_l = B_l a^-2l at its rim;
    A_l = δ_l1 - Σ_m C(m + l - 1, l) S_(m+l) B_m with the lattice sums S_n, and K = 1 - 2π B_1.
    """
    a = np.sqrt(f / np.pi)
    i, j = np.meshgrid(np.arange(-60, 61), np.arange(-60, 61))
    z = (i + 1j * j)[(i != 0) | (j != 0)]
    lattice_sum = {2: np.pi, 4: gamma(0.25) ** 8 / (960 * np.pi**2)}
    odd = np.arange(1, order, 2)
    matrix = np.diag(a ** (-2.0 * odd))
    for r, k in enumerate(odd):
        for c, m in enumerate(odd):
            n = int(m + k)
            if n not in lattice_sum:
                lattice_sum[n] = float((z**-n).sum().real) if n % 4 == 0 else 0.0
            matrix[r, c] += comb(m + k - 1, k, exact=True) * lattice_sum[n]
    B = np.linalg.solve(matrix, (odd == 1).astype(float))
    return 1 - 2 * np.pi * B[0]


@pytest.mark.parametrize(
    ("radius", "tolerance"), [(0.1, 1e-12), (0.2, 1e-9), (0.3, 1e-7), (0.4, 1e-4)]
)
def test_disc_array_against_the_full_multipole_series(radius, tolerance):
    """The closed form stops at order f^8: the tolerances follow its next terms, about f^12."""
    f = np.pi * radius**2
    assert closed_forms.disc_array(f) == approx(rayleigh(f), rel=tolerance)
    with pytest.raises(InvalidInput, match="π/4"):
        closed_forms.disc_array(0.8)


def test_smooth_checkerboard_shifted_by_half_a_period_is_its_reciprocal():
    x, y = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 7), indexing="ij")
    K = closed_forms.smooth_checkerboard(x, y, 3.0)
    assert closed_forms.smooth_checkerboard(x + 0.5, y, 3.0) * K == approx(np.ones((9, 7)))
