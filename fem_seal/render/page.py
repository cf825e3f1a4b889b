"""A page of drawings with axes in readable units, colour bars and a key, written as one file."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import readable
from fem_seal.errors import InvalidInput
from fem_seal.files import atomic_write
from fem_seal.render.colours import colour_map
from fem_seal.render.window import Scale, Window

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.colorbar import Colorbar
    from matplotlib.figure import Figure

    from fem_seal.film.grid_film import GridFilm

DPI = 200
FONT_POINTS = 10
FORMATS = (".png", ".pdf", ".svg")

END_WIDTH = 3.0  # width of the lines of inlet and outlet [point]
NAME_HEIGHT = 0.2  # height of a number beside a colour bar [inch]

# Margins around each drawing [inch]: they hold the tick labels and axis titles.
LEFT, RIGHT, BOTTOM, TOP = 0.75, 0.2, 0.52, 0.15
# Height of a title; distance of a colour bar from the drawing, its width and its labels' [inch].
TITLE, BAR_GAP, BAR, BAR_LABELS = 0.25, 0.05, 0.16, 0.95
# Height of a key of one line and of each further line; width of an entry without its name [inch].
KEY, KEY_LINE, ENTRY = 0.28, 0.2, 0.5


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


def picture_path(path: str | Path) -> Path:
    """Path of a picture; InvalidInput if its suffix is not in FORMATS."""
    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        raise InvalidInput(f"cannot write {path.name!r}: pictures end in {', '.join(FORMATS)}")
    return path


def write_page(
    rows: Sequence[Sequence[Panel]],
    path: str | Path,
    *,
    scale: Scale | None = None,
    key: Sequence[Swatch] = (),
) -> Path:
    """Write panels in rows; their pixels are not resampled.

    Parameters
    ----------
    rows : panels, from the top row downwards
    path : the file, .png, .pdf or .svg; the last two embed the pixels and have letters as outlines
    scale : scale of all panels; each row gets a colour bar. (A panel may have one of its own.)
    key : colours with their meaning, shown below the panels
    """
    path = picture_path(path)
    with lettering():
        figure = page_figure(rows, scale=scale, key=key)
        with atomic_write(path, durable=False) as staged:
            figure.savefig(staged, dpi=DPI)
    return path


def lettering() -> AbstractContextManager[None]:
    """Context with the fonts of all pages; make and save figures inside it."""
    import matplotlib

    return matplotlib.rc_context({"font.size": FONT_POINTS, "svg.fonttype": "path"})


def page_figure(
    rows: Sequence[Sequence[Panel]],
    *,
    scale: Scale | None = None,
    key: Sequence[Swatch] = (),
) -> "Figure":
    """Figure of a page; call and save it inside `lettering`. Arguments as of `write_page`."""
    from matplotlib.figure import Figure

    if any(panel.marked for row in rows for panel in row):
        key = (*key, CONSTRICTION)
    boxes, (width, height) = _layout(rows, bar=scale is not None)
    width, columns, key_height = _key_layout(key, width)
    size = (width / DPI, (height + key_height) / DPI)
    figure = Figure(figsize=size, dpi=DPI, facecolor="white")
    for row, row_boxes in zip(rows, boxes, strict=True):
        above_key = [replace(box, y=box.y + key_height) for box in row_boxes]
        for panel, box in zip(row, above_key, strict=True):
            _place(figure, panel, box)
            if panel.scale is not None:
                _add_bar(figure, panel.scale, box)
        if scale is not None:
            _add_bar(figure, scale, above_key[-1])
    if key:
        _add_key(figure, key, columns)
    return figure


@dataclass(frozen=True)
class _Box:
    """Rectangle of a drawing on the page, in whole pixels from the lower left corner."""

    x: int
    y: int
    width: int
    height: int

    def fraction(self, figure: "Figure") -> tuple[float, float, float, float]:
        """Left, bottom, width and height in fractions of the figure."""
        wide, high = figure.get_size_inches() * DPI
        return self.x / wide, self.y / high, self.width / wide, self.height / high


def _dots(inches: float) -> int:
    return round(inches * DPI)


def _layout(rows: Sequence[Sequence[Panel]], bar: bool) -> tuple[list[list[_Box]], tuple[int, int]]:
    """Boxes of the drawings, row by row, and the size of the page without its key [pixel]."""
    beside = _dots(BAR_GAP + BAR + BAR_LABELS)
    right = _dots(RIGHT) + (beside if bar else 0)
    tops = [_dots(TOP) + (_dots(TITLE) if any(p.heading for p in row) else 0) for row in rows]
    heights = [max(p.pixels.shape[0] for p in row) for row in rows]
    y = sum(tops) + sum(heights) + _dots(BOTTOM) * len(rows)
    page_height, page_width, boxes = y, 0, []
    for row, top, height in zip(rows, tops, heights, strict=True):
        y -= top + height
        x, row_boxes = 0, []
        for panel in row:
            x += _dots(LEFT)
            h, w = panel.pixels.shape[:2]
            row_boxes.append(_Box(x, y + height - h, w, h))
            x += w + _dots(RIGHT) + (beside if panel.scale is not None else 0)
        y -= _dots(BOTTOM)
        boxes.append(row_boxes)
        page_width = max(page_width, x - _dots(RIGHT) + right)
    return boxes, (page_width, page_height)


def _key_layout(key: Sequence[Swatch], page_width: int) -> tuple[int, int, int]:
    """Width of a page that is wide enough for the key; columns and height of the key [pixel]."""
    from matplotlib.textpath import TextPath

    if not key:
        return page_width, 0, 0
    names = [
        _dots(TextPath((0, 0), swatch.name, size=FONT_POINTS).get_extents().width / 72 + ENTRY)
        for swatch in key
    ]
    page_width = max(page_width, *names)
    # The legend fills column after column, as array_split does.
    columns = next(
        n
        for n in range(len(key), 0, -1)
        if sum(column.max() for column in np.array_split(names, n)) <= page_width
    )
    return page_width, columns, _dots(KEY + KEY_LINE * (-(-len(key) // columns) - 1))


def _place(figure: "Figure", panel: Panel, box: _Box) -> None:
    from matplotlib.patches import Rectangle

    # figimage copies the pixels; imshow would resample them by a fraction of a pixel.
    figure.figimage(panel.pixels, box.x, box.y, origin="upper", zorder=-1)
    axes = figure.add_axes(box.fraction(figure), facecolor="none")
    if panel.heading:
        axes.set_title(panel.heading, fontsize=FONT_POINTS, pad=5)
    if not panel.axes:
        axes.set_axis_off()
        return
    w = panel.window
    factor, unit = readable(max(w.x1, w.y1), "m")
    axes.set_xlim(w.x0 * factor, w.x1 * factor)
    axes.set_ylim(w.y0 * factor, w.y1 * factor)
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
        below = (0, -BOTTOM * 72 + 4)
        axes.annotate(
            swatch.name,
            (at, 0),
            below,
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


def _add_bar(figure: "Figure", scale: Scale, beside: _Box) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize

    x = beside.x + beside.width + _dots(RIGHT + BAR_GAP)
    box = _Box(x, beside.y, _dots(BAR), beside.height)
    norm = (LogNorm if scale.logarithmic else Normalize)(scale.low, scale.high)
    bar = figure.colorbar(
        ScalarMappable(norm, colour_map(scale.colours)),
        cax=figure.add_axes(box.fraction(figure)),
        extend=scale.beyond,
        extendfrac=0.03,
    )
    bar.set_label(scale.label)
    bar.ax.spines["outline"].set_linewidth(0.8)
    if scale.logarithmic:
        _name_decades(bar, scale, NAME_HEIGHT * DPI / box.height)
    else:
        bar.ax.locator_params(axis="y", nbins=6)
    bar.ax.hlines(scale.lines, 0, 1, colors="white", linewidths=0.8)


def _name_decades(bar: "Colorbar", scale: Scale, name_height: float) -> None:
    """Write numbers at both ends of a logarithmic bar, and at the decades not close to them.

    Parameters
    ----------
    name_height : height of a number, as part of the bar
    """
    from matplotlib.ticker import FixedFormatter, FixedLocator, NullFormatter

    first, last = np.ceil(np.log10(scale.low)), np.floor(np.log10(scale.high))
    decades = 10.0 ** np.arange(first, last + 1)
    place = scale.position(decades)
    inner = decades[(place > name_height) & (place < 1 - name_height)]
    named = [scale.low, *inner, scale.high]
    plain = scale.low >= 1e-3 and scale.high < 1e4
    bar.ax.yaxis.set_major_locator(FixedLocator(named))
    bar.ax.yaxis.set_minor_formatter(NullFormatter())
    bar.ax.yaxis.set_major_formatter(FixedFormatter([_number(v, plain) for v in named]))


def _number(value: float, plain: bool) -> str:
    """Number with one digit; with its power of ten unless `plain`."""
    if plain:
        return f"{value:.6g}"
    exponent = int(np.floor(np.log10(value) + 1e-9))
    digit = f"{value / 10.0**exponent:.0f}"
    power = f"10^{{{exponent}}}"
    return f"${power}$" if digit == "1" else f"${digit} \\cdot {power}$"


def _shade(colour: tuple[int, int, int]) -> tuple[float, float, float]:
    """Red, green and blue in 0..1, as matplotlib has them."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255


def _add_key(figure: "Figure", key: Sequence[Swatch], columns: int) -> None:
    handles = [_entry(swatch) for swatch in key]
    figure.legend(
        handles=handles,
        loc="lower center",
        ncols=columns,
        frameon=False,
        handlelength=1.2,
        handleheight=1.0,
        columnspacing=1.6,
        borderaxespad=0.4,
    )


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
