"""Figures of curves: one size of letters; each file is written completely or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from fem_seal.files import atomic_write
from fem_seal.render.page import DPI, FONT_POINTS, picture_path

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@contextmanager
def new_figure(size: tuple[float, float], *paths: str | Path) -> "Iterator[Figure]":
    """Figure to draw into; it is written at the end of the `with`, not after an error.

    Parameters
    ----------
    size : width and height [inch]
    *paths : the files, .png, .pdf or .svg
    """
    files = [picture_path(path) for path in paths]
    import matplotlib
    from matplotlib.figure import Figure

    fonts = {"font.size": FONT_POINTS, "svg.fonttype": "path", "pdf.fonttype": 42}
    with matplotlib.rc_context(fonts):
        figure = Figure(figsize=size, dpi=DPI, facecolor="white", layout="constrained")
        yield figure
        for file in files:
            with atomic_write(file, durable=False) as staged:
                figure.savefig(staged, dpi=DPI)
