"""Energies of quarters of triangles from the corners of the whole, against direct ones."""

import numpy as np
import pytest
from gaps import everything, represented
from sample_gaps import rough_gap

from fem_seal.film.law import PressureWeight, bounding_law
from fem_seal.flow.energy import gradients, shape_gradients
from fem_seal.flow.gap_on_mesh import VertexGap
from fem_seal.flow.quarters import QuarterShape, thrice_centroids
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.mesh.bisection import bisect
from fem_seal.mesh.nested import uniform_mesh
from fem_seal.mesh.triangles import TriangleMesh
from fem_seal.rarefied import kinetic

# Corners of the halves and of the quarters in (a, b, c, m, e, d), and which quarters halves have.
HALVES = [(3, 0, 1), (3, 2, 0)]
QUARTERS = [(5, 3, 0), (4, 3, 2), (5, 1, 3), (4, 0, 3)]
HALF_OF = [0, 1, 0, 1]


def points(corners: np.ndarray) -> np.ndarray:
    """Corners and middles (n, 6, 2) of triangles with corners (n, 3, 2)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.stack([a, b, c, (b + c) / 2, (c + a) / 2, (a + b) / 2], axis=1)


@pytest.mark.parametrize("seed", range(3))
def test_energies_of_bubbles(seed):
    """The bubble of m is linear on the halves, those of e and d on quarters: their gradients there,
    by differences of corner values, integrated one quarter after the other. Triangles of any shape
    but slivers: a dozen roundings, raised by the reciprocal of the smallest sine, squared."""
    rng = np.random.default_rng(seed)
    corners, v = rng.normal(size=(50, 3, 2)), rng.normal(size=(50, 3))
    slopes, area = shape_gradients(corners)
    longest = (np.diff(corners[:, [0, 1, 2, 0]], axis=1) ** 2).sum(axis=2).max(axis=1)
    corners, v, slopes, area = (some[area > 0.02 * longest] for some in (corners, v, slopes, area))
    assert len(area) > 30
    c = 10 ** rng.uniform(-3, 3, (4, len(area)))
    six, of_v = points(corners), gradients(slopes, v)
    # Gradients (bubble, quarter, n, 2) of the bubbles of m, e and d on the quarters.
    bubbles = np.zeros((3, 4, len(area), 2))
    for quarter, (first, _, _) in enumerate(QUARTERS):
        half = HALVES[HALF_OF[quarter]]
        bubbles[0, quarter] = shape_gradients(six[:, half])[0][:, 0]
        own, of_quarter = shape_gradients(six[:, QUARTERS[quarter]])
        bubbles[first - 3, quarter] = own[:, 0]
        assert of_quarter == pytest.approx(area / 4, rel=1e-12, abs=0)
    weight = c * area / 4
    shape = QuarterShape.of(*np.moveaxis(corners, -1, 0).swapaxes(1, 2))
    exact = np.einsum("qn,hqnx,kqnx->hkn", weight, bubbles, bubbles)
    scale = np.sqrt(np.einsum("hhn->hn", exact))
    assert np.array(shape.stiffness(c)) == pytest.approx(scale**2, rel=1e-10, abs=0)
    for k, found in zip((1, 2), shape.couplings(c), strict=True):
        assert (np.abs(found - exact[0, k]) < 1e-10 * scale[0] * scale[k]).all()
    assert (exact[1, 2] == 0).all()
    exact = np.einsum("qn,hqnx,nx->hn", weight, bubbles, of_v)
    whole = np.sqrt(weight.sum(axis=0) * (of_v**2).sum(axis=1))
    assert (np.abs(np.array(shape.slopes(v, c)) - exact) < 1e-10 * scale * whole).all()


def test_a_constant_added_changes_nothing():
    """Not even rounding: pressures near one differ by 1e-16 where little falls off."""
    rng = np.random.default_rng(0)
    shape, c = QuarterShape.of(*rng.normal(size=(2, 3, 20))), rng.random((4, 20))
    # Multiples of 2^-30 below one: sums with a whole number are exact.
    v = rng.integers(0, 1 << 30, (20, 3)) / (1 << 30)
    assert np.array_equal(shape.slopes(v, c), shape.slopes(v + 7, c))


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("width", [1, 2, 4, 8])
@pytest.mark.parametrize("halved", [0, 1])
@pytest.mark.parametrize("contact", [0.0, 0.05])
def test_means_on_the_quarters_of_a_grid(representation, width, halved, contact):
    """Those of the mesh of the quarters: closed forms below the pixel, samples on it, pyramids
    above. Diagonal cells (halved 0) and axial ones. A few roundings in another order."""
    gap = represented(rough_gap((16, 16), contact, 3, smooth=2), representation, width=8)
    meshes = [uniform_mesh(gap.squares, width, periodic_sides=False)]
    values = [gap.vertex_values(meshes[0])]
    for _ in range(halved + 2):
        step = bisect(meshes[-1], everything(meshes[-1]))
        meshes.append(step.mesh)
        values.append(gap.refined_values(values[-1], step.mesh, step.edge_ends))
    whole, fine = meshes[halved], meshes[halved + 2]
    corner = whole.cells.T
    found = gap.quarter_data(whole.xy[corner], values[halved][corner])
    exact = gap.cell_data(fine, values[halved + 2])
    there = thrice_centroids(np.moveaxis(whole.xy[corner], -1, 0)).reshape(2, -1)
    expected = fine.xy[fine.cells].sum(axis=1).T
    here, at = np.lexsort(there), np.lexsort(expected)
    assert np.array_equal(there[:, here], expected[:, at])
    assert found.K[here] == pytest.approx(exact.K[at], rel=1e-14, abs=0)
    assert (exact.K > 0).any()
    # Where there is contact the cells of the fine mesh have power traces.
    plain = ~exact.contact_vertex.any(axis=1)[at]
    assert plain.any()
    resistivity = exact.resistivity[at[plain], 0]
    assert found.resistivity[here[plain], 0] == pytest.approx(resistivity, rel=1e-14, abs=0)


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
