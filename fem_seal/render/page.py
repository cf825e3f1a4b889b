"""A page of drawings with axes in readable units, colour bars and a key, on matplotlib's layout."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fem_seal.digits import readable
from fem_seal.render.colours import colour_map
from fem_seal.render.plot import DPI, FONT_POINTS, label_axis, new_figure
from fem_seal.render.window import Scale, Window

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fem_seal.film.grid_film import GridFilm

END_WIDTH = 3.0  # width of the lines of inlet and outlet [point]
# Beside each drawing its numbers and titles, and a colour bar with its label; a line of the key; an
# entry of the key without its name, and a letter of it [inch].
MARGINS, BAR, KEY_LINE, ENTRY, LETTER = (0.8, 0.75), 0.85, 0.25, 0.5, 0.085
NAMES_BELOW = -37  # names of inlet and outlet, below the drawing [point]


@dataclass(frozen=True, eq=False)
class Panel:
    """A drawing, with the rectangle of the seal that it shows."""

    pixels: np.ndarray  #: (height, width, 3) uint8, the drawing
    window: Window  #: the rectangle [m]
    title: str = ""  #: title above the drawing, or empty
    #: whether the fluid flows along x, from left to right, and the label of the axis shows it
    along_x: bool = True
    #: scale of this drawing alone; its colour bar stands beside the drawing
    scale: Scale | None = None
    #: whether the left edge is the inlet, and the right edge the outlet
    ends: tuple[bool, bool] = (False, False)
    #: (x, y), critical constriction [m], to be marked
    constriction: tuple[float, float] | None = None
    #: whether the drawing has a frame with lengths; otherwise it has a title only
    axes: bool = True
    #: draws isolines into the axes, whose unit is the metre times the second argument
    isolines: "Callable[[Axes, float], object] | None" = None
    #: part of the drawing that another panel shows enlarged [m]; a rectangle marks it
    enlarged: Window | None = None

    @property
    def marked(self) -> bool:
        """Whether the window shows a critical constriction."""
        if self.constriction is None:
            return False
        (x, y), w = self.constriction, self.window
        return w.x0 <= x <= w.x1 and w.y0 <= y <= w.y1

    @property
    def heading(self) -> str:
        """Title, with a warning if the drawing is not to scale."""
        if not self.axes:
            return self.title
        height, width = self.pixels.shape[:2]
        w = self.window
        stretch = (height / (w.y1 - w.y0)) / (width / (w.x1 - w.x0))
        if abs(np.log(stretch)) < 0.02:
            return self.title
        axis, times = ("y", stretch) if stretch > 1 else ("x", 1 / stretch)
        return f"{self.title}, {axis} stretched {times:.3g} times".removeprefix(", ")


@dataclass(frozen=True)
class Swatch:
    """One entry of the key: a colour and its meaning."""

    name: str  #: the meaning
    colour: tuple[int, int, int]  #: red, green, blue, 0..255


# In print without colour the inlet is a darker grey than the outlet.
INLET, OUTLET = Swatch("inlet", (200, 30, 30)), Swatch("outlet", (70, 160, 255))
CONSTRICTION = Swatch("critical constriction", (0, 0, 0))  # drawn as a ring
RING = 11  # diameter of the ring [point]
ISOLINES: dict[str, Any] = {"colors": "white", "linewidths": 0.7, "linestyles": "-"}


def panel_of(
    film: "GridFilm",
    pixels: np.ndarray,
    window: Window,
    title: str = "",
    *,
    scale: Scale | None = None,
    marked: bool = False,
) -> Panel:
    """Panel of a film on a grid, with inlet, outlet and, if `marked`, the critical constriction.

    Parameters
    ----------
    film : the film that the pixels show
    pixels, window, title, scale
        As of `Panel`.
    marked : whether the critical constriction is marked, if there is one
    """
    length = film.size[0]
    rounding = 1e-9 * length
    ends = window.x0 <= rounding, window.x1 >= length - rounding
    critical = film.constriction if marked else None
    place = None if critical is None else critical.position
    return Panel(pixels, window, title, scale=scale, ends=ends, constriction=place)


def write_page(
    rows: Sequence[Sequence[Panel]],
    path: str | Path,
    *,
    scale: Scale | None = None,
    key: Sequence[Swatch] = (),
) -> Path:
    """Write panels in rows, each as large as its pixels.

    Parameters
    ----------
    rows : panels, from the top row downwards
    path : the file, .png, .pdf or .svg; the last two embed the pixels and have letters as outlines
    scale : scale of all panels; each row gets a colour bar. (A panel may have one of its own.)
    key : colours with their meaning, shown below the panels
    """
    if any(panel.marked for row in rows for panel in row):
        key = (*key, CONSTRICTION)
    # A scale of all panels has its bar at the end of each row.
    shown = [
        [panel if scale is None else replace(panel, scale=scale) for panel in row[-1:]]
        for row in rows
    ]
    drawn = [[*row[:-1], *last] for row, last in zip(rows, shown, strict=True)]
    names = [ENTRY + LETTER * len(swatch.name) for swatch in key]
    width = max(*(sum(map(_width, row)) for row in drawn), max(names, default=0.0) + 0.1)
    lines = ceil(sum(names) / width)
    height = sum(max(p.pixels.shape[0] / DPI + MARGINS[1] for p in row) for row in drawn)
    with new_figure((width, height + KEY_LINE * lines), path, tight=True) as figure:
        draw_page(figure, drawn)
        if key:
            figure.legend(
                handles=[_entry(swatch) for swatch in key],
                loc="outside lower center",
                ncols=ceil(len(key) / lines),
                frameon=False,
                handlelength=1.2,
                handleheight=1.0,
                columnspacing=1.6,
                borderaxespad=0.2,
            )
    return Path(path)


def _width(panel: Panel) -> float:
    """Width of a drawing with its axis and its colour bar [inch]."""
    return panel.pixels.shape[1] / DPI + MARGINS[0] + (BAR if panel.scale is not None else 0.0)


def draw_page(figure: "Figure", rows: Sequence[Sequence[Panel]]) -> None:
    """Draw panels, with their colour bars, into an empty figure."""
    for part, row in zip(figure.subfigures(len(rows), squeeze=False)[:, 0], rows, strict=True):
        ratios = [_width(panel) for panel in row]
        places = part.subplots(1, len(row), squeeze=False, width_ratios=ratios)[0]
        for panel, axes in zip(row, places, strict=True):
            _place(axes, panel)
            if panel.scale is not None:
                _add_bar(axes, panel.scale)


def _place(axes: "Axes", panel: Panel) -> None:
    from matplotlib.patches import Rectangle

    height, width = panel.pixels.shape[:2]
    axes.set_box_aspect(height / width)
    if panel.heading:
        axes.set_title(panel.heading, fontsize=FONT_POINTS, pad=5)
    if not panel.axes:
        axes.imshow(panel.pixels, aspect="auto")
        axes.set_axis_off()
        return
    w = panel.window
    factor, unit = readable(max(w.x1, w.y1), "m")
    extent = w.x0 * factor, w.x1 * factor, w.y0 * factor, w.y1 * factor
    axes.imshow(panel.pixels, extent=extent, aspect="auto")
    if panel.isolines is not None:
        panel.isolines(axes, factor)
        axes.set(xlim=extent[:2], ylim=extent[2:])
    axes.set_xlabel(f"x [{unit}], flow →" if panel.along_x else f"x [{unit}]")
    axes.set_ylabel(f"y [{unit}]")
    axes.tick_params(direction="out", length=3)
    axes.locator_params(nbins=6)
    for spine in axes.spines.values():
        spine.set_linewidth(0.8)
    _mark_ends(axes, panel.ends)
    if panel.marked and panel.constriction is not None:
        _mark_constriction(axes, *(factor * v for v in panel.constriction))
    if panel.enlarged is not None:
        part = panel.enlarged
        x, y, wide, high = (
            factor * v for v in (part.x0, part.y0, part.x1 - part.x0, part.y1 - part.y0)
        )
        axes.add_patch(Rectangle((x, y), wide, high, fill=False, ec=_shade(INLET.colour), lw=1.5))


def _mark_ends(axes: "Axes", ends: tuple[bool, bool]) -> None:
    """Colour the edges where the fluid enters and leaves, and name them under the axis."""
    sides = (("left", INLET, 0.0), ("right", OUTLET, 1.0))
    for shown, (side, swatch, at) in zip(ends, sides, strict=True):
        if not shown:
            continue
        colour = _shade(swatch.colour)
        spine = axes.spines[side]
        spine.set(linewidth=END_WIDTH, edgecolor=colour, position=("outward", END_WIDTH / 2))
        spine.set_capstyle("butt")
        axes.annotate(
            swatch.name,
            (at, 0),
            (0, NAMES_BELOW),
            xycoords="axes fraction",
            textcoords="offset points",
            ha=side,
            va="bottom",
            color=colour,
            fontweight="bold",
        )


def _mark_constriction(axes: "Axes", x: float, y: float) -> None:
    """Draw a black ring with a white rim, visible on any colour."""
    for width, colour in ((3.2, "white"), (1.4, _shade(CONSTRICTION.colour))):
        (ring,) = axes.plot(x, y, "o", markersize=RING, clip_on=False)
        ring.set(markerfacecolor="none", markeredgecolor=colour, markeredgewidth=width)


def _add_bar(axes: "Axes", scale: Scale) -> None:
    """Add a colour bar of the height of a drawing beside it."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize

    norm = (LogNorm if scale.logarithmic else Normalize)(scale.low, scale.high)
    bar = axes.figure.colorbar(
        ScalarMappable(norm, colour_map(scale.colours)),
        cax=axes.inset_axes((1.04, 0.0, 0.04, 1.0)),
        extend=scale.beyond,
        extendfrac=0.03,
    )
    bar.set_label(scale.label)
    bar.ax.spines["outline"].set_linewidth(0.8)
    if scale.logarithmic:
        label_axis(bar.ax.yaxis)
        if scale.low >= 1e-3 and scale.high < 1e4:
            bar.ax.yaxis.set_major_formatter("{x:g}")
    else:
        bar.ax.locator_params(axis="y", nbins=6)
    bar.ax.hlines(scale.lines, 0, 1, colors="white", linewidths=0.8)


def _shade(colour: tuple[int, int, int]) -> tuple[float, float, float]:
    """Red, green and blue in 0..1, as matplotlib has them."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255


def _entry(swatch: Swatch) -> "Artist":
    """Rectangle or ring with its name in the key."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    colour = _shade(swatch.colour)
    if swatch is not CONSTRICTION:
        return Patch(facecolor=colour, edgecolor="black", linewidth=0.6, label=swatch.name)
    ring = Line2D([], [], ls="", marker="o", markersize=RING, label=swatch.name)
    ring.set(markerfacecolor="none", markeredgecolor=colour, markeredgewidth=1.4)
    return ring
