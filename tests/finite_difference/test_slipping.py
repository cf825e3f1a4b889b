"""Gases that slip, by finite differences: layers, and no convergence; bounds: flow/test_slip.py."""

import numpy as np
import pytest
from project import observed_orders
from slip_answers import in_series

from fem_seal.errors import NotConverged
from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences, slipping
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.rarefied import LAWS

laws = pytest.mark.parametrize("law", LAWS)


def mass_rate(gap, slip, **options):
    """Leak rate times 12 η R T/M, for square pixels."""
    drop = slip.mean_pressure * (slip.inlet_pressure - slip.outlet_pressure)
    film = GridFilm(GridField(gap, (1.0, 1.0), periodic=True), "periodic", "constant")
    leak = by_differences(film, viscosity=1 / 12, pressure_drop=drop, slip=slip, **options)
    assert leak.converged
    assert leak.residuals["slip"][-1] <= slipping.TOLERANCE < leak.residuals["slip"][0]
    return leak.value


def errors_in_series(slip):
    """Of layers of 0.2 and 1 on 8, 16 and 32 pixels, relative."""
    exact, errors = in_series(slip, (0.2, 1.0), (0.5, 0.5)), []
    for n in (8, 16, 32):
        gap = np.repeat(np.repeat([[0.2], [1.0]], n // 2, axis=0), n, axis=1)
        errors.append(abs(mass_rate(gap, slip, link_rule="harmonic") / exact - 1))
    return np.array(errors)


@laws
@pytest.mark.parametrize(("B", "p_out"), [(1e-3, 0.0), (0.5, 0.5), (1e4, 0.0)])
def test_layers_in_series(law, p_out, B):
    """κ at the centres of n pixels. That of the narrow layer does not depend on p. In the other one
    the resistance of n/2 pixels errs by no more than that of one changes from end to end."""
    slip = Slip(2.0, p_out, B, LAWS[law](1.0))
    p = np.linspace(p_out, 2.0, 1001)
    resists = slip.coefficient(0.2 * p / B) / (25 * slip.coefficient(p / B))
    bounds = np.divide(2, (8, 16, 32)) * np.ptp(resists) + 10 * slipping.TOLERANCE
    assert (errors_in_series(slip) <= bounds).all()


@pytest.mark.parametrize(("law", "order"), [("first-order", 2)])
def test_order_where_pressure_and_slip_are_smooth(law, order):
    """The middle of a pixel stands for it to second order.

    The next term is h² = 1/8² of it on the coarsest grid.
    """
    errors = errors_in_series(Slip(2.0, 0.5, 0.5, LAWS[law](1.0)))
    assert observed_orders(errors) == pytest.approx([order, order], abs=1 / 8**2)


def test_gaps_whose_cubes_are_lost():
    """Inside the square no number holds the conductance of a link."""
    gap = np.ones((8, 8))
    gap[2:6, 2:6] = 1e-120
    film = GridFilm(GridField(gap, (1.0, 1.0)), "wall", "constant")
    with pytest.raises(NotConverged, match="beyond double precision at gaps that are almost"):
        slipping.node_pressure(film)


def test_pressures_that_do_not_settle(monkeypatch):
    """Few steps are too few: the message names the change and a way out."""
    slip = Slip(2.0, 0.0, 1.0)
    gap = np.repeat([[0.2], [1.0]], 2, axis=0) * np.ones(4)
    film = GridFilm(GridField(gap, (1.0, 1.0)), "wall", "constant")
    monkeypatch.setattr(slipping, "MOST_STEPS", 2)
    with pytest.raises(NotConverged, match=r"changed by .* of the inlet's in step 2 of the iter"):
        slipping.film_without_slip(film, slip)
