"""The critical constriction: its width across, and its share of the pressure drop."""

import numpy as np
import pytest
from project import leak_rate

from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.leak_rate import FlowField
from fem_seal.quantities.constriction import cell_dissipation, channel_width, constriction

SPACING = (1e-6, 2e-6)


def slot(first, last, shape=(17, 33), periodic=False):
    """Contact but for columns first..last, tightest in the middle of the length."""
    gap = np.zeros(shape)
    gap[:, first : last + 1] = 1e-6
    gap[shape[0] // 2, first : last + 1] = 0.5e-6
    return GridField(gap, SPACING, periodic)


WALLED, AROUND = slot(10, 19), slot(10, 19, periodic=True)
ACROSS_THE_SEAM = GridField(np.roll(AROUND.values, 16, axis=1), SPACING, periodic=True)


@pytest.mark.parametrize(
    ("gap", "kind", "samples"),
    [
        # From contact to contact: a P1 gap is open up to the contact sample itself.
        (WALLED, ("wall", "linear"), 11),
        *((gap, ("periodic", "linear"), 11) for gap in (AROUND, ACROSS_THE_SEAM)),
        # Walls are solid; one on a sample counts as 1e-9 of a pixel away.
        (slot(0, 9), ("wall", "linear"), 10 + 1e-9),
        *((slot(*ends), ("wall", "constant"), 10) for ends in ((0, 9), (10, 19))),
        (AROUND, ("periodic", "constant"), 10),
        # One line of contact is on both sides of the channel around the cell.
        (slot(1, 32, periodic=True), ("periodic", "linear"), 33),
    ],
)
def test_width_of_a_slot(gap, kind, samples):
    found = constriction(GridFilm(gap, *kind))
    assert found.gap == 0.5e-6
    row = 8.5 if kind[1] == "constant" else 8
    assert found.x == pytest.approx(row * gap.spacing[0], rel=1e-12)
    assert found.width == pytest.approx(samples * 2e-6, rel=1e-12)
    assert found.pressure_share is None


def test_width_of_an_oblique_channel():
    """At 45 degrees the way across is √2 shorter than along y; off by less than a sample."""
    n, half = 65, 12
    i, j = np.indices((n, n))
    gap = np.where(np.abs(i - j) < half, 1.0 + 0.01 * np.abs(i - n // 2), 0.0)
    sites = GridFilm(GridField(gap, (1.0, 1.0))).sites
    assert channel_width(sites, (n // 2, n // 2)) == pytest.approx(
        np.sqrt(2) * half, abs=np.sqrt(2)
    )


# Where no contact lies across, the upper wall does, twenty samples away.
@pytest.mark.parametrize(("other", "width"), [((3, 3), 3 + np.sqrt(18)), ((4, 1), 3 + 20)])
def test_only_what_lies_across_is_the_other_side(other, width):
    """Within 60 degrees of straight across from the nearest contact, here at (0, -3): a contact
    45 degrees off is the other side, one 76 degrees off is not."""
    gap = np.ones((41, 41))
    gap[20, 17] = gap[20 + other[0], 20 + other[1]] = 0.0
    sites = GridFilm(GridField(gap, (1.0, 1.0))).sites
    assert channel_width(sites, (20, 20)) == pytest.approx(width, rel=1e-12)


def test_dissipation_of_a_linear_potential():
    """-j·∇φ times the area, whatever the triangles: here j = (2, 3) and φ = 5x + 7y."""
    rng = np.random.default_rng(3)
    corners = rng.normal(size=(6, 3, 2))
    points, cells = corners.reshape(-1, 2), np.arange(18).reshape(6, 3)
    flux = np.tile([2.0, 3.0], (6, 1))
    field = FlowField(points, cells, np.ones(18), np.zeros(18), flux)
    found = cell_dissipation(field, points @ [5.0, 7.0])
    areas = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 2
    np.testing.assert_allclose(found, -(2 * 5 + 3 * 7) * areas, rtol=1e-10)


def test_no_contact_no_width():
    gap = GridField(np.full((9, 9), 1e-6), SPACING, periodic=True)
    found = constriction(GridFilm(gap, "periodic", "linear"))
    assert (found.gap, found.width, found.pressure_share) == (1e-6, None, None)


def with_its_share(film):
    """Constriction with its share of the pressure drop."""
    field = leak_rate(film, viscosity=1e-3, pressure_drop=1e5, rtol=0.1, field=True).field
    return constriction(film, field, field.pressure)


def test_no_share_of_a_film_without_a_tight_place():
    """Between walls the disc of a uniform film covers most of it."""
    film = GridFilm(GridField(np.full((9, 9), 1e-6), SPACING))
    found = with_its_share(film)
    assert found.width == pytest.approx(film.size[1], rel=1e-6)
    assert found.pressure_share is None


def neck(height):
    """A wall across the flow with one hole of so much height, five samples wide."""
    gap = np.full((65, 65), 1e-6)
    gap[30:35] = 0.0
    gap[30:35, 28:37] = height
    return GridField(gap, (1e-6, 1e-6))


# Resistance outside of `neck` in squares of its gap: 60 of 64 along the flow, and (2/π) ln(1/sin
# (πw/2W)) = 1.04 where it narrows to w = 8 of W = 64 samples. In the hole: 4 of 8.5 (8, and a
# quarter of each sample in which it closes, the mean of g³ there) times (1e-6/height)³.
OUTSIDE, HOLE = 2.0, 4 / 8.5


def test_share_of_a_low_hole():
    """The hole takes (1e-6/height)³ times the pressure of the same squares outside.

    A low hole leaves no more than all that is outside. A high one leaves at least the pressure of
    the 44 rows of 64 beyond the disc, if the flow were uniform there (Thomson's principle); the
    samples beside the hole add 2 × 1.3/8.5.
    """
    shares = []
    for height in (0.05e-6, 0.8e-6):
        found = with_its_share(GridFilm(neck(height), "wall", "linear"))
        assert found.gap == height
        shares.append(found.pressure_share)
    assert 1 - OUTSIDE / (HOLE * 20**3) < shares[0] <= 1
    assert shares[1] < 1 - 44 / 64 / (OUTSIDE + HOLE / 0.8**3 + 2 * 1.3 / 8.5)


def test_share_is_seen_through_the_seam():
    """The disc around a hole at the edge of a periodic cell continues on the other side."""
    gap, shares = neck(0.05e-6).values[:64, :64], []
    for roll in (0, 32):
        rolled = GridField(np.roll(gap, roll, axis=1), (1e-6, 1e-6), periodic=True)
        shares.append(with_its_share(GridFilm(rolled, "periodic", "linear")).pressure_share)
    assert min(shares) > 1 - OUTSIDE / (HOLE * 20**3)
