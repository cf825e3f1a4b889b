"""Picture of the gap, in which contact differs in colour from the smallest open gap."""

from pathlib import Path

import numpy as np

from fem_seal.digits import readable
from fem_seal.errors import InvalidInput
from fem_seal.film.grid_film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.colours import CONTACT_COLOUR, colour_map
from fem_seal.render.offscreen import LONG_SIDE, Scale, Window, draw
from fem_seal.render.page import Panel, Swatch, write_page
from fem_seal.render.tiles import Mosaic, mosaic

GAP_COLOURS = "gap"
CONTACT = Swatch("contact (gap = 0)", CONTACT_COLOUR)
# Any scale will do for a gap that is 0 everywhere, which has no open sample to colour.
CLOSED = Scale("gap", 0.0, 1.0)
# Part of the area whose gap lies within the bar, so that few deep valleys do not set the scale.
SHOWN = 0.999


def gap_scale(gap: GridField, highest: float | None = None) -> tuple[Scale, float]:
    """Linear scale from zero in a readable unit.

    Parameters
    ----------
    gap : GridField
        Gap [m].
    highest : float, optional
        Upper end of the bar [m]; if left out, the gap that is not exceeded on the part SHOWN of
        the area.

    Returns
    -------
    scale : Scale
        In the readable unit.
    factor : float
        Readable units per metre.

    Raises
    ------
    InvalidInput
        If the gap is zero everywhere.
    """
    deepest = float(gap.values.max())
    if deepest <= 0:
        raise InvalidInput("the gap is zero everywhere: there is no open place to draw")
    if highest is None:
        # The quantile is 0 if less than 1 - SHOWN of the area is open; use the largest gap then.
        highest = float(np.quantile(gap.values, SHOWN)) or deepest
    factor, unit = readable(highest, "m")
    beyond = "max" if deepest > highest else "neither"
    return Scale(f"gap [{unit}]", 0.0, highest * factor, False, GAP_COLOURS, beyond), factor


def gap_panel(
    film: GridFilm,
    scale: Scale,
    factor: float,
    *,
    window: Window | None = None,
    long_side: int = LONG_SIDE,
    title: str = "",
) -> Panel:
    """Draw the gap on a scale from `gap_scale`; see `gap_picture` for the arguments."""
    view = mosaic(film, window, long_side)
    tiles = view.tiles(_colours(view, scale, factor))
    return Panel(draw([tiles], view.window, long_side), view.window, title)


def _colours(view: Mosaic, scale: Scale, factor: float) -> np.ndarray:
    """Colours of the tiles: that of the mean open gap, mixed with grey by the part in contact."""
    samples = view.crop(view.samples)
    mean, open_part = view.mean(samples), view.mean(samples > 0)
    open_mean = np.divide(mean, open_part, out=np.zeros_like(mean), where=open_part > 0) * factor
    position = (open_mean - scale.low) / (scale.high - scale.low)
    colours = 255 * colour_map(scale.colours)(position)[:, :, :3]
    contact = np.array(CONTACT.colour, dtype=float)
    return open_part[:, :, None] * colours + (1 - open_part)[:, :, None] * contact


def gap_picture(
    film: GridFilm,
    path: str | Path,
    *,
    highest: float | None = None,
    window: Window | None = None,
) -> Path:
    """Picture of the gap in a readable unit (nm, µm or mm), with contact in grey.

    A gap that is 0 everywhere has no colour bar.

    Parameters
    ----------
    film : GridFilm
        Film on a grid.
    path : str or Path
        The file, .png, .pdf or .svg.
    highest : float, optional
        Upper end of the bar [m], to compare pictures; if left out, as in `gap_scale`.
    window : Window, optional
        Part of the seal to show [m]; all if left out.

    Returns
    -------
    Path of the file.

    Raises
    ------
    InvalidInput
        If the window extends beyond the seal, or the path cannot be written.
    MissingPackage
        If no OpenGL library is installed.
    """
    closed = highest is None and film.highest == 0
    scale, factor = (CLOSED, 1.0) if closed else gap_scale(film.field, highest)
    panel = gap_panel(film, scale, factor, window=window)
    return write_page([[panel]], path, scale=None if closed else scale, key=(CONTACT,))
