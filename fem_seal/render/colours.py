"""Colours of all pictures: contact is grey, open places without a number are pale blue.

Also in print without colour they differ: each colour map is a part of one of matplotlib's whose
lightest colour is darker than the grey of contact, and that grey is darker than the pale blue.
"""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.colors import Colormap

CONTACT_COLOUR = (200, 202, 206)
OPEN_COLOUR = (214, 234, 252)
WHITE = (255, 255, 255)

# For each name the map of matplotlib, and the range 0..1 of it that is used.
_PARTS = {
    "flow": ("magma_r", 0.22, 1.0),
    "gap": ("viridis", 0.0, 0.76),
    "pressure": ("viridis", 0.0, 0.76),
    "contact pressure": ("YlOrRd", 0.44, 1.0),
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
