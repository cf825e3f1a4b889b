"""Pictures of the samples of a film: their colours are those of contact, gap and pressures."""

import numpy as np
import pytest
from drawn_fields import colours_of, drawn_pixels, smooth_gap, stand_for

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.colours import CONTACT
from fem_seal.render.plot import DPI
from fem_seal.render.samples import (
    CONTACT_KEY,
    CONTACT_PRESSURE_COLOURS,
    LIFT_SIDE,
    OPEN,
    POCKET,
    contact_classes,
    contact_picture,
    contact_pressure_picture,
    contact_pressure_scale,
    draw_contact,
    draw_contact_pressure,
    draw_fluid_pressure,
    draw_gap,
    gap_picture,
    gap_scale,
    lift_picture,
)
from fem_seal.render.scale import PRESSURE_COLOURS

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
    values = np.ones((1400, 1400))
    values[:, ::4] = 0.0
    film = GridFilm(GridField(values, (1.0, 1.0)), "wall", "constant")
    contact_picture(film, tmp_path / "a.png")
    pixels = drawn_pixels(tmp_path / "a.png")
    rows, columns = (slice(n // 3, 2 * n // 3) for n in pixels.shape[:2])
    middle = pixels[rows, columns]
    # Of the stripes one is the largest patch, and one channel the largest: 1 of 1000 of the rest.
    expected = 0.25 * PALETTE[0] + 0.75 * PALETTE[2]
    assert np.abs(middle.mean(axis=(0, 1)) - expected).max() < 1
    # No pixel has the colour of a single sample.
    for colour in PALETTE[[0, 2]]:
        assert (np.abs(middle - colour).max(axis=2) > 1).all()


def test_clusters_join_across_periodic_sides_only():
    """Channels along both sides are one channel if the sides are the same line."""
    values = np.ones((12, 12))
    values[:, [3, 4, 9]] = 0.0  # open: 0-2 and 10-11 (5 columns in all), 5-8 (4 columns)
    gap = GridField(values, (1e-6, 1e-6), periodic=True)
    for sides, orange in (("wall", {5, 6, 7, 8}), ("periodic", {0, 1, 2, 10, 11})):
        sites = GridFilm(gap, sides).sites
        classes = contact_classes(sites)[0, :12]
        assert set(np.flatnonzero(classes == 3)) == orange


def pressed(gap):
    """Contact pressure up to 2 MPa where a gap is 0."""
    random = np.random.default_rng(1).random(gap.shape)
    values = np.where(gap.values == 0, 2e6 * random, 0.0)
    return GridField(values, gap.spacing, gap.periodic)


def test_gap_and_contact_pressure_can_be_recovered_from_their_colours():
    gap = smooth_gap((40, 24), 0.3, periodic=False)
    scale, film, contact = gap_scale(gap.values), GridFilm(gap), gap.values == 0
    _, colours = colours_of(draw_gap, film, scale)
    assert (colours[contact] == CONTACT.colour).all()
    parts = np.maximum(gap.values * scale.per_si / scale.low, 1)
    exact = np.log(parts) / np.log(scale.high / scale.low)
    assert stand_for(colours, scale.colours, exact)[~contact].all()
    pressure = pressed(gap)
    axes, colours = colours_of(draw_contact_pressure, film, pressure)
    (bar,) = axes.child_axes
    assert bar.get_ylabel() == "contact pressure [MPa]"
    assert bar.get_ylim() == pytest.approx((0, 2))
    assert (colours[~contact] == OPEN.colour).all()
    assert stand_for(colours, CONTACT_PRESSURE_COLOURS, pressure.values / 2e6)[contact].all()


@pytest.mark.parametrize(
    ("least", "largest", "low", "high", "beyond"),
    [
        (3e-8, 1.5e-6, 0.02, 2.0, "neither"),  # both ends at a 1, 2 or 5
        (2e-6, 2e-6, 0.2, 2.0, "neither"),  # one decade at least
        (1e-12, 4e-6, 0.005, 5.0, "min"),  # three at most
    ],
)
def test_bar_is_no_longer_than_the_gap_needs(least, largest, low, high, beyond):
    """Contact, where the gap is 0, is not on the bar."""
    scale = gap_scale(np.array([[0.0, least], [largest, 0.0]]))
    assert (scale.low, scale.high) == pytest.approx((low, high), rel=1e-9)
    assert (scale.beyond, scale.logarithmic) == (beyond, True)


def test_closed_gap_is_all_contact(tmp_path):
    """A gap of 0 everywhere is drawn, although it has no scale."""
    closed = GridField(np.zeros((5, 5)), (1e-6, 1e-6))
    gap_picture(GridFilm(closed), tmp_path / "gap.png")
    assert (drawn_pixels(tmp_path / "gap.png") == CONTACT.colour).all(axis=2).mean() > 0.6
    with pytest.raises(InvalidInput, match="zero everywhere"):
        gap_scale(closed.values)


def test_single_samples_of_high_pressure_do_not_set_the_bar():
    values = np.full((100, 100), 0.7e6)
    values[0, 0] = 1e9
    scale = contact_pressure_scale(values)
    label = "contact pressure [MPa], peaks to 1000"
    assert (scale.high, scale.label) == (pytest.approx(1.0), label)
    assert scale.beyond == "max"


def test_an_open_film_has_no_bar(tmp_path):
    field = GridField(np.ones((5, 5)), (1e-6, 1e-6))
    none = GridField(np.zeros((5, 5)), (1e-6, 1e-6))
    axes, _ = colours_of(draw_contact_pressure, GridFilm(field), none)
    assert not axes.child_axes
    contact_pressure_picture(GridFilm(field), none, tmp_path / "p.png")
    assert (tmp_path / "p.png").is_file()


@pytest.mark.parametrize(
    ("representation", "length"),
    [("linear", 1e-12), ("linear", 1e6), ("constant", 1e-12), ("constant", 1e6)],
)
def test_fluid_pressure_and_its_isobars(representation, length):
    """Pressure that falls evenly along x: samples in its colours, and lines between them.

    In any unit each sample is drawn around its own place, half a spacing to either side.
    """
    n = 21
    gap = GridField(np.ones((n, n)), (length, length))
    film = GridFilm(gap, "wall", representation)
    pressure = GridField(np.repeat(np.linspace(1e5, 0, n)[:, None], n, 1), gap.spacing)
    axes, colours = colours_of(draw_fluid_pressure, film, pressure)
    assert stand_for(colours[:, 3], PRESSURE_COLOURS, np.linspace(1, 0, n)).all()
    # Samples are vertices from one edge to the other, or the centres of pixels.
    first = 0.0 if representation == "linear" else 0.5
    ends = [length * (first - 0.5), length * (first + n - 0.5)]
    assert axes.images[0].get_extent() == pytest.approx(2 * ends, abs=1e-12 * length)
    (lines,) = axes.collections
    assert lines.levels == pytest.approx(np.arange(10, 100, 10))
    for level, line in zip(lines.levels, lines.get_paths(), strict=True):
        exact = length * (first + (n - 1) * (1 - level / 100))
        assert line.vertices[:, 0] == pytest.approx(exact, rel=1e-6)


def test_the_outlet_of_a_periodic_film_has_the_pressure_of_the_outlet():
    """Its samples are those of the inlet, repeated."""
    film = GridFilm(GridField(np.ones((20, 20)), (1e-6, 1e-6), True), "periodic")
    pressure = GridField(np.linspace(1e5, 0, 20)[:, None].repeat(20, 1), (1e-6, 1e-6), True)
    _, colours = colours_of(draw_fluid_pressure, film, pressure)
    assert stand_for(colours[[0, -2, -1], 3], PRESSURE_COLOURS, np.array([1.0, 0.0, 0.0])).all()


def test_uniform_fluid_pressure_has_no_isobars():
    gap = smooth_gap((20, 20), 0.3)
    pressure = GridField(np.full((20, 20), 8e4), gap.spacing, True)
    axes, _ = colours_of(draw_fluid_pressure, GridFilm(gap, "periodic"), pressure)
    assert not axes.collections


def test_the_pressure_in_a_pocket_is_not_drawn():
    """Nothing determines it; the fluid beside the inlet has a pressure."""
    gap = np.zeros((20, 20))
    gap[:4, 8:12] = gap[10:14, 8:12] = 1e-6
    film = GridFilm(GridField(gap, (1e-6, 1e-6)), "wall", "constant")
    pressure = GridField(np.linspace(1e5, 0, 20)[:, None].repeat(20, 1), (1e-6, 1e-6))
    _, colours = colours_of(draw_fluid_pressure, film, pressure)
    pocket = (colours == POCKET.colour).all(axis=2)
    assert pocket[10:14, 8:12].all()
    assert pocket.sum() == 16


def test_lift_is_one_page_of_four_pictures(tmp_path):
    """Twice as wide and as high as one; the dry contact is closed everywhere."""
    gap = smooth_gap((20, 20), 0.3)
    fluid = GridField(np.linspace(1e5, 0, 20)[:, None].repeat(20, 1), gap.spacing, True)
    closed = GridField(np.zeros(gap.shape), gap.spacing, True)
    films = (GridFilm(field, "periodic") for field in (gap, closed))
    lift_picture(*films, pressed(gap), fluid, tmp_path / "lift.png")
    assert min(drawn_pixels(tmp_path / "lift.png").shape[:2]) > 2 * LIFT_SIDE * DPI
