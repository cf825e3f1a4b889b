"""Gases that slip, to first order and from continuum to free molecular flow.

Closed forms, the two limits, and finite differences within the bounds.
"""

from dataclasses import astuple, replace

import numpy as np
import pytest
from project import leak_rate
from slip_answers import channel, in_series, wedge
from triangulations import scattered_square

from fem_seal.film import GridFilm, MeshFilm
from fem_seal.finite_difference import by_differences
from fem_seal.fluid import GAS_CONSTANT, GasDrive, Slip
from fem_seal.grid import GridField
from fem_seal.leak_rate import relative_width
from fem_seal.rarefied import FIRST_ORDER, LEAST_ACCOMMODATION, kinetic

TEMPERATURE, MOLAR_MASS = 293.15, 0.02896
# Bounds have room for rounding, and CG stops at a relative energy error of 1e-8.
ROUNDING = 1e-7
KINETIC, MIRRORS = kinetic(1.0), kinetic(LEAST_ACCOMMODATION)
LAWS = pytest.mark.parametrize("law", [FIRST_ORDER, KINETIC], ids=["first order", "kinetic"])
# The smallest conductivity allows for a kink of the table of c between two gaps of its own table.
SAG = 2e-4


def mobility(slip: Slip, g, p):
    """𝒦(g, p): to first order g³ p + B g²."""
    if slip.coefficient is FIRST_ORDER:
        return g**3 * p + slip.product * g**2
    return slip.product * g**2 * slip.coefficient(g * p / slip.product)


def mass_bounds(gap, slip: Slip, representation="constant", spacing=(1.0, 1.0), **options):
    """Leak rate in kg/s times 12 η R T/M: ∫(g³ p + B g²)|∇p| over a line across the flow."""
    ends = slip.inlet_pressure, slip.outlet_pressure
    drive = GasDrive(*ends, TEMPERATURE, MOLAR_MASS, 273.15, 101325.0)
    film = gap
    if not isinstance(gap, MeshFilm):
        film = GridFilm(GridField(np.asarray(gap, dtype=float), spacing), "wall", representation)
    options = {"rtol": 0.02} | options
    found = leak_rate(
        film, viscosity=1 / 12, pressure_drop=drive.pressure_drop, slip=slip, **options
    )
    per = drive.rates["mass"] * GAS_CONSTANT * TEMPERATURE / MOLAR_MASS
    return found, found.lower * per, found.upper * per


@LAWS
@pytest.mark.parametrize(
    ("B", "representation", "p_out"),
    [(1e-6, "constant", 1.999), (0.3, "linear", 0.0), (1e9, "constant", 0.0)],
)
def test_uniform_channel(law, representation, p_out, B):
    """The weight w(p) = c(g p/B) of the channel's own gap leaves nothing of the pressure open."""
    slip = Slip(2.0, p_out, B, law)
    found, lower, upper = mass_bounds(np.full((5, 5), 0.7), slip, representation)
    exact = channel(slip, 0.7, 1.0, 2.0, p_out)
    assert upper == pytest.approx(exact, rel=ROUNDING)
    assert exact * (1 - (SAG if law is KINETIC else ROUNDING)) < lower < exact * (1 + ROUNDING)
    if law is FIRST_ORDER:
        assert astuple(found.slip_interval) == pytest.approx((1, 1), rel=ROUNDING)


@LAWS
def test_nearly_equal_pressures(law):
    """c is a line between them: its mean is that at the mean pressure, to a dozen roundings."""
    slip = Slip(1e5 * (1 + 1e-8), 1e5, 0.04, law)
    assert slip.mean_gain(1e-6) == pytest.approx(slip.gain(1e-6), rel=12 * np.finfo(float).eps)


