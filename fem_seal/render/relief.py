"""The gap as a landscape: contact is its plateau, the flow runs through its valleys."""

from pathlib import Path

import numpy as np

from fem_seal.film.grid_film import GridFilm
from fem_seal.leak_rate import LeakRate
from fem_seal.render.flow import CONTACT, NO_FLOW, flow_of, flow_panel, flow_scale
from fem_seal.render.offscreen import Relief, draw_relief
from fem_seal.render.page import INLET, OUTLET, Panel, Swatch, write_page
from fem_seal.render.tiles import mosaic
from fem_seal.render.window import LONG_SIDE, step_above

SIDE = 400  # samples of the landscape along its longer side; each is the mean of a block of the gap
DEPTH = 0.06  # least depth of the deepest valley, as part of the longer side
WIDTH = 4 * LONG_SIDE // 3  # width of the drawing before its margins are cut off [pixel]
PIN = Swatch("pin: critical constriction", (0, 0, 0))


def exaggeration(deepest: float, length: float) -> float:
    """Factor, 1, 2 or 5 times a power of ten, by which gaps are enlarged to visible depths.

    Parameters
    ----------
    deepest : largest gap [m]
    length : longer side of the seal [m]
    """
    return step_above(DEPTH * length / deepest)


def relief_picture(leak: LeakRate, film: GridFilm, path: str | Path) -> Path:
    """Picture of the gap as a landscape, its depth exaggerated, with the flow density on it.

    Parameters
    ----------
    leak : leak rate with its flow field
    film : film on a grid through which the fluid flows
    path : the file, .png, .pdf or .svg

    Returns
    -------
    Path of the file.
    """
    field = flow_of(leak)
    scale = flow_scale(field)
    flat = flow_panel(field, film, scale)
    view = mosaic(film, None, SIDE)
    gap = view.mean(view.samples)
    factor = exaggeration(float(gap.max()), max(film.size))
    across = [_centres(*of_axis) for of_axis in zip(view.block, gap.shape, strict=True)]
    x, y = (
        np.clip(origin + spacing * centres, 0.0, size)
        for origin, spacing, centres, size in zip(
            film.sites.origin, film.sites.spacing, across, film.size, strict=True
        )
    )
    # The picture covers the landscape from edge to edge.
    x[[0, -1]], y[[0, -1]] = (0.0, film.size[0]), (0.0, film.size[1])
    points = np.stack([*np.meshgrid(x, y, indexing="ij"), -factor * gap], axis=2)
    critical = film.constriction
    pin = None if critical is None else (*critical.position, -factor * critical.gap)
    pixels = draw_relief(Relief(points, flat.pixels, (INLET.colour, OUTLET.colour), pin), WIDTH)
    title = f"the gap as a landscape, its depth times {factor:g}; contact is the plateau"
    panel = Panel(pixels, flat.window, title, axes=False)
    return write_page([[panel]], path, scale=scale, key=(CONTACT, NO_FLOW, INLET, OUTLET, PIN))


def _centres(block: int, count: int) -> np.ndarray:
    """Positions of the centres of blocks of samples, counted in samples."""
    return block * np.arange(count) + 0.5 * (block - 1)
