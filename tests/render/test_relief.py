"""The landscape of a gap: its depth, what lies on it, and where the pin stands."""

import numpy as np
import pytest
from drawn_fields import drawn_pixels, structured_flow

from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.colours import INLET, OUTLET
from fem_seal.render.relief import draw_relief, relief_picture
from fem_seal.render.scale import step_above

pytestmark = pytest.mark.render


def flat(pin=None, colour=(90, 140, 60)):
    """Drawing of a plane of one colour."""
    x, y = np.meshgrid(np.linspace(0, 2, 9), np.linspace(0, 1, 5), indexing="ij")
    picture = np.full((50, 100, 3), colour, np.uint8)
    return draw_relief(np.stack([x, y, 0 * x], axis=2), picture, pin, 300).astype(int)


@pytest.mark.parametrize("number", [1e-9, 3.3e-8, 2e-6, 5.1e3])
def test_factors_and_ends_of_bars_are_round_numbers(number):
    """The next 1, 2 or 5 times a power of ten: at most 2.5 times as much, up to its rounding."""
    step = step_above(number)
    assert number <= step * (1 + 1e-9) <= 2.5 * number
    assert f"{step:.0e}"[0] in "125"


def test_inlet_lies_left_outlet_right_and_the_pin_between():
    pixels = flat(pin=(1.0, 0.5, 0.0))
    places = {}
    for name, colour in (("inlet", INLET.colour), ("outlet", OUTLET.colour), ("pin", (0, 0, 0))):
        found = np.argwhere(np.abs(pixels - colour).max(axis=2) < 10)
        assert len(found) > 20, name
        places[name] = found[:, 1].mean()
    assert places["inlet"] < places["pin"] < places["outlet"]
    without = flat()
    assert (without.max(axis=2) > 10).all()
    # The foot stands on the plane: nothing black lies below the drawing of the plane alone.
    assert abs(pixels.shape[1] - without.shape[1]) <= 2


def test_level_ground_keeps_the_colours_of_the_key():
    """Contact is the plateau, and its grey must not be taken for the white of open ground."""
    pixels = flat()
    middle = pixels[pixels.shape[0] // 2, pixels.shape[1] // 2]
    assert np.abs(middle - (90, 140, 60)).max() <= 1  # rounding


def test_relief_is_written(tmp_path):
    gap = np.ones((21, 11))
    gap[5:9, 3:6] = 0.0
    film = GridFilm(GridField(gap * 1e-7, (1e-6, 1e-6)))
    field = structured_flow(20, 10, (20e-6, 10e-6), lambda x: 1e-9 * (1 + x))
    relief_picture(field, film, tmp_path / "relief.png")
    pixels = drawn_pixels(tmp_path / "relief.png")
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 100
