"""Colours of all pictures: contact is grey, open places without a number are pale blue.

Also in print without colour they differ: each colour map is a part of one of matplotlib's whose
lightest colour is darker than the grey of contact, and that grey is darker than the pale blue.
"""

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.colors import Colormap


@dataclass(frozen=True)
class Swatch:
    """One entry of the key below a picture."""

    name: str  #: the meaning
    colour: tuple[int, int, int]  #: red, green, blue, 0..255

    @property
    def rgb(self) -> tuple[float, float, float]:
        """The colour in 0..1, as matplotlib has it."""
        red, green, blue = self.colour
        return red / 255, green / 255, blue / 255


# In print without colour the inlet is a darker grey than the outlet.
INLET, OUTLET = Swatch("inlet", (200, 30, 30)), Swatch("outlet", (70, 160, 255))
CONTACT = Swatch("contact", (200, 202, 206))
OPEN = Swatch("open", (214, 234, 252))
NO_FLOW = Swatch("open, but no flow", OPEN.colour)

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
    """Colour map by a name of _PARTS, or of a map of matplotlib."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    if name not in _PARTS:
        return colormaps[name]
    whole, first, last = _PARTS[name]
    colours = colormaps[whole](np.linspace(first, last, _STEPS))
    return ListedColormap(colours, name)
