"""Poiseuille coefficients: limits, published values, and the integral equation solved otherwise."""

from itertools import pairwise
from math import pi, sqrt

import numpy as np
import pytest
from scipy.integrate import quad

from fem_seal.errors import Inconsistent
from fem_seal.rarefied import (
    FIRST_ORDER,
    LARGEST_RAREFACTION,
    LEAST_RAREFACTION,
    PoiseuilleCoefficient,
    flow_rate,
    kinetic,
)


def abramowitz(n: int, y: np.ndarray | float) -> np.ndarray:
    """T_n(y) = ∫ c^n exp(-c² - y/c) dc from 0 to infinity, by the trapezoidal rule in ln c."""
    s = np.arange(-40, 3, 0.1)
    y = np.asarray(y)[..., None]
    return 0.1 * np.exp((n + 1) * s - np.exp(2 * s) - y * np.exp(-s)).sum(axis=-1)


def by_nystrom(delta: float, accommodation: float, points: int) -> float:
    """G from the integral equation (Cercignani and Daneri 1963) at Gauss points, walls as mirrors.

    u(x) = ∫ Σ_k r^k T_-1(δ |x - x_k|) (δ u + 1/2) ds/√π, with x_k the images of s in both walls.
    T_-1 is infinite at 0 as a logarithm: ∫ T_-1 (f(s) - f(x)) ds + f(x) ∫ T_-1 ds, T_-1 = -T_0'.
    """
    nodes, weights = np.polynomial.legendre.leggauss(points)
    x, weights, r = (nodes + 1) / 2, weights / 2, 1 - accommodation

    def kernel(distance):
        return abramowitz(-1, delta * np.abs(distance))

    s = x[None, :]
    mirrored = np.zeros((points, points))
    for k in range(1, 40):
        if r**k < 1e-6:
            break
        # After k reflections, first at the left and first at the right wall.
        left = -s - (k - 1) if k % 2 else s - k
        right = 1 + (1 - s) + (k - 1) if k % 2 else s + k
        mirrored += r**k * (kernel(x[:, None] - left) + kernel(right - x[:, None]))
    direct = kernel(x[:, None] - s + np.eye(points))
    np.fill_diagonal(direct, 0.0)
    whole = sqrt(pi) - abramowitz(0, delta * x) - abramowitz(0, delta * (1 - x))
    matrix = weights * direct
    matrix += np.diag(whole / delta - matrix.sum(axis=1)) + weights * mirrored
    matrix /= sqrt(pi)
    u = np.linalg.solve(np.eye(points) - delta * matrix, matrix.sum(axis=1) / 2)
    return 2 * weights @ u


@pytest.mark.parametrize(
    ("delta", "accommodation"), [(0.1, 1.0), (1.0, 1.0), (3.0, 1.0), (1.0, 0.6)]
)
def test_integral_equation(delta, accommodation):
    """Gauss points err as 1/n² at the logarithm of the kernel: 24 and 48 of them, extrapolated.

    The finer ones err by a third of the change, and so may the extrapolation; `flow_rate` by 1e-4.
    """
    coarse, fine = (by_nystrom(delta, accommodation, n) for n in (24, 48))
    exact = (4 * fine - coarse) / 3
    error = abs(fine - coarse) / 3
    assert error < 1e-4 * fine  # as small as what is tested, or nothing is shown
    assert flow_rate(delta, accommodation) == pytest.approx(exact, abs=1e-4 * fine + error)


@pytest.mark.parametrize(
    ("accommodation", "slip"),
    [(1.0, 1.0162), (0.1, 17.103)],
)
def test_slip_regime(accommodation, slip):
    """G = δ/6 + the viscous slip coefficient of the BGK model + a/δ + b/δ².

    1.0162: S. Albertoni, C. Cercignani, L. Gotusso, Phys. Fluids 6, 993 (1963); 17.103: S. K.
    Loyalka, N. Petrellis, T. S. Storvick, Phys. Fluids 18, 1094 (1975). The three unknowns from
    δ = 20, 40 and 80, where what is left is below exp(-20) of the slip; the solution errs by 1e-4.
    """
    delta = np.array([20.0, 40.0, 80.0])
    beyond = [flow_rate(d, accommodation) - d / 6 for d in delta]
    found = np.linalg.solve(np.stack([delta**0, 1 / delta, 1 / delta**2], axis=1), beyond)
    assert found[0] == pytest.approx(slip, rel=1e-3)


