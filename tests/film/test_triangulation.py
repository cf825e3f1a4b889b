"""Critical constriction on any mesh, against that of the grid."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from triangulations import grid_mesh

from fem_seal.film import GridFilm, MeshFilm
from fem_seal.grid import GridField


def films(gap: np.ndarray) -> tuple[MeshFilm, GridFilm]:
    """The same gap on the mesh of the pixels' triangles, one unit apart, and on its grid."""
    nx, ny = gap.shape
    mesh = grid_mesh((nx - 1, ny - 1), (nx - 1, ny - 1))
    i, j = np.rint(mesh.xy).astype(int).T
    return MeshFilm(mesh, gap[i, j]), GridFilm(GridField(gap, (1.0, 1.0)))


@settings(max_examples=25)
@given(st.integers(2, 8), st.integers(2, 8), st.floats(0, 0.7), st.integers(0, 10**6))
def test_pixel_triangulation_has_the_constriction_of_its_grid(nx, ny, contact, seed):
    rng = np.random.default_rng(seed)
    gap = rng.uniform(0.1, 1, (nx, ny)) * (rng.random((nx, ny)) >= contact)
    found, expected = (film.constriction for film in films(gap))
    assert (found is None) == (expected is None)
    if found is not None:
        assert found.gap == expected.gap
        x, y = (round(c) for c in found.position)
        assert gap[x, y] == found.gap


@pytest.mark.parametrize("end", [0, -1])
def test_contact_on_the_whole_inlet_or_outlet_seals(end):
    """A path has to start on the inlet and end on the outlet."""
    gap = np.ones((3, 2))
    gap[end] = 0.0
    assert films(gap)[0].sealed
