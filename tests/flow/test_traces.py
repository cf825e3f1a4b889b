"""Power traces: closed forms of the energies of cells that touch contact."""

import numpy as np
import pytest
from gaps import meshed, octaves, represented

from fem_seal.film.law import Conductivity
from fem_seal.flow.traces import POWER, resistivity
from fem_seal.grid import GridField
from fem_seal.mesh.nested import PIXEL


def power_trace(corners, values):
    """∇ψ at (λ_b, λ_c) of the power trace ψ_0 + s^m ((1-τ) D_b + τ D_c), written out."""
    e_b, e_c = corners[1] - corners[0], corners[2] - corners[0]
    to_lambda = np.linalg.inv(np.stack([e_b, e_c], axis=1))  # rows: ∇λ_b, ∇λ_c
    D_b, D_c = values[1] - values[0], values[2] - values[0]

    def at(l_b, l_c):
        # s^m ((1-τ) D_b + τ D_c) = s^(m-1) (λ_b D_b + λ_c D_c), as s (1-τ) = λ_b and s τ = λ_c.
        s, line = l_b + l_c, l_b * D_b + l_c * D_c
        grown = (POWER - 1) * s ** (POWER - 2) * line
        return to_lambda.T @ [grown + s ** (POWER - 1) * D_b, grown + s ** (POWER - 1) * D_c]

    return at


def integrate(function, b, c):
    """∫ over the unit triangle in (λ_b, λ_c) by Gauss points on s = λ_b + λ_c and τ = λ_c/s.

    τ in pieces on which the gap between b and c at most doubles.
    """
    x, w = np.polynomial.legendre.leggauss(24)
    x, w = (x + 1) / 2, w / 2
    if 0.5 < c / b < 2:
        t, rest, of_t = x, 1 - x, w
    else:
        gap, of_gap = octaves(b, c)
        t, rest, of_t = (part / (c - b) for part in (gap - b, c - gap, of_gap))
    l_b, l_c, weight = (np.outer(*pair).ravel() for pair in ((rest, x), (t, x), (of_t, w * x)))
    return weight @ function(l_b, l_c)


TRIANGLES = [
    [(0, 0), (1, 0), (0, 1)],  # the contact at the right angle
    [(0, 1), (0, 0), (1, 0)],  # at an end of the hypotenuse
    [(0, 0), (2, 0), (1, 3)],
    [(0.3, 0.1), (-1, 0.7), (-0.5, -2)],
]


def edge_trace(corners, values):
    """∇ψ at (λ_b, λ_c) of ψ_0 + D λ_c^m: contact edge between corners 0 and 1."""
    to_lambda = np.linalg.inv(np.stack([corners[1] - corners[0], corners[2] - corners[0]], axis=1))
    D = values[2] - values[0]

    def at(l_b, l_c):
        return np.multiply.outer(to_lambda[1], D * POWER * l_c ** (POWER - 1))

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


SINGLE = [(1.0, 0.0), (0.0, 1.0)]
GAPS = [(0, 1, 1), (0, 0.2, 1), (0, 1, 0.6), (0, 0.05, 0.9), (0, 0, 1), (0, 0, 0.03)]
# Extreme ones, nearly the same, and about the switch of the closed forms at a ratio of 4.
FAR = [(0, 1e-6, 1), (0, 1, 1e-6), (0, 1e-3, 1), (0, 1, 1 + 1e-9), (0, 1, 1 + 1e-12)]
FAR += [(0, 1, 4 - 1e-9), (0, 1, 4 + 1e-9), (0, 4 - 1e-9, 1), (0, 4 + 1e-9, 1)]


@pytest.mark.parametrize("corners", TRIANGLES)
@pytest.mark.parametrize(
    ("gaps", "alpha", "beta"),
    [
        *((gaps, *pair) for gaps in GAPS for pair in (*SINGLE, (0.7, 0.3), (0.99, 0.01))),
        *((gaps, *pair) for gaps in FAR for pair in SINGLE),
    ],
)
def test_energy_beside_contact(corners, gaps, alpha, beta):
    """∫|∇ψ|²/(α g³ + β g²) of the power trace is that of the linear function under the tensor, or
    no more than that where neither α nor β is zero; any corner of the cell may be the first.

    Then |∇ψ|² differs between directions, and one weight of the two tensors serves all: up to a
    third more was seen.
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
            g, slope = l_b * gaps[1] + l_c * gaps[2], at(l_b, l_c)
            return (slope**2).sum(axis=0) / (alpha * g**3 + beta * g**2)

        exact = integrate(density, gaps[1] or gaps[2], gaps[2]) * double_area
        difference = np.subtract(values[1:], values[0])
        gx, gy = difference @ np.linalg.inv(np.stack([e_b, e_c], axis=1))
        found = (xx * gx**2 + 2 * xy_ * gx * gy + yy * gy**2) * double_area / 2
        if 0 in (alpha, beta):
            # 40 roundings in the tensor, and as many in the quadrature.
            assert found == pytest.approx(np.full(3, exact), rel=1e-13)
        else:
            assert exact * (1 - 1e-9) <= found.min() <= found.max() < 1.34 * exact
