"""Colour maps that leave room for contact, also in print without colour.

A map spans only a part of matplotlib's, so that its lightest colour is darker than contact (light
grey), which in turn is darker than white.
"""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.colors import Colormap

CONTACT_COLOUR = (214, 217, 221)
WHITE = (255, 255, 255)

# Name of ours: matplotlib's and the part of it that is used.
_PARTS = {
    "flow": ("magma_r", 0.22, 1.0),
    "gap": ("viridis", 0.0, 0.8),
    "pressure": ("viridis", 0.0, 0.8),
}
_STEPS = 256


@cache
def colour_map(name: str) -> "Colormap":
    """Give the map of a name: "flow", "gap", "pressure" or one of matplotlib's.

    Numbers below a scale are white.
    """
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    if name not in _PARTS:
        return colormaps[name].with_extremes(under="white")
    whole, first, last = _PARTS[name]
    colours = colormaps[whole](np.linspace(first, last, _STEPS))
    return ListedColormap(colours, name).with_extremes(under="white")
