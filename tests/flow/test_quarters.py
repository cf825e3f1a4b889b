"""Quarters of triangles: rounding, gases, ceilings. Their energies: `test_hierarchical.py`."""

import numpy as np
import pytest
from gaps import everything, represented
from sample_gaps import rough_gap

from fem_seal.film.law import PressureWeight, bounding_law
from fem_seal.flow.gap_on_mesh import VertexGap
from fem_seal.flow.quarters import QuarterShape
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.mesh.bisection import bisect
from fem_seal.mesh.nested import uniform_mesh
from fem_seal.mesh.triangles import TriangleMesh
from fem_seal.rarefied import kinetic


def test_a_constant_added_changes_nothing():
    """Not even rounding: pressures near one differ by 1e-16 where little falls off."""
    rng = np.random.default_rng(0)
    shape, c = QuarterShape.of(*rng.normal(size=(2, 3, 20))), rng.random((4, 20))
    # Multiples of 2^-30 below one: sums with a whole number are exact.
    v = rng.integers(0, 1 << 30, (20, 3)) / (1 << 30)
    assert np.array_equal(shape.slopes(v, c), shape.slopes(v + 7, c))


@pytest.mark.parametrize("width", [1, 2, 4])
@pytest.mark.parametrize("halved", [0, 1, 2])
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
    mesh = uniform_mesh(gap.squares, width, periodic_sides=False)
    values = gap.vertex_values(mesh)
    for _ in range(halved):
        step = bisect(mesh, everything(mesh))
        values, mesh = gap.refined_values(values, step.mesh, step.edge_ends), step.mesh
    whole, corner = gap.cell_data(mesh, values), mesh.cells.T
    parts = gap.quarter_data(mesh.xy[corner], values[corner])
    count = len(mesh.cells)
    assert (parts.K.reshape(4, count).mean(axis=0) <= whole.K * (1 + 1e-12)).all()
    resistivity = parts.resistivity.reshape(4, count).mean(axis=0)
    assert (resistivity <= whole.resistivity[:, 0] * (1 + 1e-12)).all()
    # What is added to the resistivity of a cell that is refined is 40 % where the gap is halved.
    assert (resistivity >= 0.5 * whole.resistivity[:, 0]).all()


def test_the_ceiling_does_not_reach_the_quarters():
    """Of resistivities raised to that of the ceiling the mean is not that of the cell."""
    samples = GridField(np.random.default_rng(0).uniform(0.2, 1, (5, 5)), (1.0, 1.0))
    low, high = (represented(samples, ceiling=ceiling) for ceiling in (0.125, np.inf))
    mesh = uniform_mesh((4, 4), 1, periodic_sides=False)
    values = low.vertex_values(mesh)
    assert (low.cell_data(mesh, values).resistivity[:, 0] == 512).all()
    at_corners = mesh.xy[mesh.cells.T], values[mesh.cells.T]
    found, free = (gap.quarter_data(*at_corners).resistivity for gap in (low, high))
    assert np.array_equal(found, free)
    assert found.max() < 512


@pytest.mark.parametrize("contact", [False, True])
def test_quarters_of_any_triangles(contact):
    """Quarters are equal in area: their means average to that of the whole, which has a closed
    form. A few roundings. 1/g³ is infinite on two of the four quarters where one corner is contact,
    and taken for zero."""
    values = np.random.default_rng(0).uniform(0.1, 1, 4)
    values[0] *= not contact
    cells = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    xy = np.array([[0.0, 0.0], [2.0, 0.1], [1.5, 1.0], [-0.2, 1.3]])
    mesh = TriangleMesh(xy, cells, np.zeros((2, 3), dtype=np.int8), np.arange(4, dtype=np.int32))
    gap = VertexGap(values, 1.0, 0.0, 0.0)
    at_vertices = gap.vertex_values(mesh)
    found = gap.quarter_data(xy[cells.T], at_vertices[cells.T])
    whole = gap.cell_data(mesh, at_vertices)
    assert found.K.reshape(4, 2).mean(axis=0) == pytest.approx(whole.K, rel=1e-14, abs=0)
    parts = found.resistivity.reshape(4, 2)
    if contact:
        assert ((parts == 0).sum(axis=0) == 2).all()
    else:
        assert parts.mean(axis=0) == pytest.approx(whole.resistivity[:, 0], rel=1e-13, abs=0)
