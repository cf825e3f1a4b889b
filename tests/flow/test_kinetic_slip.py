"""Gases from continuum to free molecular flow: closed forms and the non-linear solution."""

from dataclasses import replace

import numpy as np
import pytest
from nonlinear import channel, in_series, mass_rate_of
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from test_slip import mass_bounds
from triangulations import scattered_square

from fem_seal.film import MeshFilm
from fem_seal.flow.cell_tensor import conductivity_tensor
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.rarefied import FIRST_ORDER, kinetic

ROUNDING = 1e-7  # CG stops at a relative energy error of 1e-8
# The smallest conductivity allows for a kink of the table of c between two gaps of its own table.
SAG = 2e-4


@pytest.mark.parametrize("accommodation", [1.0, 0.5])
@pytest.mark.parametrize("p_out", [0.0, 1.0, 1.999])
@pytest.mark.parametrize("B", [1e-6, 0.3, 30.0, 1e9])
def test_uniform_channel(p_out, B, accommodation):
    """The weight w(p) = c(g p/B) of the channel's own gap leaves nothing of the pressure open."""
    slip = Slip(2.0, p_out, B, kinetic(accommodation))
    leak, lower, upper = mass_bounds(np.full((5, 5), 0.7), slip, "linear")
    exact = channel(slip, 0.7, 1.0, 2.0, p_out)
    assert upper == pytest.approx(exact, rel=ROUNDING)
    assert exact * (1 - SAG) < lower < exact * (1 + ROUNDING)
    assert leak.converged


@pytest.mark.parametrize("p_out", [0.0, 0.2, 1.9])
@pytest.mark.parametrize("B", 10.0 ** np.arange(-7, 10, 2))
def test_layers_in_series(p_out, B):
    """Enclosed at all Knudsen numbers; first order leaks less, by little in the viscous limit."""
    gap = np.repeat([[0.2], [0.2], [1.0], [1.0]], 3, axis=1)
    slip = Slip(2.0, p_out, B, kinetic(1.0))
    _, lower, upper = mass_bounds(gap, slip)
    exact = 3 * in_series(slip, (0.2, 1.0), (2.0, 2.0))
    assert lower <= exact * (1 + ROUNDING)
    assert upper >= exact * (1 - ROUNDING)
    # ±6 % is more than was seen, ±2.2 %.
    assert upper / lower < 1.12
    first_order = 3 * in_series(replace(slip, coefficient=FIRST_ORDER), (0.2, 1.0), (2.0, 2.0))
    # The table of c errs by 1e-4.
    assert exact > first_order * (1 - 1e-4)
    if B < 1e-5:
        assert exact == pytest.approx(first_order, rel=1e-4)


def test_channels_side_by_side():
    """Parted by contact their flows add, though their pressures differ at the same x."""
    gap = np.zeros((4, 7))
    gap[:, :2], gap[:, 3:6] = 0.5, 1.0
    slip = Slip(2.0, 0.0, 2.0, kinetic(1.0))
    _, lower, upper = mass_bounds(gap, slip)
    exact = 2 * channel(slip, 0.5, 4, 2.0, 0.0) + 3 * channel(slip, 1.0, 4, 2.0, 0.0)
    assert lower <= exact <= upper
    assert upper / lower < 1.25


@pytest.mark.parametrize("B", [1e-2, 3.0, 1e4])
@pytest.mark.parametrize("shape", [False, True])
def test_wedge(B, shape):
    """g falls along the flow from 1 to 0.1, into a vacuum: an ordinary differential equation."""
    c = kinetic(0.8)

    def inlet_pressure(flux):
        def slope(x, p):
            g = 1.0 - 0.9 * x
            return -flux / (B * g**2 * c(g * np.maximum(p, 0.0) / B))

        return solve_ivp(slope, (1, 0), [0.0], rtol=1e-8, atol=1e-11, method="LSODA").y[0, -1]

    exact = brentq(lambda flux: inlet_pressure(flux) - 2.0, 1e-9, 9 + 20 * B, rtol=1e-9)
    if shape:
        mesh = scattered_square(40, 3)
        film, spacing = MeshFilm(mesh, 1.0 - 0.9 * mesh.xy[:, 0]), None
    else:
        film, spacing = np.repeat(np.linspace(1.0, 0.1, 7)[:, None], 4, axis=1), (1 / 6, 1 / 3)
    leak, lower, upper = mass_bounds(film, Slip(2.0, 0.0, B, c), "linear", spacing, rtol=0.01)
    # The kinks of c cost the integrator digits.
    assert lower <= exact * (1 + 1e-6)
    assert upper >= exact * (1 - 1e-6)
    assert leak.converged


