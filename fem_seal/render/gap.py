"""Picture of the gap, in which contact differs in colour from the smallest open gap."""

from pathlib import Path

import numpy as np

from fem_seal.digits import readable
from fem_seal.errors import InvalidInput
from fem_seal.film.grid_film import GridFilm
from fem_seal.render.colours import CONTACT_COLOUR, colour_map
from fem_seal.render.page import Panel, Swatch, panel_of, write_page
from fem_seal.render.tiles import Mosaic, mosaic, paint
from fem_seal.render.window import LONG_SIDE, Scale, Window, logarithmic_scale

GAP_COLOURS = "gap"
DECADES = 3  # length of the colour bar
CONTACT = Swatch("contact (gap = 0)", CONTACT_COLOUR)


def gap_scale(*gaps: np.ndarray) -> tuple[Scale, float]:
    """One logarithmic scale for all gaps, in a readable unit; no gap lies above its end.

    Parameters
    ----------
    *gaps : the gaps to compare [m], 0 in contact

    Returns
    -------
    scale : scale in the readable unit
    factor : factor from metres to that unit
    """
    values = np.concatenate([gap.ravel() for gap in gaps])
    values = values[values > 0]
    if not values.size:
        raise InvalidInput("the gap is zero everywhere: there is no open place to draw")
    highest = float(values.max())
    factor, unit = readable(highest, "m")
    least = float(values.min())
    return logarithmic_scale(
        f"gap [{unit}]", least * factor, highest * factor, DECADES, GAP_COLOURS
    ), factor


def gap_panel(
    film: GridFilm,
    scale: tuple[Scale, float] | None,
    *,
    window: Window | None = None,
    long_side: int = LONG_SIDE,
    title: str = "",
) -> Panel:
    """Draw the gap on a scale from `gap_scale`; see `gap_picture` for the arguments."""
    view = mosaic(film, window, long_side)
    samples = view.crop(view.samples)
    tiles = view.tiles(tile_colours(view, samples, samples > 0, scale, CONTACT.colour))
    pixels = paint(tiles, view.window, long_side)
    return panel_of(film, pixels, view.window, title, marked=True)


def tile_colours(
    view: Mosaic,
    values: np.ndarray,
    coloured: np.ndarray,
    scale: tuple[Scale, float] | None,
    rest: tuple[int, int, int],
) -> np.ndarray:
    """Colours of the tiles: the colour of their mean value, mixed with `rest`.

    Parameters
    ----------
    values : (kx, ky), values of the samples inside the window
    coloured : (kx, ky) bool, samples whose value is shown
    scale : scale and the factor to its unit; None if no sample is coloured
    rest : colour of the other samples

    Returns
    -------
    (tiles along x, tiles along y, 3) float, 0..255
    """
    part = view.mean(coloured)[:, :, None]
    ground = (1 - part) * np.array(rest, dtype=float)
    if scale is None:
        return ground
    bar, factor = scale
    total = view.mean(np.where(coloured, values, 0.0))
    mean = np.divide(total, part[:, :, 0], out=np.full_like(total, bar.low), where=total > 0)
    position = bar.position(mean * factor)
    return part * 255 * colour_map(bar.colours)(position)[:, :, :3] + ground


def gap_picture(
    film: GridFilm,
    path: str | Path,
    *,
    scale: tuple[Scale, float] | None = None,
    window: Window | None = None,
) -> Path:
    """Picture of the gap on a logarithmic scale, with contact in grey.

    The critical constriction is marked. A gap that is 0 everywhere has no colour bar.

    Parameters
    ----------
    film : film on a grid
    path : the file, .png, .pdf or .svg
    scale : scale from `gap_scale`, to compare pictures; if left out that of this gap
    window : part of the seal to show [m]; all if left out

    Returns
    -------
    Path of the file.
    """
    if scale is None and film.highest > 0:
        scale = gap_scale(film.gap.values)
    panel = gap_panel(film, scale, window=window)
    return write_page([[panel]], path, scale=scale[0] if scale else None, key=(CONTACT,))