@LAWS
@pytest.mark.parametrize(("B", "p_out"), [(1e-7, 0.0), (0.1, 0.0), (10.0, 1.9), (1e9, 0.0)])
def test_layers_in_series(law, p_out, B):
    """Enclosed at all Knudsen numbers. To first order nothing is open in both limits, where the
    flow is linear in p² or in p; of the kinetic law no more than w(p) = c(0.2 p/B) leaves open."""
    gap = np.repeat([[0.2], [0.2], [1.0], [1.0]], 3, axis=1)
    slip, layers = Slip(2.0, p_out, B, law), ((0.2, 1.0), (2.0, 2.0))
    found, lower, upper = mass_bounds(gap, slip)
    exact = 3 * in_series(slip, *layers)
    assert lower <= exact * (1 + ROUNDING)
    assert upper >= exact * (1 - ROUNDING)
    if law is FIRST_ORDER:
        assert 1e-6 < B < 1e5 or astuple(found.slip_interval) == pytest.approx((1, 1), abs=1e-3)
        return
    # The narrow layer is then known, and κ of the other is 25 times as large, times this ratio.
    p = np.linspace(p_out, 2.0, 1001)
    ratio = law(p / B) / law(0.2 * p / B)
    widest, narrowest = 1 + 1 / (25 * ratio.min()), 1 + 1 / (25 * ratio.max())
    # Weights are chosen by an estimate, which must gain 1e-3 to be followed.
    assert upper / lower < widest / narrowest * (1 + 5e-3)
    # First order leaks less, by little in the viscous limit. The table of c errs by 1e-4.
    first_order = 3 * in_series(replace(slip, coefficient=FIRST_ORDER), *layers)
    assert exact > first_order * (1 - 1e-4)
    assert B > 1e-5 or exact == pytest.approx(first_order, rel=1e-4)


@LAWS
def test_channels_side_by_side(law):
    """Parted by contact their flows add, though their pressures differ at the same x.

    The weight 𝒦(1, p) of the wide channel leaves open the ratio of the narrow one's 𝒦 to it.
    """
    gap = np.zeros((4, 7))
    gap[:, :2], gap[:, 3:6] = 0.5, 1.0
    slip = Slip(2.0, 0.0, 0.4 if law is FIRST_ORDER else 2.0, law)
    _, lower, upper = mass_bounds(gap, slip)
    exact = 2 * channel(slip, 0.5, 4, 2.0, 0.0) + 3 * channel(slip, 1.0, 4, 2.0, 0.0)
    assert lower <= exact <= upper
    p = np.linspace(0.0, 2.0, 1001)
    ratio = mobility(slip, 0.5, p) / mobility(slip, 1.0, p)
    # Weights are chosen by an estimate, which must gain 1e-3 to be followed.
    assert upper / lower < (3 + 2 * ratio.max()) / (3 + 2 * ratio.min()) * (1 + 1e-3)


@pytest.mark.parametrize(("B", "power"), [(1e-9, 3), (1e9, 2)])
def test_checkerboard_in_both_limits(B, power):
    """A board conducts the geometric mean of its fields (J. B. Keller, J. Math. Phys. 5, 548
    (1964)): g^3 in p²/2, and g² in B p where the flow is free molecular."""
    fields = np.indices((4, 4)).sum(axis=0) % 2
    gap = np.kron(np.where(fields, 0.5, 1.0), np.ones((4, 4)))
    _, lower, upper = mass_bounds(gap, Slip(2.0, 1.0, B))
    exact = (0.5**power) ** 0.5 * (1.5 if power == 3 else B)
    assert lower <= exact <= upper
    # The tolerance, and what slip leaves open: of the order of B and of 1/B.
    assert relative_width(lower, upper) < 0.02 + 1e-8


@LAWS
@pytest.mark.parametrize(("B", "aspect"), [(0.3, 5.0), (1e7, 0.2)])
def test_linear_gap_that_touches_along_the_flow(law, aspect, B):
    """At nearly one pressure p is linear: Σ dy mean 𝒦 of the profile is exact. The lower bound
    rests on power traces for all powers of the gap at the contact."""
    profile = np.array([0.0, 0.4, 1.0, 0.7, 0.0, 0.9])
    gap = np.repeat(profile[None, :], 5, axis=0)
    slip = Slip(1.0, 1.0 - 1e-7, B, law)
    found, lower, upper = mass_bounds(gap, slip, "linear", (aspect, 1.0), rtol=0.06)
    y = (np.arange(4000) + 0.5) / 4000
    g = profile[:-1, None] * (1 - y) + profile[1:, None] * y
    exact = mobility(slip, g, slip.mean_pressure).mean(axis=1).sum() * 1e-7 / (4 * aspect)
    # The midpoint rule errs by 1e-7.
    assert lower <= exact * (1 + 1e-6)
    assert upper >= exact * (1 - 1e-6)
    assert found.converged


