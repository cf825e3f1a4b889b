"""Pictures of contact pressure, fluid pressure and lift: their colours are those of the values."""

import numpy as np
import pytest
from drawn_fields import colours_of, smooth_gap, stand_for
from PIL import Image

from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.plot import DPI
from fem_seal.render.pressures import (
    CONTACT_PRESSURE_COLOURS,
    LIFT_SIDE,
    OPEN,
    POCKET,
    contact_pressure_picture,
    contact_pressure_scale,
    draw_contact_pressure,
    draw_fluid_pressure,
    lift_picture,
)
from fem_seal.render.scale import PRESSURE_COLOURS


def pressed(gap):
    """Contact pressure up to 2 MPa where a gap is 0."""
    random = np.random.default_rng(1).random(gap.shape)
    values = np.where(gap.values == 0, 2e6 * random, 0.0)
    return GridField(values, gap.spacing, gap.periodic)


def test_contact_pressure_can_be_recovered_from_the_colours():
    gap = smooth_gap((40, 24), 0.3, periodic=False)
    pressure = pressed(gap)
    axes, colours = colours_of(draw_contact_pressure, GridFilm(gap), pressure)
    (bar,) = axes.child_axes
    assert bar.get_ylabel() == "contact pressure [MPa]"
    assert bar.get_ylim() == pytest.approx((0, 2))
    solid = pressure.values > 0
    assert (colours[~solid] == OPEN.colour).all()
    assert stand_for(colours, CONTACT_PRESSURE_COLOURS, pressure.values / 2e6)[solid].all()


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
    assert contact_pressure_picture(GridFilm(field), none, tmp_path / "p.png").is_file()


@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_fluid_pressure_and_its_isobars(representation):
    """Pressure that falls evenly along x: samples in its colours, and lines between them."""
    n = 21
    gap = GridField(np.ones((n, n)), (1e-6, 1e-6))
    film = GridFilm(gap, "wall", representation)
    pressure = GridField(np.repeat(np.linspace(1e5, 0, n)[:, None], n, 1), gap.spacing)
    axes, colours = colours_of(draw_fluid_pressure, film, pressure)
    assert stand_for(colours[:, 3], PRESSURE_COLOURS, np.linspace(1, 0, n)).all()
    # Samples are vertices from one edge to the other, or the centres of pixels.
    first = 0.0 if representation == "linear" else 0.5
    (lines,) = axes.collections
    assert lines.levels == pytest.approx(np.arange(10, 100, 10))
    for level, line in zip(lines.levels, lines.get_paths(), strict=True):
        exact = 1e-6 * (first + (n - 1) * (1 - level / 100))
        assert line.vertices[:, 0] == pytest.approx(exact, rel=1e-6)


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
    """Twice as wide and as high as one; also if the dry contact is closed everywhere."""
    gap = smooth_gap((20, 20), 0.3)
    fluid = GridField(np.linspace(1e5, 0, 20)[:, None].repeat(20, 1), gap.spacing, True)
    closed = GridField(np.zeros(gap.shape), gap.spacing, True)
    for dry in (gap, closed):
        films = (GridFilm(field, "periodic") for field in (gap, dry))
        lift_picture(*films, pressed(gap), fluid, tmp_path / "lift.png")
        with Image.open(tmp_path / "lift.png") as image:
            width, height = image.size
        assert min(width, height) > 2 * LIFT_SIDE * DPI
