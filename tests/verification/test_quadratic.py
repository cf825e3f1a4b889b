"""Quadratic elements: exact where they must be; always an upper bound, below the linear one."""

import numpy as np
import pytest
from sample_gaps import rough_gap

from fem_seal.film import GridFilm
from fem_seal.flow import Limits, leak_rate
from fem_seal.grid import GridField
from fem_seal.verification.quadratic import quadratic_upper


def unit(gap, spacing=(1.0, 1.0), periodic=False, **choices):
    """Leak rate with K = g³."""
    return quadratic_upper(
        GridFilm(GridField(gap, spacing, periodic), **choices), viscosity=1 / 12, pressure_drop=1.0
    )


@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_a_uniform_gap_is_exact(sides):
    """Linear pressure: Q = g³ Ly/Lx; CG to 1e-8 of the pressure."""
    leak = unit(np.full((7, 5), 2.0), (0.5, 1.0), True, sides=sides)
    assert leak.value == pytest.approx(8 * 5.0 / 3.5, rel=2e-8)
    assert leak.lower == 0


def test_constant_gap_in_series_and_side_by_side():
    """Ly / ∫dx/K across layers, ∫K dy / Lx along them."""
    layers = np.repeat([[1.0], [2.0], [0.5]], 4, axis=1)
    options = {"representation": "constant"}
    assert unit(layers, **options).value == pytest.approx(4 / (1 + 1 / 8 + 8), rel=2e-8)
    assert unit(layers.T, **options).value == pytest.approx((1 + 8 + 0.125) / 4, rel=2e-8)


def test_quadrature_is_exact():
    """A gap g = y along the flow: p is linear, so that Q = ∫g³ dy / Lx = 1/4 needs g³ exactly."""
    gap = np.tile(np.linspace(0, 1, 5), (5, 1))
    assert unit(gap, (0.25, 0.25)).value == pytest.approx(0.25, rel=2e-8)


@pytest.mark.parametrize("sides", ["wall", "periodic"])
@pytest.mark.parametrize(("contact", "representation"), [(0.2, "linear"), (0.2, "constant")])
def test_between_the_truth_and_linear_elements(sides, contact, representation):
    """Quadratic functions contain the linear ones, and all are admissible (Dirichlet)."""
    gap = rough_gap((16, 16), contact, 3).values
    choices = {"sides": sides, "representation": representation}
    quadratic = unit(gap, periodic=True, **choices).value
    setting = {"viscosity": 1 / 12, "pressure_drop": 1.0}
    film = GridFilm(GridField(gap, (1.0, 1.0), True), **choices)
    linear = leak_rate(film, method="uniform", rtol=1e-6, limits=Limits(unknowns=1), **setting)
    truth = leak_rate(film, rtol=0.02, **setting)
    assert truth.lower < quadratic < linear.upper
    assert quadratic < 0.97 * linear.upper


def test_sealed_needs_no_solve():
    gap = np.ones((5, 5))
    gap[2] = 0
    leak = unit(gap)
    assert (leak.state, leak.value, leak.unknowns) == ("sealed", 0.0, 0)
