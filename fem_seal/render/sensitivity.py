"""Picture of where a nanometre matters: the derivative of ln Q by the height of the face."""

from pathlib import Path

import numpy as np

from fem_seal.film.grid_film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.colours import CONTACT_COLOUR
from fem_seal.render.gap import tile_colours
from fem_seal.render.page import panel_of, write_page
from fem_seal.render.pressures import on_samples
from fem_seal.render.tiles import mosaic, paint
from fem_seal.render.window import LONG_SIDE, logarithmic_scale

DECADES = 3
LABEL = "|change of ln Q| for 1 nm of height on 1 µm²"


def sensitivity_picture(film: GridFilm, by_height: GridField, path: str | Path) -> Path:
    """Picture of |∂ ln Q/∂h| per area, on a logarithmic scale; the tightest place is marked.

    Parameters
    ----------
    film
        Film between the solids.
    by_height
        ∂ ln Q/∂h at the samples [1/m].
    path
        The file, .png, .pdf or .svg.
    """
    dx, dy = by_height.spacing
    size = np.abs(on_samples(film, by_height)) * 1e-9 * 1e-12 / (dx * dy)
    scale = logarithmic_scale(LABEL, float(size.min()), float(size.max()), DECADES, "flow")
    view = mosaic(film, None, LONG_SIDE)
    values = view.crop(size)
    tiles = view.tiles(tile_colours(view, values, values > 0, (scale, 1.0), CONTACT_COLOUR))
    pixels = paint(tiles, view.window, LONG_SIDE)
    panel = panel_of(film, pixels, view.window, "Where a nanometre matters", marked=True)
    return write_page([[panel]], path, scale=scale)
