"""Critical constriction and pockets against slow references and closed forms."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from slow_reference import pieces, spans
from triangulations import grid_mesh

from fem_seal.film import GridFilm, MeshFilm
from fem_seal.grid import GridField

approx = partial(pytest.approx, rel=1e-12)

# Of few levels a whole inlet or outlet is often in contact.
levels = st.builds(
    lambda shape, seed, top: np.random.default_rng(seed).integers(0, top, shape).astype(float),
    hnp.array_shapes(min_dims=2, max_dims=2, min_side=2, max_side=9),
    st.integers(0, 2**32 - 1),
    st.sampled_from([2, 7]),
)


def on_triangles(values):
    """The gap on a mesh of the pixels' triangles."""
    mx, my = np.array(values.shape) - 1
    mesh = grid_mesh((mx, my), (mx, my))
    return MeshFilm(mesh, values[tuple(np.rint(mesh.xy).astype(int).T)])


@settings(max_examples=50)
@given(
    levels,
    st.sampled_from(["wall", "periodic"]),
    st.sampled_from(["linear", "constant"]),
)
def test_critical_constriction_is_the_highest_level_that_spans(h, sides, representation):
    """What carries flow is what is joined to both ends; on triangles of any shape too."""
    gap = GridField(h, (1.0, 1.0), periodic=True)
    connectivity, sites = "4", h
    if representation == "linear":
        sites = gap.vertices()[:, :-1] if sides == "periodic" else gap.vertices()
        connectivity = "triangulation"
    around = sides == "periodic"
    expected = max(z for z in np.unique(sites) if spans(sites >= z, connectivity, around))
    film = GridFilm(gap, sides, representation)
    found = pieces(sites > 0, connectivity, (False, around))
    joined = [piece for piece in np.intersect1d(found[0], found[-1]) if piece >= 0]
    assert np.array_equal(film.carrying[:, : sites.shape[1]], np.isin(found, joined))
    half = 0.5 if representation == "constant" else 0.0
    meshed = [on_triangles(sites)] if representation == "linear" and not around else []
    for constriction in (one.constriction for one in (film, *meshed)):
        assert (constriction is None) == (expected == 0)
        if constriction is not None:
            assert constriction.gap == expected
            i, j = (round(c - half) for c in constriction.position)
            assert sites[i, j] == expected


@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_gap_and_position_of_a_saddle(representation):
    """gap = max(0, 0.2 + x² - 2y²): the constriction is the saddle point at the centre, also where
    a pocket before it in the order of the sites has the same gap."""
    x = np.linspace(-1, 1, 41)[:, None]
    y = np.linspace(-1, 1, 41)[None, :]
    h = np.maximum(0.0, 0.2 + x**2 - 2 * y**2)
    pocket = h.copy()
    assert not h[9:12, :3].any()
    pocket[10, 1] = h[20, 20]
    for values in (h, pocket):
        constriction = GridFilm(
            GridField(values, (0.05, 0.05)), "wall", representation
        ).constriction
        assert constriction.gap == approx(0.2, abs=1e-12)
        shift = 0.025 if representation == "constant" else 0.0
        assert constriction.position == approx((1 + shift, 1 + shift))


def test_trapped_volume_of_one_vertex():
    """One open vertex is a pyramid over 8 (even) or 4 (odd) right triangles: h · area / 3."""
    for (i, j), triangles in (((2, 2), 8), ((2, 3), 4)):
        h = np.zeros((5, 6))
        h[i, j] = 3e-6
        gap = GridField(h, (2.0, 0.5))
        exact = 3e-6 * (triangles * 0.5 * 2.0 * 0.5) / 3
        assert GridFilm(gap).trapped_volume == approx(exact, rel=1e-14)
        assert GridFilm(gap, "wall", "constant").trapped_volume == approx(3e-6, rel=1e-14)


@pytest.mark.parametrize("sides", ["wall", "periodic"])
@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_pocket_of_a_uniform_gap_holds_gap_times_area(sides, representation):
    """Between two contact lines the P1 gap is uniform but falls to 0 over the last pixels."""
    h = np.full((12, 8), 1e-6)
    h[2] = h[9] = 0
    gap = GridField(h, (1.0, 1.0), periodic=True)
    exact = 8 * 6 * 1e-6  # linear: 5 rows of pixels and 2 half rows; constant: 6 rows
    assert GridFilm(gap, sides, representation).trapped_volume == approx(exact, rel=1e-13)
    samples = 9 if representation == "linear" else 8
    assert GridFilm(gap, sides, representation).pockets.sum() == 6 * samples
