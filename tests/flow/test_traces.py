"""Power traces: closed forms of the energies of cells that touch contact."""

import numpy as np
import pytest
from gaps import meshed, represented
from scipy.integrate import quad

from fem_seal.film.law import Conductivity
from fem_seal.flow.traces import POWER, resistivity, segment_moments
from fem_seal.grid import GridField
from fem_seal.mesh.nested import PIXEL

# Ratios of the gaps at the two ends: extremes, close to one, and about the switch at 4.
RATIOS = [1e-6, 1e-3, 0.1, 0.25 - 1e-9, 0.25 + 1e-9, 0.7, 1 - 1e-9, 1.0, 1 + 1e-12, 1.2]
RATIOS += [3.0, 4 - 1e-9, 4 + 1e-9, 10.0, 1e3, 1e6]


def moments_by_quadrature(b: float, c: float, power: int = 3) -> list[float]:
    """The three integrals over the gap x = b + (c-b)τ, whose logarithm is the variable."""
    if abs(c - b) < 1e-6 * b:
        # First order in (c-b)/b is exact to 1e-12: ∫ basis (1 - k (c-b)/b τ) / b^k dτ.
        d = power * (c - b) / b
        return [part / b**power for part in (1 / 3 - d / 12, 1 / 6 - d / 12, 1 / 3 - d / 4)]

    def integral(basis) -> float:
        def integrand(s):
            x = np.exp(s)
            return basis((c - x) / (c - b), (x - b) / (c - b)) * x ** (1 - power) / (c - b)

        return quad(integrand, np.log(b), np.log(c), epsrel=1e-12, epsabs=0, limit=400)[0]

    return [
        integral(lambda u, t: u * u),
        integral(lambda u, t: u * t),
        integral(lambda u, t: t * t),
    ]


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("b", [1.0, 1e-4])
@pytest.mark.parametrize("power", [3, 2])
def test_segment_moments(ratio, b, power):
    """Against numerical integration asked for 1e-12.

    At the switch, x = 4 or 1/4, the closed forms subtract terms eight times their result.
    """
    found = segment_moments(np.array([b]), np.array([b * ratio]), power)[:, 0]
    assert found == pytest.approx(moments_by_quadrature(b, b * ratio, power), rel=1e-11)


def power_trace(corners, values):
    """ψ and ∇ψ at (λ_b, λ_c) of the power trace ψ_0 + s^m ((1-τ) D_b + τ D_c), written out."""
    e_b, e_c = corners[1] - corners[0], corners[2] - corners[0]
    to_lambda = np.linalg.inv(np.stack([e_b, e_c], axis=1))  # rows: ∇λ_b, ∇λ_c
    D_b, D_c = values[1] - values[0], values[2] - values[0]

    def at(l_b, l_c):
        # s^m ((1-τ) D_b + τ D_c) = s^(m-1) (λ_b D_b + λ_c D_c), as s (1-τ) = λ_b and s τ = λ_c.
        s, line = l_b + l_c, l_b * D_b + l_c * D_c
        grown = (POWER - 1) * s ** (POWER - 2) * line
        psi = values[0] + s ** (POWER - 1) * line
        slope = [grown + s ** (POWER - 1) * D_b, grown + s ** (POWER - 1) * D_c]
        return psi, to_lambda.T @ slope

    return at


def integrate(function, degree=48):
    """∫ over the unit triangle in (λ_b, λ_c) by Gauss points on s = λ_b + λ_c and τ = λ_c/s."""
    x, w = np.polynomial.legendre.leggauss(degree)
    s, t = (part.ravel() for part in np.meshgrid((x + 1) / 2, (x + 1) / 2))
    return (np.outer(w, w).ravel() / 4 * s * function(s * (1 - t), s * t)).sum(axis=-1)


TRIANGLES = [
    [(0, 0), (1, 0), (0, 1)],  # the contact at the right angle
    [(0, 1), (0, 0), (1, 0)],  # at an end of the hypotenuse
    [(0, 0), (2, 0), (1, 3)],
    [(0.3, 0.1), (-1, 0.7), (-0.5, -2)],
]


