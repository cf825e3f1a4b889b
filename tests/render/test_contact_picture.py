"""The contact picture shows areas, positions and clusters of the gap."""

import numpy as np
import pytest
from drawn_fields import smooth_gap

from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.contact import CONTACT_KEY, contact_classes, contact_panel
from fem_seal.render.window import Window

pytestmark = pytest.mark.render
PALETTE = np.array([swatch.colour for swatch in CONTACT_KEY], dtype=float)
SIDE = 600


def area_shares(classes):
    """Area fractions of the classes of vertices; a vertex on the boundary has half a tile."""
    weights = [np.r_[0.5, np.ones(n - 2), 0.5] for n in classes.shape]
    area = np.outer(*weights)
    return np.array([area[classes == k].sum() for k in range(4)]) / area.sum()


def unlike_edges(classes):
    """Edges between tiles of different classes."""
    return np.count_nonzero(np.diff(classes, axis=0)) + np.count_nonzero(np.diff(classes, axis=1))


@pytest.mark.parametrize("sides", ["wall", "periodic"])
@pytest.mark.parametrize("area", [0.35, 0.46])
def test_colours_cover_the_area_shares(sides, area):
    gap = smooth_gap((96, 64), area, seed=3)
    sites = GridFilm(gap, sides).sites
    classes = sites.on_samples(contact_classes(sites)).astype(int)
    pixels = contact_panel(GridFilm(gap, sides), long_side=SIDE).pixels
    assert pixels.shape == (400, 600, 3)
    nearest = np.abs(pixels[:, :, None, :] - PALETTE).sum(axis=3).argmin(axis=2)
    drawn = np.bincount(nearest.ravel(), minlength=4) / nearest.size
    # Only pixels cut by an edge between classes can go to the wrong one, and of each at most half.
    tile = SIDE / 96
    tolerance = 0.5 * unlike_edges(classes) * tile / nearest.size
    assert np.abs(drawn - area_shares(classes)).max() < tolerance
    assert min(drawn) > 0  # all four classes occur, so that the comparison tests each


def test_thinned_grid_keeps_the_area_shares():
    """The colour of a block is the mean of its samples: the mean colour gives all four shares."""
    gap = smooth_gap((1300, 900), 0.4, seed=1)
    sites = GridFilm(gap).sites
    shares = area_shares(contact_classes(sites))
    pixels = contact_panel(GridFilm(gap), long_side=260).pixels
    # 5 x 5 samples per tile; rounding to 8 bits is random, tiles do not cross the frame by more
    # than half a sample on each of four sides, and that error is at most the rim's share.
    rim = 2 / 1300 + 2 / 900
    system = np.vstack([PALETTE.T / 255, np.ones(4)])
    drawn = np.linalg.solve(system, np.append(pixels.mean(axis=(0, 1)) / 255, 1.0))
    amplification = np.abs(np.linalg.inv(system)).sum(axis=1).max()
    assert np.abs(drawn - shares).max() < rim * amplification


def test_one_contact_sample_is_drawn_at_its_position():
    """Flow runs along x to the right, y points up: neither flipped nor transposed."""
    values = np.ones((31, 21))
    values[7, 16] = 0.0
    gap = GridField(values, (1e-6, 2e-6))
    pixels = contact_panel(GridFilm(gap), long_side=SIDE).pixels
    height, width = pixels.shape[:2]
    dark = np.argwhere((pixels == PALETTE[1]).all(axis=2))  # the only patch is the largest
    y, x = height - (dark[:, 0].mean() + 0.5), dark[:, 1].mean() + 0.5
    assert x == pytest.approx(7 / 30 * width, abs=0.5)
    assert y == pytest.approx(16 / 20 * height, abs=0.5)
    tile = (width / 30) * (height / 20)
    assert len(dark) == pytest.approx(tile, abs=width / 30 + height / 20)  # pixels on edges


def test_clusters_join_across_periodic_sides_only():
    """Channels along both sides are one channel if the sides are the same line."""
    values = np.ones((12, 12))
    values[:, [3, 4, 9]] = 0.0  # open: 0-2 and 10-11 (5 columns in all), 5-8 (4 columns)
    gap = GridField(values, (1e-6, 1e-6), periodic=True)
    for sides, orange in (("wall", {5, 6, 7, 8}), ("periodic", {0, 1, 2, 10, 11})):
        sites = GridFilm(gap, sides).sites
        classes = contact_classes(sites)[0, :12]
        assert set(np.flatnonzero(classes == 3)) == orange


def test_constant_representation_fills_whole_pixels():
    gap = GridField(np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 1.0]]), (1e-6, 1e-6))
    panel = contact_panel(GridFilm(gap, "wall", "constant"), long_side=600)
    assert panel.window == Window(0.0, 3e-6, 0.0, 2e-6)
    contact = (panel.pixels == PALETTE[1]).all(axis=2)
    assert contact[:200, :200].all()  # sample (0, 1): left column, upper row
    assert contact.sum() == 200 * 200


def test_window_shows_the_same_tiles_larger():
    gap = smooth_gap((64, 64), 0.4, seed=5, periodic=False)
    whole = contact_panel(GridFilm(gap), long_side=630).pixels  # 10 pixels per sample
    part = contact_panel(GridFilm(gap), long_side=630, window=Window(0, 21e-6, 21e-6, 42e-6)).pixels
    # Three times as large: every 15th pixel of the part is every 5th of the whole. Both stay clear
    # of the edges of tiles, which lie at 5 + 10 k in the whole and 15 + 30 k in the part.
    np.testing.assert_array_equal(part[7::15, 7::15], whole[212:420:5, 2:210:5])
