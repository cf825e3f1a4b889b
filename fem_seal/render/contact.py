"""Picture of contact and open domains, like Fig. 1 of the letter (PRL 108, 244301, 2012)."""

from pathlib import Path

import numpy as np

from fem_seal.film.clusters import label, largest
from fem_seal.film.grid_film import GridFilm
from fem_seal.film.lattice import DUAL_CONNECTIVITY, Lattice
from fem_seal.render.colours import CONTACT_COLOUR, OPEN_COLOUR
from fem_seal.render.page import Panel, Swatch, panel_of, write_page
from fem_seal.render.tiles import Mosaic, Tiles, mosaic, paint
from fem_seal.render.window import LONG_SIDE, Window

# Contact is grey, open is blue or green; the largest patch and channel are darker than the others.
CONTACT_KEY = (
    Swatch("other contact", CONTACT_COLOUR),
    Swatch("largest contact patch", (70, 72, 76)),
    Swatch("other open", OPEN_COLOUR),
    Swatch("largest open channel", (110, 180, 150)),
)


def contact_classes(sites: Lattice) -> np.ndarray:
    """Index in CONTACT_KEY of every site.

    The connectivities of contact and open sites are dual: at most one of the two largest clusters
    spans.

    Returns
    -------
    uint8 array of the shape of sites.gap
        0 contact, 1 largest contact patch, 2 open, 3 largest open channel.
    """
    classes = np.where(sites.open, np.uint8(2), np.uint8(0))
    phases = (
        (~sites.open, DUAL_CONNECTIVITY[sites.connectivity]),
        (sites.open, sites.connectivity),
    )
    for mask, connectivity in phases:
        classes[largest(*label(mask, connectivity, sites.periodic))] += 1
    return classes


def contact_panel(
    film: GridFilm,
    *,
    window: Window | None = None,
    long_side: int = LONG_SIDE,
    title: str = "",
) -> Panel:
    """Draw the contact and open domains; see `contact_picture` for the arguments."""
    view = mosaic(film, window, long_side)
    return panel_of(film, paint(_tiles(view), view.window, long_side), view.window, title)


def _tiles(view: Mosaic) -> Tiles:
    """Tiles in the colours of CONTACT_KEY."""
    classes = view.sites.on_samples(contact_classes(view.sites))
    return view.mean_colours(classes, np.array([s.colour for s in CONTACT_KEY]))


def contact_picture(
    film: GridFilm,
    path: str | Path,
    *,
    window: Window | None = None,
) -> Path:
    """Picture of contact (gap exactly 0) and open domains, the largest cluster of each in colour.

    Parameters
    ----------
    film : film on a grid; clusters are connected across its periodic sides
    path : the file, .png, .pdf or .svg
    window : part of the seal to show [m]; all if left out. Clusters are those of the whole seal

    Returns
    -------
    Path of the file.
    """
    panel = contact_panel(film, window=window)
    return write_page([[panel]], path, key=CONTACT_KEY)
