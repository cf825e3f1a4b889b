"""Pictures of the contact pressure, and of the pressure of a fluid that lifts the contact.

`lift_picture` shows the dry contact beside the lifted one.
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import readable
from fem_seal.film.grid_film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.colours import CONTACT_COLOUR, OPEN_COLOUR
from fem_seal.render.gap import CONTACT, gap_panel, gap_scale, tile_colours
from fem_seal.render.page import ISOLINES, Panel, Swatch, panel_of, write_page
from fem_seal.render.tiles import mosaic, paint
from fem_seal.render.window import (
    LONG_SIDE,
    Scale,
    Window,
    isoline_levels,
    step_above,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CONTACT_PRESSURE_COLOURS, PRESSURE_COLOURS = "contact pressure", "pressure"
OPEN = Swatch("open", OPEN_COLOUR)
POCKET = Swatch("pocket: its fluid pressure is assumed", (246, 222, 150))
# Part of the contact whose pressure lies within the colour bar; single peaks lie above it.
SHOWN = 0.999


def contact_pressure_scale(pressure: np.ndarray) -> tuple[Scale, float] | None:
    """Linear scale from 0 in a readable unit, and the factor from Pa to it; None if no contact."""
    carried = pressure[pressure > 0]
    if not carried.size:
        return None
    highest = step_above(float(np.quantile(carried, SHOWN)))
    factor, unit = readable(highest, "Pa")
    label, beyond = f"contact pressure [{unit}]", "neither"
    if carried.max() > highest:
        label, beyond = f"{label}, at most {factor * carried.max():.2g}", "max"
    return Scale(label, 0.0, highest * factor, False, CONTACT_PRESSURE_COLOURS, beyond), factor


def contact_pressure_panel(
    film: GridFilm,
    pressure: GridField,
    *,
    window: Window | None = None,
    long_side: int = LONG_SIDE,
    title: str = "",
) -> Panel:
    """Draw the contact pressure with a bar of its own; see `contact_pressure_picture`."""
    view = mosaic(film, window, long_side)
    samples = on_samples(film, pressure)
    values, scale = view.crop(samples), contact_pressure_scale(pressure.values)
    tiles = view.tiles(tile_colours(view, values, values > 0, scale, OPEN.colour))
    pixels = paint(tiles, view.window, long_side)
    return panel_of(film, pixels, view.window, title, scale=scale[0] if scale else None)


def contact_pressure_picture(
    film: GridFilm, pressure: GridField, path: str | Path, *, window: Window | None = None
) -> Path:
    """Picture of the pressure between the solids, pale blue where they do not touch.

    Parameters
    ----------
    film : film between the solids
    pressure : contact pressure [Pa]; in a lifted contact its excess over the fluid's pressure
    path : the file, .png, .pdf or .svg
    window : part of the seal to show [m]; all if left out

    Returns
    -------
    Path of the file.
    """
    panel = contact_pressure_panel(film, pressure, window=window)
    return write_page([[panel]], path, key=(OPEN,))


def fluid_pressure_panel(
    film: GridFilm, pressure: GridField, *, long_side: int = LONG_SIDE, title: str = ""
) -> Panel:
    """Draw the fluid's pressure with isobars and a bar of its own, and contact in grey.

    Pockets have a colour of their own: no fluid moves there, and nothing determines its pressure.

    Parameters
    ----------
    film : film of the fluid
    pressure : pressure [Pa] of the fluid, continued to the samples in contact
    long_side : length of the longer side [pixel]
    """
    view = mosaic(film, None, long_side)
    samples = on_samples(film, pressure)
    factor, unit = readable(float(np.abs(samples).max()), "Pa")
    low, high = factor * float(samples.min()), factor * float(samples.max())
    if not high > low:
        low, high = low - 0.5, high + 0.5
    levels = isoline_levels(low, high)
    scale = Scale(f"fluid pressure [{unit}]", low, high, colours=PRESSURE_COLOURS, lines=levels)
    wet = (view.samples > 0) & ~film.pockets
    colours = tile_colours(view, samples, wet, (scale, factor), CONTACT_COLOUR)
    colours += view.mean(film.pockets)[:, :, None] * np.subtract(POCKET.colour, CONTACT_COLOUR)
    pixels = paint(view.tiles(colours), view.window, long_side)
    panel = panel_of(film, pixels, view.window, title, scale=scale, marked=True)
    shown = np.where(wet, factor * samples, np.nan)
    lines = [level for level in levels if (shown < level).any() and (shown > level).any()]
    if not lines or min(shown.shape) < 2:
        return panel
    (x0, y0), (dx, dy), (mx, my) = film.sites.origin, film.sites.spacing, shown.shape

    def isobars(axes: "Axes", unit: float) -> None:
        x, y = unit * (x0 + dx * np.arange(mx)), unit * (y0 + dy * np.arange(my))
        axes.contour(x, y, shown.T, levels=lines, **ISOLINES)

    return replace(panel, isolines=isobars)


def lift_picture(
    lifted: GridFilm,
    dry: GridFilm,
    contact_pressure: GridField,
    fluid_pressure: GridField,
    path: str | Path,
    *,
    long_side: int = 600,
) -> Path:
    """Four pictures of a lift: gap, dry and lifted, and the pressures of solid and fluid.

    Of a sealed film the fluid's part of the load is an assumption: its pressure is known up to the
    place where it is sealed and behind it; a film of next to no height gives that in between.

    Parameters
    ----------
    lifted, dry : films with and without the fluid's pressure
    contact_pressure, fluid_pressure : pressures of the lifted contact [Pa]
    path : the file, .png, .pdf or .svg
    long_side : length of the longer side of each picture [pixel]

    Returns
    -------
    Path of the file.
    """
    gaps = [film.gap.values for film in (dry, lifted)]
    scale = gap_scale(*gaps) if any(gap.any() for gap in gaps) else None
    gap_panels = [
        gap_panel(film, scale, long_side=long_side, title=f"{name}: {_area(film)}")
        for film, name in ((dry, "dry"), (lifted, "lifted by the fluid"))
    ]
    if scale is not None:
        gap_panels = [replace(panel, scale=scale[0]) for panel in gap_panels]
    solid = contact_pressure_panel(
        lifted,
        contact_pressure,
        long_side=long_side,
        title=f"the solid carries {_mean(contact_pressure)}",
    )
    fluid = fluid_pressure_panel(
        lifted,
        fluid_pressure,
        long_side=long_side,
        title=f"the fluid carries {_mean(fluid_pressure)}{', by assumption' * lifted.sealed}",
    )
    key = (CONTACT, OPEN, POCKET) if lifted.pockets.any() else (CONTACT, OPEN)
    return write_page([gap_panels, [solid, fluid]], path, key=key)


def _area(film: GridFilm) -> str:
    return f"{100 * film.contact_area_fraction:.3g} % in contact"


def _mean(pressure: GridField) -> str:
    mean = float(pressure.values.mean())
    factor, unit = readable(mean, "Pa")
    return f"{mean * factor:.3g} {unit} on average"


def on_samples(film: GridFilm, field: GridField) -> np.ndarray:
    """Field on the film's samples; a linear periodic film repeats its first samples at the end."""
    return field.vertices() if film.representation == "linear" else field.values
