"""Critical constriction and pockets against slow references and closed forms."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from slow_reference import pieces, spans
from triangulations import film_on_triangles

from fem_seal.film import GridFilm
from fem_seal.grid import GridField

approx = partial(pytest.approx, rel=1e-12)

# Of few levels a whole inlet or outlet is often in contact.
levels = st.builds(
    lambda shape, seed, top: np.random.default_rng(seed).integers(0, top, shape).astype(float),
    hnp.array_shapes(min_dims=2, max_dims=2, min_side=2, max_side=9),
    st.integers(0, 2**32 - 1),
    st.sampled_from([2, 7]),
)


@settings(max_examples=50)
@given(
    levels,
    st.sampled_from(["wall", "periodic"]),
    st.sampled_from(["linear", "constant"]),
)
def test_critical_constriction_is_the_highest_level_that_spans(h, sides, representation):
    """What carries flow is what is joined to both ends; on triangles of any shape too. The place is
    one of the spanning cluster, not of a pocket with the same gap."""
    gap = GridField(h, (0.5, 2.0), periodic=True)
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
    widest = pieces(sites >= expected, connectivity, (False, around))
    spanning = np.isin(widest, np.intersect1d(widest[0], widest[-1])) & (widest >= 0)
    half = 0.5 if representation == "constant" else 0.0
    films = [film]
    if representation == "linear" and not around:
        films.append(film_on_triangles(sites, gap.spacing))
    for one in films:
        assert (one.constriction is None) == (expected == 0)
        if expected > 0:
            assert one.constriction.gap == expected
            i, j = np.rint(np.array(one.constriction.position) / gap.spacing - half).astype(int)
            assert spanning[i, j]
            assert sites[i, j] == expected


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
