"""Figures on matplotlib's layout, with one size of letters; a file is written whole or not."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from fem_seal.errors import InvalidInput
from fem_seal.files import atomic_write, writing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

DPI = 200
FONT_POINTS = 10
FORMATS = (".png", ".pdf", ".svg")
# Labels of a logarithmic axis: an axis that spans less than the factor has labels at the multiples
# of the decades.
_STEPS = ((30, (1, 2, 5)), (300, (1, 3)), (math.inf, (1,)))


@contextmanager
def new_figure(
    size: tuple[float, float], *paths: str | Path, tight: bool = False
) -> "Iterator[Figure]":
    """Figure of a size [inch] to draw into; it is written at the end of the `with`.

    After an error it is not. A folder that is missing is made. A `tight` page ends where the
    drawing does, in place of having that size. The files end in .png, .pdf or .svg.
    """
    files = list(map(Path, paths))
    for file in files:
        if file.suffix.lower() not in FORMATS:
            raise InvalidInput(f"cannot write {file.name!r}: pictures end in {', '.join(FORMATS)}")
    import matplotlib
    from matplotlib.figure import Figure

    fonts = {"font.size": FONT_POINTS, "svg.fonttype": "path", "pdf.fonttype": 42}
    with matplotlib.rc_context(fonts):
        figure = Figure(figsize=size, dpi=DPI, facecolor="white", layout="constrained")
        yield figure
        for file in files:
            with writing(file.parent):
                file.parent.mkdir(parents=True, exist_ok=True)
            with atomic_write(file, durable=False) as staged:
                figure.savefig(staged, dpi=DPI, bbox_inches="tight" if tight else None)


def legend_below(axes: "Axes", place: str, columns: int = 2) -> None:
    """Name the series of some axes, each once, below all axes: there a legend hides no data."""
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    axes.figure.legend(
        once.values(),
        once,
        loc=f"outside lower {place}",
        ncols=columns,
        frameon=False,
        fontsize=FONT_POINTS - 1,
    )


def label_axis(axis: "Axis") -> None:
    """Label at least two ticks of a logarithmic axis, also if it spans less than a decade."""
    from matplotlib.ticker import (
        LogFormatterSciNotation,
        LogLocator,
        MaxNLocator,
        NullFormatter,
        NullLocator,
        ScalarFormatter,
    )

    low, high = axis.get_view_interval()
    if high < 6 * low:
        axis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
        axis.set_major_formatter(ScalarFormatter())
        axis.set_minor_locator(NullLocator())
        return
    steps = next(steps for span, steps in _STEPS if high < span * low)
    axis.set_major_locator(LogLocator(subs=steps, numticks=6))
    axis.set_major_formatter(LogFormatterSciNotation(minor_thresholds=(3, 3)))
    axis.set_minor_formatter(NullFormatter())
