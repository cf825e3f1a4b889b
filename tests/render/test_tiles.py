"""Tiles are painted where they lie; a pixel has the mean colour of what it covers."""

import subprocess
import sys

import numpy as np
import pytest

from fem_seal.render.tiles import Tiles, paint
from fem_seal.render.window import Window


def test_tiles_fill_their_extent_exactly():
    rng = np.random.default_rng(0)
    colours = rng.integers(0, 256, (6, 4, 3)).astype(np.uint8)
    window = Window(0.0, 6e-9, 0.0, 4e-9)
    pixels = paint(Tiles(colours, window), window, 600)
    expected = colours.transpose(1, 0, 2)[::-1].repeat(100, axis=0).repeat(100, axis=1)
    np.testing.assert_array_equal(pixels, expected)


@pytest.mark.parametrize("length", [1e-12, 1e-3, 1e6])
def test_drawing_does_not_depend_on_the_unit_of_length(length):
    colours = np.zeros((3, 2, 3), dtype=np.uint8)
    colours[1, 0] = 200
    window = Window(0.0, 3 * length, 0.0, 2 * length)
    pixels = paint(Tiles(colours, window), window, 360)
    assert (pixels[120:, 120:240] == 200).all()
    assert np.count_nonzero(pixels) == 120 * 120 * 3


def test_outside_the_tiles_is_white():
    tiles = Tiles(np.zeros((1, 1, 3), dtype=np.uint8), Window(0.0, 1.0, 0.0, 1.0))
    pixels = paint(tiles, Window(-1.0, 1.0, 0.0, 1.0), 480)
    assert (pixels[:, :240] == 255).all()
    assert (pixels[:, 240:] == 0).all()


def test_pixels_have_the_mean_colour_of_the_tiles_that_they_cover():
    """Brute force: the picture of 7 x 5 tiles, 100 times finer, averaged; exact to 8 bits."""
    rng = np.random.default_rng(3)
    colours = rng.integers(0, 256, (7, 5, 3)).astype(np.uint8)
    whole, part = Window(0.0, 7.0, 0.0, 5.0), Window(1.3, 6.1, 0.2, 4.2)
    width, height = part.pixels(240)
    coarse = paint(Tiles(colours, whole), part, 240)
    x = part.x0 + (np.arange(20 * width) + 0.5) * (part.x1 - part.x0) / (20 * width)
    y = part.y0 + (np.arange(20 * height) + 0.5) * (part.y1 - part.y0) / (20 * height)
    fine = colours[x.astype(int)][:, y.astype(int)].astype(float)
    means = fine.reshape(width, 20, height, 20, 3).mean(axis=(1, 3))
    # Edges of tiles lie within a twentieth of a pixel, which can be 2 * 255/20 of a colour.
    assert np.abs(coarse - means.transpose(1, 0, 2)[::-1]).max() <= 2 * 255 / 20 + 1
    assert np.abs(coarse - means.transpose(1, 0, 2)[::-1]).mean() < 0.5


def test_opacity_mixes_with_the_ground():
    colours = np.zeros((2, 1, 4), dtype=np.uint8)
    colours[1] = 200, 100, 0, 51  # a fifth
    window = Window(0.0, 2.0, 0.0, 1.0)
    ground = np.full((240, 480, 3), 100, dtype=np.uint8)
    pixels = paint(Tiles(colours, window), window, 480, ground)
    assert (pixels[:, :240] == 100).all()
    assert (pixels[:, 240:] == (120, 100, 80)).all()


@pytest.mark.parametrize("call", ["contact_picture(film, p)", "gap_picture(film, p)"])
def test_pictures_of_a_grid_need_no_opengl(tmp_path, call):
    """VTK is not loaded, so that they are drawn where no OpenGL library is installed."""
    code = (
        "import sys, numpy as np\n"
        "from fem_seal.film import GridFilm\n"
        "from fem_seal.grid import GridField\n"
        "from fem_seal.render import contact_picture, gap_picture\n"
        "film = GridFilm(GridField(np.eye(9), (1.0, 1.0)))\n"
        f"p = {str(tmp_path / 'a.png')!r}\n"
        f"{call}\n"
        "assert not {'pyvista', 'vtkmodules'} & set(sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.png").stat().st_size > 1000
