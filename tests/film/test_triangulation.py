"""Critical constriction on any mesh, against that of the grid and against all simple paths."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem_seal.film import GridFilm
from fem_seal.film.mesh_film import VertexGraph
from fem_seal.grid import GridField


def pixel_edges(nx: int, ny: int) -> np.ndarray:
    """Sides of the pixels and their alternating diagonals."""
    v = np.arange(nx * ny).reshape(nx, ny)
    i, j = np.indices((nx - 1, ny - 1))
    even = ((i + j) % 2 == 0)[..., None]
    rising, falling = np.stack([v[:-1, :-1], v[1:, 1:]], -1), np.stack([v[1:, :-1], v[:-1, 1:]], -1)
    along = [np.stack([v[:-1], v[1:]], -1), np.stack([v[:, :-1], v[:, 1:]], -1)]
    return np.concatenate([e.reshape(-1, 2) for e in (*along, np.where(even, rising, falling))])


@settings(max_examples=60, deadline=None)
@given(st.integers(2, 8), st.integers(2, 8), st.floats(0, 0.7), st.integers(0, 10**6))
def test_pixel_triangulation_has_the_constriction_of_its_grid(nx, ny, contact, seed):
    rng = np.random.default_rng(seed)
    gap = rng.uniform(0.1, 1, (nx, ny)) * (rng.random((nx, ny)) >= contact)
    i, j = np.indices((nx, ny))
    points = np.stack([i.ravel(), j.ravel()], axis=1).astype(float)
    inlet, outlet = points[:, 0] == 0, points[:, 0] == nx - 1
    constriction = VertexGraph(gap.ravel(), pixel_edges(nx, ny), inlet, outlet).constriction(points)
    expected = GridFilm(GridField(gap, (1.0, 1.0))).constriction
    assert (constriction is None) == (expected is None)
    if constriction is not None:
        assert constriction.gap == expected.gap
        x, y = (int(c) for c in constriction.position)
        assert gap[x, y] == constriction.gap


@pytest.mark.parametrize("open_end", [0, 2])
def test_contact_on_the_whole_inlet_or_outlet_seals(open_end):
    """A path has to start on the inlet and end on the outlet."""
    gap = np.ones(3)
    gap[2 - open_end] = 0.0
    ends = np.arange(3)
    edges = np.array([[0, 1], [1, 2]])
    graph = VertexGraph(gap, edges, ends == 0, ends == 2)
    assert graph.constriction(np.zeros((3, 2))) is None
