"""The gap as a landscape: contact is its plateau, the flow runs through its valleys."""

from math import ceil
from pathlib import Path

import numpy as np

from fem_seal.film.grid_film import GridFilm
from fem_seal.leak_rate import LeakRate
from fem_seal.render.colours import CONTACT, INLET, NO_FLOW, OUTLET, Swatch
from fem_seal.render.flow import draw_flow, flow_of, flow_scale
from fem_seal.render.offscreen import Relief, draw_relief
from fem_seal.render.page import SIDE, Window, add_bar, page, window_of
from fem_seal.render.plot import DPI
from fem_seal.render.scale import step_above

SAMPLES = 400  # samples of the landscape along its longer side, at most; means of blocks
DEPTH = 0.06  # least depth of the deepest valley, as part of the longer side
WIDTH = 1600  # width of the drawing before its margins are cut off [pixel]
PIN = Swatch("pin: critical constriction", (0, 0, 0))


def exaggeration(deepest: float, length: float) -> float:
    """Factor, 1, 2 or 5 times a power of ten, that makes the largest gap [m] a visible depth.

    `length` is the longer side of the seal [m].
    """
    return step_above(DEPTH * length / deepest)


def relief_picture(leak: LeakRate, film: GridFilm, path: str | Path) -> Path:
    """Picture of the gap as a landscape, its depth exaggerated, with the flow density on it.

    `path` ends in .png, .pdf or .svg.
    """
    field = flow_of(leak)
    scale, sites = flow_scale(field), film.sites
    gap = sites.on_samples(sites.gap)
    block = ceil(max(gap.shape) / SAMPLES)
    nx, ny = (n // block for n in gap.shape)
    gap = gap[: nx * block, : ny * block].reshape(nx, block, ny, block).mean(axis=(1, 3))
    factor = exaggeration(float(gap.max()), max(film.size))
    # The picture covers the landscape from edge to edge.
    x, y = np.linspace(0.0, film.size[0], nx), np.linspace(0.0, film.size[1], ny)
    points = np.stack([*np.meshgrid(x, y, indexing="ij"), -factor * gap], axis=2)
    critical = film.constriction
    pin = None if critical is None else (*critical.position, -factor * critical.gap)
    relief = Relief(points, _flat(leak, film), (INLET.colour, OUTLET.colour), pin)
    pixels = draw_relief(relief, WIDTH)
    height, width = pixels.shape[:2]
    key = (CONTACT, NO_FLOW, INLET, OUTLET, PIN)
    with page(Window(0, width, 0, height), path, side=1.3 * SIDE, key=key) as axes:
        axes[0, 0].imshow(pixels)
        axes[0, 0].set_axis_off()
        axes[0, 0].set_title(
            f"the gap as a landscape, its depth times {factor:g}; contact is the plateau"
        )
        add_bar(axes[0, 0], scale)
    return Path(path)


def _flat(leak: LeakRate, film: GridFilm) -> np.ndarray:
    """The flow from above, (height, width, 3) uint8, without axes, to be laid on the landscape."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    field = flow_of(leak)
    wide, high = window_of(film).shape
    figure = Figure((SIDE * wide, SIDE * high), dpi=DPI)
    canvas, axes = FigureCanvasAgg(figure), figure.add_axes((0, 0, 1, 1))
    draw_flow(axes, field, film, flow_scale(field))
    for line in axes.lines:
        line.remove()
    axes.set_axis_off()
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]
