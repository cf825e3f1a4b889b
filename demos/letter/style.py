"""Formats, colours and markers that the figures of the letter share, and what its text says."""

from pathlib import Path

FORMATS = ("png", "pdf")
# The colours of models also differ in their grey values; seeds and sizes differ in the marker.
COLOURS = {"bearing": "#b2452b", "elastic": "#1f4e9e"}
MARKERS = ("o", "s", "^", "D", "v", "p", "h", "<", ">", "*")
# What the letter's text says of Fig. 3: A*/A0 of each model with its uncertainty (elastic: one half
# less 0.075 ± 0.015), and by how many decades elastic deformation reduces the flow at A/A0 = 0.2.
LETTERS_THRESHOLDS = {"bearing": (0.5, 0.02), "elastic": (0.425, 0.025)}
LETTERS_DECADES = 3


def paths(folder: Path, name: str) -> list[Path]:
    """Paths of a figure in every format."""
    return [folder / f"{name}.{suffix}" for suffix in FORMATS]