@pytest.mark.parametrize(
    ("law", "B", "p_out", "shape"),
    [
        (FIRST_ORDER, 1e-2, 0.5, False),
        (FIRST_ORDER, 3.0, 0.0, True),
        (MIRRORS, 3.0, 0.0, True),
        (MIRRORS, 1e4, 0.0, False),
    ],
)
def test_wedge(law, B, p_out, shape):
    """g falls along the flow from 1 to 0.1. The gap at which slip does not depend on the pressure
    lies inside cells."""
    slip = Slip(2.0, p_out, B, law)
    exact = wedge(slip, 0.1)
    if shape:
        mesh = scattered_square(40, 3)
        film, spacing = MeshFilm(mesh, 1.0 - 0.9 * mesh.xy[:, 0]), None
    else:
        film, spacing = np.repeat(np.linspace(1.0, 0.1, 7)[:, None], 4, axis=1), (1 / 6, 1 / 3)
    found, lower, upper = mass_bounds(film, slip, "linear", spacing, rtol=0.01)
    assert lower <= exact * (1 + ROUNDING)
    assert upper >= exact * (1 - ROUNDING)
    assert found.converged


def require_enclosed_differences(seed: int, law) -> None:
    """Bounds of rough pixels against finite differences on 8² and 16² nodes a pixel, which take the
    conductivity at the pressure of each node and share nothing with the elements.

    Their error comes from the corners of pixels, where the pressure goes as r^γ and the error as
    the distance of two nodes to the power 2 γ. For a contrast of conductivities c, γ is at least
    (4/π) arctan c^(-1/2), that of a checkerboard (J. B. Keller, J. Math. Phys. 28, 2516 (1987)):
    0.37 here, so that the finer answer is off by at most 1/(2^(2 γ) - 1) = 1.5 times the last
    change. Twice it is allowed.
    """
    rng = np.random.default_rng(seed)
    gap = rng.uniform(0.45, 1.0, (5, 4))
    slip = Slip(2.0, 2.0 * rng.choice([0.0, 0.1, 0.5, 0.9]), 10 ** rng.uniform(-2, 4), law)
    found, lower, upper = mass_bounds(gap, slip, rtol=0.01)
    drop = slip.mean_pressure * (slip.inlet_pressure - slip.outlet_pressure)
    coarse, fine = (
        by_differences(
            GridFilm(pixels, "wall", "constant"), 1 / 12, drop, slip=slip, link_rule="harmonic"
        ).value
        for pixels in (GridField(np.kron(gap, np.ones((n, n))), (1.0, 1.0)) for n in (8, 16))
    )
    off = 2 * abs(fine - coarse)
    assert off < 0.06 * fine, seed  # six times the tolerance of the bounds, or nothing is shown
    assert lower <= fine + off, seed
    assert upper >= fine - off, seed
    assert found.converged


@LAWS
@pytest.mark.parametrize("seeds", [range(1), pytest.param(range(200), marks=pytest.mark.slow)])
def test_random_gaps_enclose_finite_differences(seeds, law):
    for seed in seeds:
        require_enclosed_differences(seed, law)


@pytest.mark.parametrize("part", [0.5, 1.0, 2.0])
def test_decision(part):
    """A limit outside the bounds is decided; one inside the slip interval ends the refinement."""
    gap = np.repeat([[1.0], [0.2], [1.0], [1.0]], 4, axis=1)
    slip = Slip(2.0, 0.0, 0.5)
    free, *_ = mass_bounds(gap, slip)
    found, *_ = mass_bounds(gap, slip, decide=part * free.value)
    assert found.converged is (part != 1.0)
    if part == 1.0:
        assert "within the uncertainty of the slip" in found.reason
    else:
        assert (found.lower > part * free.value) if part < 1 else found.upper <= part * free.value
