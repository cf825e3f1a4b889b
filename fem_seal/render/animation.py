"""Animated GIF of the bounds of the leak rate, level by level."""

from collections.abc import Sequence
from pathlib import Path

from fem_seal.errors import InvalidInput
from fem_seal.files import atomic_write
from fem_seal.leak_rate import Level
from fem_seal.render.bounds import draw_bounds

FRAMES_PER_SECOND = 2
DPI = 100


def bounds_animation(levels: Sequence[Level], path: str | Path) -> Path:
    """Write the plot of `bounds_plot` with one frame per level, all with the same axes.

    Parameters
    ----------
    levels : refinement history, at least one level with a positive upper bound
    path : the file, .gif

    Returns
    -------
    Path of the file.
    """
    path = Path(path)
    if path.suffix != ".gif":
        raise InvalidInput(f"cannot write {path.name!r}: animations end in .gif")
    from matplotlib.animation import PillowWriter
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 3.4), facecolor="white", layout="constrained")
    draw_bounds(figure, levels)
    frames = sum(level.upper > 0 for level in levels)
    with atomic_write(path, durable=False) as staged:
        writer = PillowWriter(fps=FRAMES_PER_SECOND)
        with writer.saving(figure, str(staged), dpi=DPI):
            for count in range(1, frames + 1):
                figure.clear()
                draw_bounds(figure, levels, count)
                writer.grab_frame()
    return path