@pytest.mark.parametrize("aspect", [0.2, 1.0, 5.0])
@pytest.mark.parametrize("B", [1e-2, 3.0, 1e7])
def test_linear_gap_that_touches_along_the_flow(aspect, B):
    """At nearly one pressure p is linear: Σ dy mean(B g² c(g p/B)) of the profile is exact."""
    profile = np.array([0.0, 0.4, 1.0, 0.7, 0.0, 0.9])
    gap = np.repeat(profile[None, :], 5, axis=0)
    slip = Slip(1.0, 1.0 - 1e-7, B, kinetic(1.0))
    leak, lower, upper = mass_bounds(gap, slip, "linear", (aspect, 1.0), rtol=0.06)
    y = (np.arange(4000) + 0.5) / 4000
    g = profile[:-1, None] * (1 - y) + profile[1:, None] * y
    exact = (B * g**2 * slip.coefficient(g / B)).mean(axis=1).sum() * 1e-7 / (4 * aspect)
    # The midpoint rule errs by 1e-7.
    assert lower <= exact * (1 + 1e-6)
    assert upper >= exact * (1 - 1e-6)
    assert leak.converged


def test_conductivity_tensor():
    """At the mean pressure: stripes along and across, arithmetic and harmonic means of 𝒦/p."""
    heights = np.array([0.4, 1.0, 0.7, 0.4])
    gap = GridField(np.repeat(heights[None, :], 4, axis=0), (1.0, 1.0), periodic=True)
    slip = Slip(1.2, 0.8, 2.0, kinetic(1.0))
    bounds = conductivity_tensor(gap, viscosity=1 / 12, slip=slip, representation="constant")
    K = 2.0 * heights**2 * slip.coefficient(heights / 2.0)
    for k, exact in ((0, K.mean()), (1, 1 / np.mean(1 / K))):
        assert bounds.lower[k, k] <= exact * (1 + ROUNDING)
        assert bounds.upper[k, k] >= exact * (1 - ROUNDING)
        assert bounds.upper[k, k] / bounds.lower[k, k] < 1.06


def check_random(seed: int) -> tuple[float, float]:
    """Bounds against finite volumes on 8² and 16² volumes a pixel; see `test_slip.check_random`."""
    rng = np.random.default_rng(seed)
    gap = rng.uniform(0.45, 1.0, (5, 4))
    slip = Slip(2.0, 2.0 * rng.choice([0.0, 0.1, 0.5, 0.9]), 10 ** rng.uniform(-2, 4), kinetic(1.0))

    def mobility(g, p):
        return slip.product * g**2 * slip.coefficient(g * p / slip.product)

    leak, lower, upper = mass_bounds(gap, slip, rtol=0.01)
    coarse, fine = (
        mass_rate_of(mobility, gap, 2.0, slip.outlet_pressure, parts) for parts in (8, 16)
    )
    off = 2 * abs(fine - coarse)
    assert off < 0.06 * fine
    assert lower <= fine + off
    assert upper >= fine - off
    assert leak.converged
    return leak.slip_interval


@pytest.mark.parametrize("seed", range(5))
def test_random_gaps_enclose_the_nonlinear_solution(seed):
    check_random(seed)


@pytest.mark.slow
def test_two_hundred_random_gaps():
    """The helper asserts each enclosure; the width of what slip leaves open is printed."""
    widths = [50 * np.log(high / low) for low, high in map(check_random, range(200))]
    print(f"slip interval: median ±{np.median(widths):.2g} %, at most ±{max(widths):.2g} %")
