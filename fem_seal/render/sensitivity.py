"""Picture of where a nanometre matters: the derivative of ln Q by the height of the face."""

from pathlib import Path

import numpy as np

from fem_seal.film.grid_film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.colours import CONTACT_COLOUR
from fem_seal.render.page import add_bar, draw_samples, frame_film, page, window_of
from fem_seal.render.pressures import on_samples
from fem_seal.render.scale import logarithmic_scale

DECADES = 3
LABEL = "|change of ln Q| for 1 nm of height on 1 µm²"


def sensitivity_picture(film: GridFilm, by_height: GridField, path: str | Path) -> Path:
    """Picture of |∂ ln Q/∂h| [1/m] per area, logarithmic; the tightest place is marked."""
    dx, dy = by_height.spacing
    size = np.abs(on_samples(film, by_height)) * 1e-9 * 1e-12 / (dx * dy)
    scale = logarithmic_scale(LABEL, size, DECADES, "flow")
    with page(window_of(film), path) as axes:
        frame_film(axes[0, 0], film, None, "Where a nanometre matters", marked=True)
        draw_samples(axes[0, 0], film, scale.paint(size, size > 0, CONTACT_COLOUR))
        add_bar(axes[0, 0], scale)
    return Path(path)
