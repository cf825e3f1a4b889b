"""Picture of a sweep: the leak rate against the field that varies, with its bounds as a band."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import per_cent
from fem_seal.errors import InvalidInput
from fem_seal.leak_rate import relative_half_width
from fem_seal.render.plot import FONT_POINTS, label_axis, new_figure
from fem_seal.sweep.point import UNSETTLED, Point
from fem_seal.sweep.summary import SEEDS, Group, groups

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PICTURE_FILE = "sweep.png"
MOST_CURVES = 10  # more curves could not be distinguished
MARKERS = "osD^vPX*<>"
DECADE = 10.0
MOST_NAMES = 12  # largest number of names side by side under the axis
LONGEST_NAME = 24  # most characters of a name under the axis
MARGIN = 0.08  # margin above and below the curves, over the logarithm of their range
# States of points without a leak rate, and their marks in a strip below or above the axis.
STRIPS = {"sealed": "x", "lifted off": "^"}
BAND = 0.2  # opacity
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")


@dataclass(frozen=True)
class Curve:
    """Leak rates against one field, the other fields fixed."""

    label: str  #: the other fields with their values; empty if there are none
    #: place on the axis, ascending, and the points at that place; they differ in their seed only
    groups: tuple[tuple[float, Group], ...]
    joined: bool  #: whether a line joins the places; False if the places are seeds

    @property
    def seeds(self) -> bool:
        """Whether there are several points at a place, of different seeds."""
        return any(len(group.points) > 1 for _, group in self.groups)

    @property
    def points(self) -> list[tuple[float, Point]]:
        """All points with their places."""
        return [(place, point) for place, group in self.groups for point in group.points]

    def rows(self) -> np.ndarray:
        """Place, leak rate, lower and upper bound (n, 4) of all points that leak.

        Without bounds both are equal to the leak rate. A lower bound may be 0.
        """
        rows = []
        for place, point in self.points:
            value, lower, upper = (point.number(k) for k in ("leak_rate", "lower", "upper"))
            if value is not None and 0 < value < np.inf:
                bounds = (value, value) if lower is None or upper is None else (lower, upper)
                rows.append((place, value, *bounds))
        return np.array(rows).reshape(-1, 4)

    def ranges(self) -> np.ndarray:
        """Place, lower and upper end (n, 3) of the leak rates of all points that have not settled.

        The ends are those of the range with all counted errors, 0 and infinite if open. Points that
        are open at both ends cannot be drawn.
        """
        rows = []
        for place, point in self.points:
            if point.numbers["state"] == UNSETTLED:
                lower, upper = (point.number(f"together.{k}") for k in ("lower", "upper"))
                ends = lower or 0.0, np.inf if upper is None else upper
                if ends[0] > 0 or 0 < ends[1] < np.inf:
                    rows.append((place, *ends))
        return np.array(rows).reshape(-1, 3)

    def counts(self, state: str) -> list[tuple[float, int, int]]:
        """Place, number of points in a state there, and number of all points there."""
        counts = ((place, group.count(state), len(group.points)) for place, group in self.groups)
        return [count for count in counts if count[1]]


def sweep_figure(keys: tuple[str, ...], table: Sequence[Point], folder: Path) -> Path:
    """Plot the leak rate of a sweep against the first field that is no seed.

    The axis of the leak rate is logarithmic; that of the field is if it spans more than a decade.
    Each combination of the other fields is a curve with its bounds as a band. If a seed varies,
    each surface is a point, a line joins the medians, and the band extends from the smallest to the
    largest leak rate. Sealed points stand in a strip below the axis, points lifted off above it;
    points that have not settled have open markers with their ranges.
    """
    others = tuple(key for key in keys if key not in SEEDS)
    along = others[0] if others else keys[0]
    names = list(dict.fromkeys(point.values[keys.index(along)] for point in table))
    places, unit = _places(names)
    curves = _curves(keys, table, places)
    path = folder / PICTURE_FILE
    with new_figure((6.4, 4.4), path) as figure:
        axes = figure.add_subplot()
        draw_curves(axes, curves)
        _name_places(axes, places, unit)
        axes.set_xlabel(f"{along} [{unit}]" if unit else along)
        axes.set_ylabel("leak rate [m³/s]")
        seeds = " and ".join(key for key in keys if key in SEEDS)
        axes.set_title(_caption(curves, seeds), fontsize=FONT_POINTS - 1)
        if len(curves) > 1:
            axes.legend(fontsize=FONT_POINTS - 2, frameon=False)
    return path


def _curves(keys: tuple[str, ...], table: Sequence[Point], places: dict[str, float]) -> list[Curve]:
    """Curves of a table; InvalidInput if there are none or too many."""
    others = tuple(key for key in keys if key not in SEEDS)
    if others:
        of_values: dict[tuple[str, ...], list[tuple[float, Group]]] = {}
        for group in groups(keys, table):
            of_values.setdefault(group.values[1:], []).append((places[group.values[0]], group))
    else:
        of_values = {(): [(places[point.values[0]], Group((), (point,))) for point in table]}
    if len(of_values) > MOST_CURVES:
        raise InvalidInput(
            f"the picture would have {len(of_values)} curves, at most {MOST_CURVES} can be told "
            "apart"
        )
    curves = [
        Curve(
            ", ".join(map("{} = {}".format, others[1:], values)),
            tuple(sorted(curve, key=lambda at: at[0])),
            joined=bool(others),
        )
        for values, curve in of_values.items()
    ]
    if not any(len(curve.rows()) for curve in curves):
        raise InvalidInput("no point of the sweep leaks: there is nothing to draw")
    return curves


def draw_curves(axes: "Axes", curves: Sequence[Curve]) -> None:
    """Draw curves with their bands on a logarithmic axis, and strips for the other points."""
    rows = np.concatenate([curve.rows() for curve in curves])
    ranges = np.concatenate([curve.ranges() for curve in curves])[:, 1:]
    shown = np.concatenate([rows[:, 1:].ravel(), ranges.ravel()])
    shown = shown[(shown > 0) & np.isfinite(shown)]
    low, high = shown.min(), shown.max()
    margin = (2 * high / low) ** MARGIN
    ends = [low / margin, high * margin]
    axes.set(yscale="log", ylim=ends)
    label_axis(axes.yaxis)
    for minor in (False, True):
        ticks = axes.get_yticks(minor=minor)
        axes.set_yticks(ticks[(ticks > ends[0]) & (ticks < ends[1])], minor=minor)
    inside, strips = (ends[0], ends[1]), {}
    for end, (state, outwards) in enumerate(zip(STRIPS, (1 / margin, margin), strict=True)):
        if any(curve.counts(state) for curve in curves):
            axes.axhline(ends[end], color="0.7", linewidth=0.8)
            strips[state] = ends[end] * outwards
            words, beside = state.replace(" ", "\n"), axes.get_yaxis_transform()
            axes.text(-0.01, strips[state], words, transform=beside, ha="right", va="center")
            ends[end] *= outwards**2
    axes.set_ylim(*ends)
    for number, curve in enumerate(curves):
        _draw(axes, curve, f"C{number}", MARKERS[number])
        if (ranges := curve.ranges()).size:
            _draw_ranges(axes, ranges, f"C{number}", MARKERS[number], inside)
        for state, at in strips.items():
            _draw_counts(axes, curve.counts(state), f"C{number}", STRIPS[state], at)


def _draw(axes: "Axes", curve: Curve, colour: str, marker: str) -> None:
    place, value, lower, upper = curve.rows().T
    if curve.seeds:
        axes.plot(place, value, marker, color=colour, markersize=3, alpha=0.5)
        at = np.unique(place)
        low, high = (np.array([pick(value[place == p]) for p in at]) for pick in (np.min, np.max))
        axes.fill_between(at, low, high, color=colour, alpha=BAND, linewidth=0)
        rates = [(p, group.leak_rates) for p, group in curve.groups]
        medians = [(p, float(np.median(some))) for p, some in rates if some.size]
        shown = np.array([pair for pair in medians if 0 < pair[1] < np.inf]).reshape(-1, 2)
        axes.plot(*shown.T, color=colour, label=curve.label)
    elif curve.joined:
        bounded = lower > 0
        axes.fill_between(
            place[bounded], lower[bounded], upper[bounded], color=colour, alpha=BAND, linewidth=0
        )
        axes.plot(place, value, marker, ls="-", color=colour, markersize=4, label=curve.label)
    if not curve.seeds:
        # A logarithmic axis has no place for a lower bound of 0: its bar ends at the leak rate.
        below = np.where(lower > 0, value - lower, 0.0)
        ends = "none" if curve.joined else marker
        axes.errorbar(place, value, [below, upper - value], fmt=ends, color=colour, markersize=4.0)


def _draw_ranges(
    axes: "Axes", ranges: np.ndarray, colour: str, marker: str, ends: tuple[float, float]
) -> None:
    """Draw open markers with the ranges of points that have not settled.

    An open end reaches as far as the axis; the marker is in the middle, or at the end that is not
    open.
    """
    place, lower, upper = ranges.T
    is_low, is_high = lower > 0, np.isfinite(upper)
    low, high = np.where(is_low, lower, ends[0]), np.where(is_high, upper, ends[1])
    middle = np.where(is_low & is_high, np.sqrt(low * high), np.where(is_low, low, high))
    axes.errorbar(
        *(place, middle, [middle - low, high - middle]),
        fmt=marker,
        color=colour,
        markersize=5.0,
        markerfacecolor="white",
        elinewidth=0.8,
    )


def _draw_counts(
    axes: "Axes", counts: Sequence[tuple[float, int, int]], colour: str, mark: str, height: float
) -> None:
    """Mark the places of points in a state at a height of the axes, with their number."""
    for place, some, points in counts:
        axes.plot(place, height, mark, color=colour, markersize=5.0)
        if points > 1:
            axes.annotate(
                f"{some} of {points}",
                (place, height),
                (0, 4),
                textcoords="offset points",
                ha="center",
                fontsize=FONT_POINTS - 3,
                color=colour,
            )


def _caption(curves: Sequence[Curve], seeds: str) -> str:
    """Text on the meaning of lines and bands."""
    unsettled = any(curve.ranges().size for curve in curves)
    open_ = "open: ranges of points that have not settled" if unsettled else ""
    if any(curve.seeds for curve in curves):
        words = f"points: each {seeds}; line: their median; shaded: all that leak"
        left_out = sum(group.left_out for curve in curves for _, group in curve.groups)
        if not left_out:
            return words
        total = sum(len(curve.points) for curve in curves)
        words = words.replace("their median", f"their median, without {left_out} of {total} points")
        return f"{words}{';' if open_ else ''}\n{open_}".rstrip()
    rows = np.concatenate([curve.rows() for curve in curves])
    widths = [relative_half_width(lower, upper) for _, _, lower, upper in rows]
    if not any(widths):
        return "without bounds"
    shown = "bounds shaded" if curves[0].joined else "bars: bounds"
    words = f"{shown}, ±{per_cent(max(widths))} at most"
    return f"{words}; {open_}" if open_ else words


def _name_places(axes: "Axes", places: dict[str, float], unit: str | None) -> None:
    """Choose the scale of the field's axis, and label the places if they are far enough apart."""
    from matplotlib.ticker import NullLocator

    at = np.array(list(places.values()))
    if unit is None:
        # The end of a path distinguishes files.
        cut = 1 - LONGEST_NAME
        names = [name if len(name) <= LONGEST_NAME else f"…{name[cut:]}" for name in places]
        axes.set_xticks(at, names)
        if len(at) * max(map(len, places)) > 5 * MOST_NAMES:
            axes.tick_params(axis="x", rotation=30)
            for label in axes.get_xticklabels():
                label.set_horizontalalignment("right")
        return
    low, high = at.min(), at.max()
    logarithmic = low > 0 and high > DECADE * low
    if logarithmic:
        axes.set_xscale("log")
    shown = np.sort(np.log(at) if logarithmic else at)
    if len(at) > MOST_NAMES or np.diff(shown).min(initial=np.inf) < np.ptp(shown) / MOST_NAMES:
        if logarithmic:
            label_axis(axes.xaxis)
        return  # keep matplotlib's round numbers
    axes.set_xticks(at, [f"{place:g}" for place in at])
    axes.xaxis.set_minor_locator(NullLocator())


def _places(values: Sequence[str]) -> tuple[dict[str, float], str | None]:
    """Place of each value on the axis, and the unit of all values.

    Values that are not numbers in one unit are placed one after the other; the unit is then None.
    """
    matches = {value: _NUMBER.fullmatch(value.strip("\"' ")) for value in values}
    units = {match[2].strip() if match else None for match in matches.values()}
    if len(units) == 1 and None not in units:
        return {value: float(match[1]) for value, match in matches.items() if match}, units.pop()
    return {value: float(i) for i, value in enumerate(matches)}, None
