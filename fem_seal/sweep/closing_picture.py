"""Animation and strip of a closing contact: gap and flow under rising loads, on common scales."""

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, log10
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import per_cent, with_prefix
from fem_seal.errors import InvalidInput
from fem_seal.files import atomic_write
from fem_seal.leak_rate import FlowField, LeakRate, relative_half_width
from fem_seal.render.colours import colour_map
from fem_seal.render.flow import FLOW_COLOURS, NO_FLOW, flow_density, flow_panel, flow_scale
from fem_seal.render.gap import CONTACT, GAP_COLOURS, gap_panel, gap_scale
from fem_seal.render.page import INLET, OUTLET, Panel, lettering, page_figure, write_page
from fem_seal.sweep.closing import LoadedFilm

if TYPE_CHECKING:
    from PIL.Image import Image as Pixels

KEY = (CONTACT, NO_FLOW)
FRAME_SIDE = 720  # longer side of each drawing of a frame before it is reduced [pixel]
REDUCTION = 2  # a frame is drawn this many times as large as it is shown
STRIP_SIDE = 420  # longer side of each drawing of the strip [pixel]
MOST_COLUMNS = 3  # more would make the lettering too small for a page
DECADES = 2  # length of the colour bar below the strongest flow of the tightest contact
COLOURS, GREYS = 256, 16  # number of colours of a GIF, and of greys among them
SECONDS, LAST_SECONDS = 0.5, 2.0  # duration of a frame, and of the last one


def closing_animation(steps: Sequence[LoadedFilm], path: str | Path) -> Path:
    """Write a GIF with a frame for each load: the gap at the left, the flow at the right.

    All frames share the scales of gap and flow density and one palette. Load, contact area and leak
    rate stand above the drawings.

    Parameters
    ----------
    steps : loads with film and leak rate; at least one of them leaks
    path : the file, .gif

    Returns
    -------
    Path of the file.
    """
    path = Path(path)
    if path.suffix != ".gif":
        raise InvalidInput(f"cannot write {path.name!r}: animations end in .gif")
    from PIL import Image

    frames = [_pixels([panels]) for panels in _panels(steps, FRAME_SIDE)]
    palette = _palette()
    first, *others = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    seconds = [SECONDS] * len(others) + [LAST_SECONDS]
    with atomic_write(path, durable=False) as staged:
        first.save(
            staged,
            format="GIF",
            save_all=True,
            append_images=others,
            duration=[round(1000 * s) for s in seconds],
            loop=0,
        )
    return path


def closing_strip(steps: Sequence[LoadedFilm], path: str | Path) -> Path:
    """Write up to three of the loads side by side: gaps in the upper row, flows in the lower one.

    Parameters
    ----------
    steps : as of `closing_animation`. The first and the last are shown
    path : the file, .png, .pdf or .svg

    Returns
    -------
    Path of the file.
    """
    places = np.linspace(0, len(steps) - 1, min(len(steps), MOST_COLUMNS)).round().astype(int)
    columns = _panels([steps[k] for k in places], STRIP_SIDE)
    # One bar beside each row.
    rows = [
        [*(replace(panel, scale=None) for panel in row[:-1]), row[-1]]
        for row in zip(*columns, strict=True)
    ]
    return write_page(rows, path, key=KEY)


def _panels(steps: Sequence[LoadedFilm], long_side: int) -> list[list[Panel]]:
    """Drawings of gap and flow under each load, each with its colour bar."""
    fields = [step.leak_rate.field for step in steps]
    flowing = [field for field in fields if field is not None]
    if not flowing:
        raise InvalidInput("no load leaves a flow to draw: begin with a lower one")
    gaps = gap_scale(*(step.film.gap.values for step in steps))
    flows = flow_scale(*flowing, decades=_decades(flowing))
    drawn = []
    for step, field in zip(steps, fields, strict=True):
        area = per_cent(step.film.contact_area_fraction)
        above = f"{with_prefix(step.pressure, 'Pa', 3)}, {area} in contact"
        gap = gap_panel(step.film, gaps, long_side=long_side, title=above)
        flow = flow_panel(
            field, step.film, flows, long_side=long_side, title=_rate_text(step.leak_rate)
        )
        drawn.append([replace(gap, scale=gaps[0]), replace(flow, scale=flows)])
    return drawn


def _decades(fields: Sequence[FlowField]) -> int:
    """Length [decades] of a colour bar that contains the strongest flow of each field."""
    peaks = [float(flow_density(field).max()) for field in fields]
    return DECADES + ceil(log10(max(peaks) / min(peaks)))


def _rate_text(leak: LeakRate) -> str:
    """Leak rate with the half-width of its bounds."""
    if leak.state == "sealed":
        return "sealed"
    rate = f"{leak.value:.1e} m³/s"
    if leak.lower is None or leak.upper is None:
        return rate
    return f"{rate} ± {per_cent(relative_half_width(leak.lower, leak.upper))}"


def _pixels(rows: Sequence[Sequence[Panel]]) -> "Pixels":
    """Page as an image of reduced size."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    with lettering():
        canvas = FigureCanvasAgg(page_figure(rows, key=KEY))
        canvas.draw()
    whole = Image.fromarray(np.asarray(canvas.buffer_rgba())[:, :, :3])
    return whole.reduce(REDUCTION)


def _palette() -> "Pixels":
    """Image with the colours of all frames; with one palette no colour flickers."""
    from PIL import Image

    greys = np.linspace(0, 255, GREYS).round()[:, None].repeat(3, axis=1)
    fixed = np.vstack([greys, [swatch.colour for swatch in (*KEY, INLET, OUTLET)]])
    steps = np.linspace(0, 1, (COLOURS - len(fixed)) // 2)
    maps = [255 * colour_map(name)(steps)[:, :3] for name in (GAP_COLOURS, FLOW_COLOURS)]
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.vstack([fixed, *maps]).round().astype(np.uint8).tobytes())
    return palette