def edge_trace(corners, values):
    """ψ and ∇ψ at (λ_b, λ_c) of ψ_0 + D λ_c^m: contact edge between corners 0 and 1."""
    to_lambda = np.linalg.inv(np.stack([corners[1] - corners[0], corners[2] - corners[0]], axis=1))
    D = values[2] - values[0]

    def at(l_b, l_c):
        psi = values[0] + D * l_c**POWER
        return psi, np.multiply.outer(to_lambda[1], D * POWER * l_c ** (POWER - 1))

    return at


@pytest.mark.parametrize("tiny", [3e-104, 1e-80])
def test_no_flow_through_gaps_beyond_double_precision(tiny):
    """Where the mean of 1/g³ is no number, ψ is constant: as 0 it would let any flow pass."""
    samples = np.ones((4, 4))
    samples[:, 1:3] = tiny
    gap = represented(GridField(samples, (1.0, 1.0)))
    mesh, values = meshed(gap)
    data = gap.cell_data(mesh, values)
    all_tiny = (samples[tuple((mesh.xy[mesh.cells] // PIXEL).T)] == tiny).all(axis=0)
    beyond = 1 / tiny > np.finfo(float).max ** (1 / 3)
    assert np.array_equal(data.blocked, all_tiny & beyond)
    assert (data.resistivity[~data.blocked, 0] > 0).all()


@pytest.mark.parametrize("corners", TRIANGLES)
@pytest.mark.parametrize(
    "gaps",
    [(0, 1, 1), (0, 0.2, 1), (0, 1, 0.6), (0, 0.05, 0.9), (0, 0, 1), (0, 0, 0.03)],
)
@pytest.mark.parametrize(("alpha", "beta"), [(1.0, 0.0), (0.0, 1.0), (0.7, 0.3), (0.99, 0.01)])
def test_energy_beside_contact(corners, gaps, alpha, beta):
    """∫|∇ψ|²/(α g³ + β g²) of the power trace is that of the linear function under the tensor, or
    no more than that where neither α nor β is zero; any corner of the cell may be the first.

    Then |∇ψ|² differs between directions, and one weight of the two tensors serves all: up to a
    third more was seen. In s the integrand is a polynomial, and in τ a quadratic over a cubic whose
    pole is at least 1/18 interval lengths away; 48 Gauss points then err by (1.6)^-96.
    """
    xy, gaps = np.array(corners, dtype=float), np.array(gaps, dtype=float)
    law = Conductivity(np.array([0.0, 1.0]), np.array([beta, alpha + beta]))
    turns = np.add.outer(np.arange(3), np.arange(3)) % 3
    g = gaps[turns]
    xx, xy_, yy = resistivity(xy[turns], 1.0, g, g == 0, np.full(3, np.inf), law).T
    e_b, e_c = xy[1] - xy[0], xy[2] - xy[0]
    double_area = abs(e_b[0] * e_c[1] - e_b[1] * e_c[0])
    for values in ((0.3, 1.0, 0.0), (0.0, 1.0, 1.0), (1.0, -1.0, 2.0)):
        if gaps[1] == 0:
            values = (values[0], values[0], values[2])
        at = (edge_trace if gaps[1] == 0 else power_trace)(xy, np.array(values))

        def density(l_b, l_c, at=at):
            g, slope = l_b * gaps[1] + l_c * gaps[2], at(l_b, l_c)[1]
            return (slope**2).sum(axis=0) / (alpha * g**3 + beta * g**2)

        exact = integrate(density) * double_area
        difference = np.subtract(values[1:], values[0])
        gx, gy = difference @ np.linalg.inv(np.stack([e_b, e_c], axis=1))
        found = (xx * gx**2 + 2 * xy_ * gx * gy + yy * gy**2) * double_area / 2
        if 0 in (alpha, beta):
            # 40 roundings in the tensor, and as many in the quadrature.
            assert found == pytest.approx(np.full(3, exact), rel=1e-13)
        else:
            assert exact * (1 - 1e-9) <= found.min() <= found.max() < 1.34 * exact
