"""Gases that slip, by finite differences: layers, and no convergence; bounds: flow/test_slip.py."""

import numpy as np
import pytest
from slip_answers import in_series

from fem_seal.errors import NotConverged
from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences, slipping
from fem_seal.flow_settings import FlowSettings
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.rarefied import LAWS

laws = pytest.mark.parametrize("law", LAWS)


def mass_rate(gap, slip, **options):
    """Leak rate times 12 η R T/M, for square pixels."""
    drop = slip.mean_pressure * (slip.inlet_pressure - slip.outlet_pressure)
    film = GridFilm(GridField(gap, (1.0, 1.0), periodic=True), "periodic", "constant")
    leak = by_differences(
        film, FlowSettings(viscosity=1 / 12, pressure_drop=drop, slip=slip, **options)
    )
    assert leak.converged
    assert leak.residuals["slip"][-1] <= slipping.TOLERANCE < leak.residuals["slip"][0]
    return leak.value


@laws
@pytest.mark.parametrize(("B", "p_out"), [(1e-3, 0.0), (0.5, 0.5), (1e4, 0.0)])
def test_layers_in_series(law, p_out, B):
    """κ at the centres of n pixels: the error falls as 1/n², from 1/16 of the difference of κ."""
    slip = Slip(2.0, p_out, B, LAWS[law](1.0))
    exact = in_series(slip, (0.2, 1.0), (0.5, 0.5))
    for n, room in ((8, 0.03), (32, 0.004)):
        gap = np.repeat(np.repeat([[0.2], [1.0]], n // 2, axis=0), n, axis=1)
        assert mass_rate(gap, slip, links="harmonic") == pytest.approx(exact, rel=room)


def test_pressures_that_do_not_settle(monkeypatch):
    """Few steps are too few: the message names the change and a way out."""
    slip = Slip(2.0, 0.0, 1.0)
    gap = np.repeat([[0.2], [1.0]], 2, axis=0) * np.ones(4)
    film = GridFilm(GridField(gap, (1.0, 1.0)), "wall", "constant")
    monkeypatch.setattr(slipping, "MOST_STEPS", 2)
    with pytest.raises(NotConverged, match=r"changed by .* of the inlet's in step 2 of the iter"):
        slipping.film_without_slip(film, slip)
