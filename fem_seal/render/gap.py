"""Picture of the gap, in which contact differs in colour from the smallest open gap."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import readable
from fem_seal.errors import InvalidInput
from fem_seal.film.grid_film import GridFilm
from fem_seal.render.colours import CONTACT_COLOUR, Swatch
from fem_seal.render.page import add_bar, draw_samples, frame_film, page, window_of
from fem_seal.render.scale import Scale, logarithmic_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GAP_COLOURS = "gap"
DECADES = 3  # length of the colour bar
CONTACT = Swatch("contact (gap = 0)", CONTACT_COLOUR)


def gap_scale(*gaps: np.ndarray) -> Scale:
    """One logarithmic scale for all gaps [m]; no gap lies above its end."""
    values = np.concatenate([gap.ravel() for gap in gaps])
    values = values[values > 0]
    if not values.size:
        raise InvalidInput("the gap is zero everywhere: there is no open place to draw")
    factor, unit = readable(float(values.max()), "m")
    return logarithmic_scale(f"gap [{unit}]", values, DECADES, GAP_COLOURS, factor)


def draw_gap(axes: "Axes", film: GridFilm, scale: Scale | None, *, title: str = "") -> None:
    """Draw the gap on a scale from `gap_scale`; a gap that is 0 everywhere has none."""
    frame_film(axes, film, None, title, marked=True)
    gap = film.sites.on_samples(film.sites.gap)
    scale = scale or Scale("", 0.0, 1.0)
    draw_samples(axes, film, scale.paint(gap, gap > 0, CONTACT.colour))


def gap_picture(film: GridFilm, path: str | Path) -> Path:
    """Picture of the gap on a logarithmic scale, contact in grey, the critical constriction marked.

    `path` ends in .png, .pdf or .svg.
    """
    scale = gap_scale(film.gap.values) if film.largest_gap > 0 else None
    with page(window_of(film), path, key=(CONTACT,)) as axes:
        draw_gap(axes[0, 0], film, scale)
        add_bar(axes[0, 0], scale)
    return Path(path)
