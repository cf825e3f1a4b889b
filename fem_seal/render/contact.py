"""Picture of contact and open domains, like Fig. 1 of the letter (PRL 108, 244301, 2012)."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.film.clusters import label, largest
from fem_seal.film.grid_film import GridFilm
from fem_seal.film.lattice import DUAL_CONNECTIVITY, Lattice
from fem_seal.render.colours import CONTACT_COLOUR, OPEN_COLOUR, Swatch
from fem_seal.render.page import Window, draw_samples, frame_film, page, window_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Contact is grey, open is blue or green; the largest spot and channel are darker than the others.
CONTACT_KEY = (
    Swatch("other contact", CONTACT_COLOUR),
    Swatch("largest contact spot", (70, 72, 76)),
    Swatch("other open", OPEN_COLOUR),
    Swatch("largest open channel", (110, 180, 150)),
)


def contact_classes(sites: Lattice) -> np.ndarray:
    """Index in CONTACT_KEY of every site, uint8 of the shape of sites.gap.

    The connectivities of contact and open sites are dual: at most one of the two largest clusters
    spans.
    """
    classes = np.where(sites.open, np.uint8(2), np.uint8(0))
    phases = (
        (~sites.open, DUAL_CONNECTIVITY[sites.connectivity]),
        (sites.open, sites.connectivity),
    )
    for mask, connectivity in phases:
        classes[largest(*label(mask, connectivity, sites.periodic))] += 1
    return classes


def draw_contact(
    axes: "Axes", film: GridFilm, *, window: Window | None = None, title: str = ""
) -> None:
    """Draw contact and open domains, whole or in part; see `contact_picture`."""
    frame_film(axes, film, window, title)
    palette = np.array([(*swatch.colour, 255) for swatch in CONTACT_KEY], dtype=np.uint8)
    draw_samples(axes, film, palette[film.sites.on_samples(contact_classes(film.sites))])


def contact_picture(film: GridFilm, path: str | Path) -> Path:
    """Picture of contact (gap exactly 0) and open domains, the largest cluster of each in colour.

    Clusters are connected across the periodic sides of the film; `path` ends in .png, .pdf or .svg.
    """
    with page(window_of(film), path, key=CONTACT_KEY) as axes:
        draw_contact(axes[0, 0], film)
    return Path(path)
