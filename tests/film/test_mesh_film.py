"""The film of a shape against closed forms; its topology: `test_constriction`."""

import numpy as np
import pytest
from triangulations import grid_mesh

from fem_seal.expression import evaluate
from fem_seal.film import MeshFilm
from fem_seal.threshold import threshold_of_cut

CELLS = 21  # of the square's side: none of the lines below passes through vertices alone
SIZE = 1 / CELLS


def film(expression, length=1):
    """A rectangle 1 m wide with the gap of a formula."""
    mesh = grid_mesh((CELLS * length, CELLS), (length, 1))
    return MeshFilm(mesh, evaluate(expression, mesh.xy))


@pytest.mark.parametrize("gap", [0.3, 1.0, 1.5])
def test_area_not_above_a_gap_of_a_plane(gap):
    """g = x + y: the area below g = h is h²/2 up to 1 and 1 - (2 - h)²/2 beyond, to rounding. On
    two squares the mean is (2 + 1)/2, and half of the area lies below it."""
    exact = gap**2 / 2 if gap <= 1 else 1 - (2 - gap) ** 2 / 2
    assert film("x + y").area_not_above(gap) == pytest.approx(exact, rel=1e-12)
    two = film("x + y", length=2)
    assert (two.mean_gap, two.area_not_above(1.5)) == pytest.approx((1.5, 0.5), rel=1e-12)


def test_contact_is_the_triangles_in_contact():
    """g = max(0, x - 1/2) touches on half the square, less the triangles that the line cuts."""
    wedge = film("max(0, x - 0.5)")
    assert 0.5 - SIZE <= wedge.contact_area_fraction <= 0.5
    # Mean of the exact gap 1/8; between vertices the kink raises it by SIZE² at most.
    assert 0.125 <= wedge.mean_gap <= 0.125 + SIZE**2


def test_threshold_of_a_shape():
    """g = y + (x - 1/2)²: the widest path runs along y = 1 and is tightest, 1, at x = 1/2.

    Below g = 1 lie 1 - ∫(x - 1/2)² dx = 11/12 of the area. The linear gap is above the curved one
    by SIZE²/4 at most, and the vertex next to the tightest place by SIZE²/4.
    """
    threshold = threshold_of_cut(film("y + (x - 0.5)**2"), "gap")
    assert threshold.area_sealed == pytest.approx(11 / 12, abs=SIZE**2)
    assert threshold.area_leaking == pytest.approx(threshold.area_sealed, abs=1e-9)


def test_volume_trapped_in_a_cone():
    """A cone of height and radius 0.2 in a contact patch of radius 0.4, the rest open: π 0.2³/3."""
    radius = "sqrt((x - 0.5)**2 + (y - 0.5)**2)"
    pocket = film(f"max(0, 0.2 - {radius}) + max(0, {radius} - 0.4)")
    assert not pocket.sealed
    # Kinks along the circle and at the tip, where vertices lie off them by less than SIZE.
    slack = 2 * np.pi * 0.2 * SIZE**2 + SIZE**3
    assert pocket.trapped_volume == pytest.approx(np.pi * 0.2**3 / 3, abs=slack)
    np.testing.assert_array_equal(pocket.pockets, np.hypot(*(pocket.mesh.xy - 0.5).T) < 0.2)
