"""The contact picture shows areas, positions and clusters of the gap."""

import numpy as np
import pytest
from drawn_fields import colours_of, smooth_gap
from PIL import Image

from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.contact import CONTACT_KEY, contact_classes, contact_picture, draw_contact
from fem_seal.render.page import Window

PALETTE = np.array([swatch.colour for swatch in CONTACT_KEY])


@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_every_sample_has_the_colour_of_its_class(sides):
    film = GridFilm(smooth_gap((96, 64), 0.46, seed=3), sides)
    _, colours = colours_of(draw_contact, film)
    classes = film.sites.on_samples(contact_classes(film.sites))
    assert len(np.unique(classes)) == 4
    np.testing.assert_array_equal(colours, PALETTE[classes])


def test_pixels_of_a_large_grid_have_the_mean_colour_of_their_samples(tmp_path):
    """Stripes of contact, one sample in four, all finer than a pixel: a quarter of its colour."""
    values = np.ones((4000, 4000))
    values[:, ::4] = 0.0
    film = GridFilm(GridField(values, (1.0, 1.0)), "wall", "constant")
    with Image.open(contact_picture(film, tmp_path / "a.png")) as image:
        pixels = np.asarray(image.convert("RGB"), dtype=float)
    rows, columns = (slice(n // 3, 2 * n // 3) for n in pixels.shape[:2])
    middle = pixels[rows, columns].mean(axis=(0, 1))
    # Of the stripes one is the largest patch, and one channel the largest: 1 of 1000 of the rest.
    expected = 0.25 * PALETTE[0] + 0.75 * PALETTE[2]
    assert np.abs(middle - expected).max() < 1


def test_clusters_join_across_periodic_sides_only():
    """Channels along both sides are one channel if the sides are the same line."""
    values = np.ones((12, 12))
    values[:, [3, 4, 9]] = 0.0  # open: 0-2 and 10-11 (5 columns in all), 5-8 (4 columns)
    gap = GridField(values, (1e-6, 1e-6), periodic=True)
    for sides, orange in (("wall", {5, 6, 7, 8}), ("periodic", {0, 1, 2, 10, 11})):
        sites = GridFilm(gap, sides).sites
        classes = contact_classes(sites)[0, :12]
        assert set(np.flatnonzero(classes == 3)) == orange


def test_a_window_shows_the_same_samples_larger():
    film = GridFilm(smooth_gap((64, 64), 0.4, seed=5, periodic=False))
    window = Window(0, 21e-6, 21e-6, 42e-6)
    whole, colours = colours_of(draw_contact, film)
    part, same = colours_of(draw_contact, film, window=window)
    np.testing.assert_array_equal(colours, same)
    assert (*part.get_xlim(), *part.get_ylim()) == pytest.approx(window)
    assert whole.get_xlim() == pytest.approx((0, 63e-6))
