"""The fluid's pressure on the samples: read from the flow exactly, continued under contact."""

import numpy as np
import pytest

from fem_seal.coupling.fluid_pressure import continued, on_sites, pressure_on_samples
from fem_seal.film import GridFilm
from fem_seal.finite_difference.node_pressure import node_pressure
from fem_seal.finite_difference.solver import solve
from fem_seal.flow import leak_rate
from fem_seal.grid import GridField
from fem_seal.leak_rate import FlowField

DROP = 3.0


def uniform_film(n, sides="periodic", representation="linear"):
    return GridFilm(GridField(np.ones((n, n)), (1.0, 1.0), periodic=True), sides, representation)


def flow_of(film, **options):
    return leak_rate(film, viscosity=1 / 12, pressure_drop=DROP, field=True, **options)


@pytest.mark.parametrize("sides", ["wall", "periodic"])
@pytest.mark.parametrize(
    ("representation", "method"), [("linear", "adaptive"), ("constant", "uniform")]
)
def test_linear_pressure_is_read_exactly(sides, representation, method):
    """A uniform gap has a pressure linear in x: no sample may differ by more than the solver."""
    film = uniform_film(12, sides, representation)
    field = flow_of(film, method=method).field
    pressure = pressure_on_samples(film, DROP, 0.0, on_sites(field, film))
    if representation == "linear":
        exact = DROP * (1 - np.arange(12) / 12)
    else:
        exact = DROP * (1 - (np.arange(12) + 0.5) / 12)
        exact[[0, -1]] = DROP, 0.0  # the rows at the ends have the ends' pressures
    exact = np.broadcast_to(exact[:, None], (12, 12))
    np.testing.assert_allclose(pressure, exact, atol=1e-6 * DROP)


def test_every_vertex_of_a_refined_mesh_is_read_as_it_is():
    """Vertices of the flow that are samples keep their value, on meshes finer than the samples."""
    rng = np.random.default_rng(2)
    gap = GridField(0.2 + rng.random((8, 8)), (1.0, 1.0), periodic=True)
    film = GridFilm(gap, "wall")
    field = flow_of(film, rtol=0.002).field
    on_grid = np.all(np.abs(field.points - np.rint(field.points)) < 1e-9, axis=1)
    assert np.count_nonzero(~on_grid) > 0  # refined beyond the samples
    i, j = np.rint(field.points[on_grid]).astype(int).T
    read = on_sites(field, film)
    np.testing.assert_allclose(read[i, j], field.pressure[on_grid], atol=1e-9 * DROP)


@pytest.mark.parametrize("turn", range(3))
@pytest.mark.parametrize("first", [True, False])
def test_sites_belong_to_the_triangle_that_holds_them(turn, first):
    """A square of two triangles with p = min(x, y), which has a kink at their common side.

    Whichever corner comes first and whichever triangle is read last, neither value may be continued
    beyond its triangle.
    """
    n = 9
    film = GridFilm(GridField(np.ones((n, n)), (1.0, 1.0)), "wall")
    last = film.samples.shape[0] - 1
    corners = last * np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
    cells = np.roll([[0, 1, 2], [0, 2, 3]], turn, axis=1)[:: 1 if first else -1]
    field = FlowField(corners, cells, np.ones(4), corners.min(axis=1), np.zeros((2, 2)))
    exact = np.minimum(*np.indices(film.samples.shape))
    np.testing.assert_allclose(on_sites(field, film), exact, atol=1e-12)


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_node_pressure_balances_the_conductance(sides, representation):
    """Power p·L·p of the sparse solve is that of the elimination, which shares no arithmetic.

    Flow out of the inlet, from the pressures alone, is the leak rate to rounding of the solve.
    """
    rng = np.random.default_rng(5)
    values = np.maximum(rng.random((16, 16)) - 0.3, 0)
    film = GridFilm(GridField(values, (1.0, 1.0), periodic=True), sides, representation)
    from fem_seal.finite_difference.stencil import flow_grid

    leak = solve(film, viscosity=1 / 12, pressure_drop=DROP)
    assert leak.value > 0
    network = flow_grid(film, 1 / 12, "linear-gap").network
    pressure = node_pressure(film, DROP)
    if film.sites.seam:
        pressure = pressure[:, :-1]
    first = 0 if representation == "linear" else -1
    below = DROP if representation == "linear" else pressure[0]
    above = pressure[1] if representation == "linear" else DROP
    drops = (below - above) if first == 0 else (above - below)
    np.testing.assert_allclose(np.nansum(network.x[0] * drops), leak.value, rtol=1e-9)


def test_continuation_stays_between_its_neighbours_and_keeps_what_is_known():
    rng = np.random.default_rng(1)
    values = rng.random((17, 12))
    hidden = values.copy()
    hidden[rng.random(values.shape) < 0.6] = np.nan
    filled = continued(hidden)
    known = np.isfinite(hidden)
    np.testing.assert_array_equal(filled[known], hidden[known])
    assert np.nanmin(hidden) <= filled.min() <= filled.max() <= np.nanmax(hidden)


def test_ends_of_a_sealed_film():
    """Fluid at rest has the pressure of the end it is joined to, up to the barrier."""
    values = np.ones((9, 8))
    values[4] = 0.0
    film = GridFilm(GridField(values, (1.0, 1.0), periodic=False), "wall")
    pressure = pressure_on_samples(film, DROP, 1.0, None)
    np.testing.assert_array_equal(pressure[:4], DROP)
    np.testing.assert_array_equal(pressure[5:], 1.0)
    assert np.all((pressure[4] > 1.0) & (pressure[4] < DROP))
