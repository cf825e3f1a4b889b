"""The gap as a map, contact set apart from the narrowest open places."""

from pathlib import Path

import numpy as np

from fem_seal.digits import readable
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.render.colours import CONTACT_COLOUR, colour_map
from fem_seal.render.offscreen import LONG_SIDE, Scale, Window, draw
from fem_seal.render.page import Panel, Swatch, write_page
from fem_seal.render.tiles import Mosaic, mosaic

GAP_COLOURS = "gap"
CONTACT = Swatch("contact (gap = 0)", CONTACT_COLOUR)
CLOSED = Scale("gap", 0.0, 1.0)  # of nothing: no open place takes a colour of it
SHOWN = 0.999  # of the area lies within the bar: a few deep valleys do not darken all the rest


def gap_scale(gap: GridField, highest: float | None = None) -> tuple[Scale, float]:
    """Choose the unit from the data: colours from zero to the gap that SHOWN of the area is below.

    Parameters
    ----------
    gap : gap [m]
    highest : upper end of the bar [m]; None takes it from the data

    Returns
    -------
    scale : in the readable unit
    factor : multiplies metres to give that unit

    Raises
    ------
    InvalidInput
        If the gap is zero everywhere, so that there is nothing to scale by.
    """
    deepest = float(gap.values.max())
    if deepest <= 0:
        raise InvalidInput("the gap is zero everywhere: there is no open place to draw")
    if highest is None:
        # Where less than the rest of the area is open at all, only the deepest gap is a scale.
        highest = float(np.quantile(gap.values, SHOWN)) or deepest
    factor, unit = readable(highest, "m")
    beyond = "max" if deepest > highest else "neither"
    return Scale(f"gap [{unit}]", 0.0, highest * factor, False, GAP_COLOURS, beyond), factor


def gap_panel(
    gap: GridField,
    scale: Scale,
    factor: float,
    *,
    representation: str = "linear",
    window: Window | None = None,
    long_side: int = LONG_SIDE,
    title: str = "",
) -> Panel:
    """Draw the gap on a scale from `gap_scale`; see `gap_picture` for the arguments."""
    # Colours of the samples do not depend on who neighbours whom across the sides.
    view = mosaic(gap, "wall", representation, window, long_side)
    tiles = view.tiles(_colours(view, scale, factor))
    return Panel(draw([tiles], view.window, long_side), view.window, title)


def _colours(view: Mosaic, scale: Scale, factor: float) -> np.ndarray:
    """Each tile: its mean open gap, and grey in the share that is contact."""
    samples = view.crop(view.samples)
    mean, share = view.mean(samples), view.mean(samples > 0)
    open_mean = np.divide(mean, share, out=np.zeros_like(mean), where=share > 0) * factor
    position = (open_mean - scale.low) / (scale.high - scale.low)
    colours = 255 * colour_map(scale.colours)(position)[:, :, :3]
    contact = np.array(CONTACT.colour, dtype=float)
    return share[:, :, None] * colours + (1 - share)[:, :, None] * contact


def gap_picture(
    gap: GridField,
    path: str | Path,
    *,
    representation: str = "linear",
    highest: float | None = None,
    window: Window | None = None,
) -> Path:
    """Picture of the gap, in nm, µm or mm as suits it, with contact in grey.

    A gap that is closed everywhere has no bar: all is contact.

    Parameters
    ----------
    gap : gap [m]
    path : .png, .pdf or .svg
    representation : "linear" (samples are vertices) or "constant" (samples fill pixels)
    highest : upper end of the bar [m], to compare pictures; None takes it from the data
    window : part of the seal to show [m]; None shows all

    Returns
    -------
    path

    Raises
    ------
    InvalidInput
        If the window leaves the seal, or the path cannot be written.
    MissingPackage
        If no OpenGL library is installed.
    """
    closed = highest is None and not gap.values.any()
    scale, factor = (CLOSED, 1.0) if closed else gap_scale(gap, highest)
    panel = gap_panel(gap, scale, factor, representation=representation, window=window)
    return write_page([[panel]], path, scale=None if closed else scale, key=(CONTACT,))
