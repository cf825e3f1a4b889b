"""Synthetic gaps and flows to draw, and the values that drawn colours stand for."""

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image
from sample_gaps import rough_gap

from fem_seal.grid import GridField
from fem_seal.leak_rate import FlowField
from fem_seal.render.colours import colour_map


def smooth_gap(shape, contact, seed=0, periodic=True):
    """Random gap of at most 1 µm on samples 1 µm apart, a part of which is in contact."""
    return GridField(1e-6 * rough_gap(shape, contact, seed, 3).values, (1e-6, 1e-6), periodic)


def drawn_pixels(path):
    """Colours (height, width, 3) of a picture, 0..255."""
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"), dtype=float)


def structured_flow(nx, ny, size, flux_of_x, pressure_of_x=lambda x: 1 - x):
    """Flow along x on an nx by ny grid of split squares; functions take x / Lx in [0, 1]."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    corner = i * (ny + 1) + j
    lower = np.stack([corner, corner + ny + 1, corner + ny + 2], axis=1)
    upper = np.stack([corner, corner + ny + 2, corner + 1], axis=1)
    cells = np.concatenate([lower, upper])
    x, y = np.meshgrid(np.linspace(0, 1, nx + 1), np.linspace(0, 1, ny + 1), indexing="ij")
    points = np.stack([x.ravel() * size[0], y.ravel() * size[1]], axis=1)
    # One value per column of squares, so that a column is one flat colour.
    flux = np.zeros((len(cells), 2))
    flux[:, 0] = flux_of_x((np.tile(i, 2) + 0.5) / nx)
    return FlowField(points, cells, np.ones(len(points)), pressure_of_x(x.ravel()), flux)


def table_of(colours):
    """The 256 colours (256, 3) of a map, 0..255: number k is that of k/256 to (k + 1)/256."""
    return colour_map(colours)(np.arange(256), bytes=True)[:, :3].astype(int)


def stand_for(pixels, colours, exact):
    """Whether each pixel (..., 3) has the colour of its exact position (0..1) on a map, which it
    may share with its neighbours on the map."""
    same = (pixels[..., None, :] == table_of(colours)).all(axis=-1)
    first, last = same.argmax(axis=-1), 255 - same[..., ::-1].argmax(axis=-1)
    rounding = 1e-9
    inside = (first / 256 <= exact + rounding) & (exact - rounding <= (last + 1) / 256)
    return same.any(axis=-1) & inside


def colours_of(draw, film, *arguments, **options):
    """Axes that a function draws a film into, and the drawn colour (nx, ny, 3) of each sample."""
    axes, again = (Figure().subplots() for _ in range(2))
    for each in (axes, again):
        draw(each, film, *arguments, **options)
    return axes, drawn_samples(again, film)


def drawn_samples(axes, film, width=6):
    """Colour (nx, ny, 3) in the middle of each sample of a film, of all images in some axes.

    The samples are drawn `width` pixels wide, without anything that lies on them.
    """
    ny, nx = axes.images[-1].get_array().shape[:2]
    for artist in axes.get_children():
        artist.set_visible(artist in axes.images)
    first = (0.0 if film.representation == "linear" else 0.5) - 0.5
    dx, dy = film.gap.spacing
    limits = {"xlim": (first * dx, (first + nx) * dx), "ylim": (first * dy, (first + ny) * dy)}
    axes.set(**limits, position=(0, 0, 1, 1), box_aspect=None)
    figure = axes.figure
    figure.set(dpi=100, size_inches=(nx * width / 100, ny * width / 100))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    upwards = np.asarray(canvas.buffer_rgba())[::-1, :, :3]
    return upwards[width // 2 :: width, width // 2 :: width].transpose(1, 0, 2)