@pytest.mark.parametrize("accommodation", [1.0, 0.4, 0.1])
def test_free_molecular_limit(accommodation):
    """G = f ln(1/δ)/√π + a constant for δ → 0, f = (2 - σ)/σ.

    Molecules that fly along the channel, until they collide, bring the logarithm.
    """
    delta, slip = 1e-6, (2 - accommodation) / accommodation
    rates = [flow_rate(d, accommodation) for d in (delta, 10 * delta)]
    slope = (rates[0] - rates[1]) / np.log(10) * sqrt(pi)
    assert slope == pytest.approx(slip, rel=5e-3)


@pytest.mark.parametrize("accommodation", [1.0, 0.7, 0.1])
def test_table(accommodation):
    """Recomputed entries; convex, so that its chords are above; at least first order."""
    c = kinetic(accommodation)
    slip = (2 - accommodation) / accommodation
    for delta in (2e-6, 3e-3, 0.2, 1.7, 11.0, 70.0, 900.0):
        exact = 2 / (sqrt(pi) * slip) * flow_rate(delta, accommodation)
        # Chords of 400 kinks: (ln q)²/8 t² c''/c = 8e-5; the spline of 48 values a tenth of that.
        assert c(delta / (3 * sqrt(pi) * slip)) == pytest.approx(exact, rel=1.2e-4)
    slopes = np.diff(c.c) / np.diff(c.t)
    assert (np.diff(slopes) > 0).all()
    assert slopes[-1] == pytest.approx(1.0, abs=1e-4)
    t = np.geomspace(1e-9, 1e9, 500)
    # The table errs by 1e-4.
    assert (c(t) >= FIRST_ORDER(t) * (1 - 1e-4)).all()
    # A gas that slips flows more than one that does not, whose c is t.
    assert (c(t) > t).all()
    # Flow grows with the gap: g² c(g p/B), also beyond the table.
    assert (np.diff(t**2 * c(t)) > 0).all()
    assert LEAST_RAREFACTION < 3 * sqrt(pi) * slip * c.kinks[0] < 2 * LEAST_RAREFACTION
    assert LARGEST_RAREFACTION > 3 * sqrt(pi) * slip * c.kinks[-1] > LARGEST_RAREFACTION / 2


@pytest.mark.parametrize(
    ("t", "c", "words"),
    [
        ([0.1, 1.0], [1.0, 2.0], "from t = 0 on"),
        ([0.0, 1.0], [-1.0, 2.0], "positive"),
        ([0.0, 1.0, 2.0, 4.0], [1.0, 2.0, 2.5, 5.0], "convex"),
        ([0.0, 1.0, 3.0, 4.0, 5.0], [1.0, 2.0, 4.0, 5.0, 6.0], "as near to each other"),
    ],
)
def test_what_the_bounds_of_slip_rest_on(t, c, words):
    with pytest.raises(Inconsistent, match=words):
        PoiseuilleCoefficient(np.array(t), np.array(c))


@pytest.mark.parametrize("c", [FIRST_ORDER, kinetic(1.0)])
def test_integral_and_its_inverse(c):
    for t in (1e-9, 1e-3, 0.3, 2.0, 1e4):
        ends = np.concatenate([[0.0], c.kinks[c.kinks < t], [t]])
        area = sum(quad(c, *piece)[0] for piece in pairwise(ends))
        assert c.integral(t) == pytest.approx(area, rel=1e-9)
        assert c.inverse_integral(c.integral(t)) == pytest.approx(t, rel=1e-12)
    assert c.inverse_integral(-1e-20) == 0
    assert FIRST_ORDER.integral(3.0) == pytest.approx(3 + 4.5)
