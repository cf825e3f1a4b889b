"""Quarters of triangles: gases, ceilings. Energies: test_hierarchical; rounding: test_energy."""

import numpy as np
import pytest
from gaps import everything, meshed, represented
from sample_gaps import rough_gap

from fem_seal.film.slip_bounds import PressureWeight, bounding_law
from fem_seal.flow.gap_on_mesh import VertexGap
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.rarefied import kinetic


@pytest.mark.parametrize(("width", "halved"), [(1, 1), (2, 0), (4, 2)])
@pytest.mark.parametrize("highest", [1.0, 100.0])
def test_means_on_the_quarters_of_a_gas_that_slips(width, halved, highest):
    """Neither mean exceeds that of the whole, or the hierarchical correction would take away more
    energy than there is. From the highest gap downwards Kn is 5 to 30, or 0.05 to 0.3."""
    slip = Slip(1.0, 0.1, 30.0, kinetic(1.0))
    field = rough_gap((16, 16), 0.0, 3, smooth=1)
    raised = (field.values + 0.2) / 1.2
    field = GridField(raised, field.spacing, periodic=True)
    weight = PressureWeight.of_gap(slip, highest, 0.3)
    law = bounding_law(slip, highest, weight, weight, 1.0)
    gap = represented(field, "linear", width=8).with_law(law)
    mesh, values = meshed(gap, width, markings=[everything] * halved)
    whole, corner = gap.cell_data(mesh, values), mesh.cells.T
    parts = gap.quarter_data(mesh.xy[corner], values[corner])
    assert (parts.K.mean(axis=0) <= whole.K * (1 + 1e-12)).all()
    resistivity = parts.resistivity.mean(axis=0)
    assert (resistivity <= whole.resistivity[:, 0] * (1 + 1e-12)).all()
    # What is added to the resistivity of a cell that is refined is 40 % where the gap is halved.
    assert (resistivity >= 0.5 * whole.resistivity[:, 0]).all()


def test_the_ceiling_does_not_reach_the_quarters():
    """Of resistivities raised to that of the ceiling the mean is not that of the cell. Quarters of
    a shape are those of a grid with the same cells."""
    samples = GridField(np.random.default_rng(0).uniform(0.2, 1, (5, 5)), (1.0, 1.0))
    low, high = (represented(samples, ceiling=ceiling) for ceiling in (0.125, np.inf))
    mesh, values = meshed(low)
    shape = VertexGap(values[:, 0], 1.0, 0.0, 0.0, 0.125)
    for gap in (low, shape):
        assert (gap.cell_data(mesh, values).resistivity[:, 0] == 512).all()
    at_corners = mesh.xy[mesh.cells.T], values[mesh.cells.T]
    found, of_shape, free = (gap.quarter_data(*at_corners) for gap in (low, shape, high))
    for quarters in (found, of_shape):
        assert np.array_equal(quarters.resistivity, free.resistivity)
        assert np.array_equal(quarters.K, free.K)
    assert free.resistivity.max() < 512


@pytest.mark.parametrize("ceiling", [0.1, 0.5, 2.0])
def test_no_open_cell_resists_less_than_the_ceiling(ceiling):
    """Beside contact as well, where the resistivity is that of a power trace: what is next to
    nothing there spoils the contrast that double precision can solve."""
    gap = represented(rough_gap((16, 16), 0.3, 5), ceiling=ceiling)
    data = gap.cell_data(*meshed(gap))
    beside = data.contact_vertex.any(axis=1) & ~data.blocked
    assert np.count_nonzero(beside) > 50
    xx, xy, yy = data.resistivity[~data.blocked].T
    least = (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy)  # the smaller eigenvalue
    assert least.min() >= ceiling**-3 * (1 - 1e-12)
