"""Colour maps that differ from the grey of contact, also in print without colour.

Each map is a part of one of matplotlib's maps. Its lightest colour is darker than the light grey of
contact, and that grey is darker than white.
"""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.colors import Colormap

CONTACT_COLOUR = (214, 217, 221)
WHITE = (255, 255, 255)

# For each name the map of matplotlib, and the range 0..1 of it that is used.
_PARTS = {
    "flow": ("magma_r", 0.22, 1.0),
    "gap": ("viridis", 0.0, 0.8),
    "pressure": ("viridis", 0.0, 0.8),
    "contact pressure": ("YlOrRd", 0.4, 1.0),
}
_STEPS = 256


@cache
def colour_map(name: str) -> "Colormap":
    """Colour map by its name.

    Parameters
    ----------
    name : a name of _PARTS, or of a map of matplotlib

    Returns
    -------
    matplotlib Colormap
    """
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    if name not in _PARTS:
        return colormaps[name]
    whole, first, last = _PARTS[name]
    colours = colormaps[whole](np.linspace(first, last, _STEPS))
    return ListedColormap(colours, name)
