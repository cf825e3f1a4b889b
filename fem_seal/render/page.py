"""Panels of a picture on matplotlib's layout: axes in readable units, colour bars, a key below.

Axes are in metres; only their labels are in a readable unit.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fem_seal.digits import readable
from fem_seal.render.colours import INLET, OUTLET, Swatch, colour_map
from fem_seal.render.plot import FONT_POINTS, label_axis, new_figure
from fem_seal.render.scale import Scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fem_seal.film.grid_film import GridFilm

SIDE = 6.0  # longer side of a drawing [inch]
NARROWEST = 0.2  # least ratio of its sides; narrower strips are stretched to it
MARGINS = 0.8, 0.75  # numbers and titles beside and above a drawing [inch]
BAR = 0.85  # width of a colour bar with its label [inch]
KEY_LINE = 0.25  # height of a line of the key [inch]
ENTRY, LETTER = 0.5, 0.085  # width of an entry of the key without its name, and of a letter [inch]
END_WIDTH = 3.0  # width of the lines of inlet and outlet [point]
NAMES_BELOW = -37  # names of inlet and outlet, below the drawing [point]
RING = 11  # diameter of the ring around the critical constriction [point]
ISOLINES: dict[str, Any] = {"colors": "white", "linewidths": 0.7, "linestyles": "-"}


class Window(NamedTuple):
    """The rectangle of the seal that a drawing shows [m]."""

    x0: float
    x1: float
    y0: float
    y1: float

    @property
    def lengths(self) -> tuple[float, float]:
        """Lengths along x and y [m]."""
        return self.x1 - self.x0, self.y1 - self.y0

    @property
    def shape(self) -> tuple[float, float]:
        """Width and height of the drawing over its longer side; a narrow strip is stretched."""
        wide, high = (max(length / max(self.lengths), NARROWEST) for length in self.lengths)
        return wide, high


@contextmanager
def page(
    window: Window,
    *paths: str | Path,
    shape: tuple[int, int] = (1, 1),
    side: float = SIDE,
    key: Sequence[Swatch] = (),
) -> Iterator[np.ndarray]:
    """Axes of the panels of a picture, which is written at the end of the `with`.

    The files end in .png, .pdf or .svg. The shape is the number of rows and of columns of panels,
    each of which shows the window and has a longer `side` [inch]; below them stands the key.
    """
    from matplotlib.patches import Rectangle

    (rows, columns), (wide, high) = shape, window.shape
    size = columns * (side * wide + MARGINS[0] + BAR), rows * (side * high + MARGINS[1])
    with new_figure((size[0], size[1] + 2 * KEY_LINE), *paths, tight=True) as figure:
        panels = figure.subplots(rows, columns, squeeze=False)
        yield panels
        rings = [ring for axes in panels.flat for ring in axes.get_legend_handles_labels()[0]]
        entries = [
            Rectangle((0, 0), 1, 1, fc=swatch.rgb, ec="black", lw=0.6, label=swatch.name)
            for swatch in key
        ] + rings[:1]
        if entries:
            longest = max(len(str(entry.get_label())) for entry in entries)
            figure.legend(
                handles=entries,
                loc="outside lower center",
                ncols=max(1, min(len(entries), int(size[0] / (ENTRY + LETTER * longest)))),
                frameon=False,
                handlelength=1.2,
                handleheight=1.0,
                columnspacing=1.6,
                borderaxespad=0.2,
            )


def frame(axes: "Axes", window: Window, title: str = "", along_x: str = "") -> None:
    """Give axes the limits of a window, lengths in a readable unit, a title and words beside x."""
    (wide, high), (width, height) = window.lengths, window.shape
    axes.set(xlim=(window.x0, window.x1), ylim=(window.y0, window.y1))
    axes.set_box_aspect(height / width)
    stretch = height / high / (width / wide)
    if abs(np.log(stretch)) > 0.02:
        axis, times = ("y", stretch) if stretch > 1 else ("x", 1 / stretch)
        title = f"{title}, {axis} stretched {times:.3g} times".removeprefix(", ")
    axes.set_title(title, fontsize=FONT_POINTS, pad=5)
    factor, unit = readable(max(window.x1, window.y1), "m")
    axes.set_xlabel(f"x [{unit}]{along_x}")
    axes.set_ylabel(f"y [{unit}]")
    axes.tick_params(direction="out", length=3)
    axes.locator_params(nbins=6)
    for along in (axes.xaxis, axes.yaxis):
        along.set_major_formatter(lambda length, _: f"{length * factor:.6g}")


def frame_film(
    axes: "Axes",
    film: "GridFilm",
    window: Window | None = None,
    title: str = "",
    *,
    marked: bool = False,
) -> Window:
    """Frame a film on a grid, whole or in part, with inlet, outlet and, if `marked`, its ring.

    The ring is the critical constriction, where the window shows it.
    """
    whole = window_of(film)
    window = window or whole
    frame(axes, window, title, ", flow →")
    rounding = 1e-9 * whole.x1
    at_outlet = window.x1 >= whole.x1 - rounding
    ends = (window.x0 <= rounding, "left", INLET, 0), (at_outlet, "right", OUTLET, 1)
    for shown, side, swatch, at in ends:
        if shown:
            spine = axes.spines[side]
            spine.set(linewidth=END_WIDTH, edgecolor=swatch.rgb, capstyle="butt")
            spine.set_position(("outward", END_WIDTH / 2))
            axes.annotate(
                swatch.name,
                (at, 0),
                (0, NAMES_BELOW),
                xycoords="axes fraction",
                textcoords="offset points",
                ha=side,
                va="bottom",
                color=swatch.rgb,
                fontweight="bold",
            )
    critical = film.constriction if marked else None
    if critical is not None:
        from matplotlib.patheffects import withStroke

        x, y = critical.position
        if window.x0 <= x <= window.x1 and window.y0 <= y <= window.y1:
            black: dict[str, Any] = {"mfc": "none", "mec": "black", "mew": 1.4, "clip_on": False}
            (ring,) = axes.plot(x, y, "o", ms=RING, label="critical constriction", **black)
            ring.set_path_effects([withStroke(linewidth=3.2, foreground="white")])
    return window


def window_of(film: "GridFilm") -> Window:
    """The whole rectangle of a film on a grid."""
    return Window(0.0, film.size[0], 0.0, film.size[1])


def draw_samples(axes: "Axes", film: "GridFilm", colours: np.ndarray) -> None:
    """Draw the colours (nx, ny, 4) uint8 of a film's samples, each around its own place."""
    (x, y), (dx, dy), (nx, ny) = film.sites.origin, film.sites.spacing, colours.shape[:2]
    extent = x - dx / 2, x + (nx - 0.5) * dx, y - dy / 2, y + (ny - 0.5) * dy
    pixels = colours.transpose(1, 0, 2)
    axes.imshow(pixels, origin="lower", extent=extent, aspect="auto", interpolation="antialiased")


def add_bar(axes: "Axes", scale: Scale | None) -> None:
    """Add a colour bar of the height of a drawing beside it; none without a scale."""
    from matplotlib.cm import ScalarMappable

    if scale is None:
        return
    bar = axes.figure.colorbar(
        ScalarMappable(scale.norm, colour_map(scale.colours)),
        cax=axes.inset_axes((1.04, 0.0, 0.04, 1.0)),
        extend=scale.beyond,
        extendfrac=0.03,
    )
    bar.set_label(scale.label)
    if scale.logarithmic:
        label_axis(bar.ax.yaxis)
        if scale.low >= 1e-3 and scale.high < 1e4:
            bar.ax.yaxis.set_major_formatter("{x:g}")
    else:
        bar.ax.locator_params(axis="y", nbins=6)
    bar.ax.hlines(scale.lines, 0, 1, colors="white", linewidths=0.8)
