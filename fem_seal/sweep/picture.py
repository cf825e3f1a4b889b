"""Picture of a sweep: the leak rate against the field that varies, with its range as a bar."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import geometric_mean
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import per_cent
from fem_seal.errors import InvalidInput
from fem_seal.leak_rate import relative_half_width
from fem_seal.quantities.headline import SI, ShownUnit
from fem_seal.render.plot import FONT_POINTS, label_axis, new_figure
from fem_seal.scene.scene import SEEDS
from fem_seal.sweep.point import UNSETTLED, Point
from fem_seal.sweep.summary import Group
from fem_seal.units import NUMBER_AND_UNIT

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


class NotDrawn(InvalidInput):
    """These points make no picture."""


@dataclass(frozen=True)
class Curve:
    """Leak rates against one field, the other fields fixed."""

    label: str  #: the other fields with their values; empty if there are none
    #: place on the axis, ascending, and the points at that place; they differ in their seed only
    groups: tuple[tuple[float, Group], ...]

    @property
    def points(self) -> list[tuple[float, Point]]:
        """All points with their places."""
        return [(place, point) for place, group in self.groups for point in group.points]


def _bar(point: Point) -> tuple[float, float, float] | None:
    """Leak rate of a point, and the ends of its bar; None if it has none to draw.

    The ends are those with all counted errors, 0 and infinite if open; without bounds of the flow
    both are the leak rate. A point that has not settled stands in the middle of them, or at the end
    that is not open.
    """
    upper = point.together_upper
    ends = point.together_lower or 0.0, np.inf if upper is None else upper
    if point.state == UNSETTLED:
        known = [end for end in ends if 0 < end < np.inf]
        return (geometric_mean(known), *ends) if known else None
    value = point.leak_rate
    if value is None or not 0 < value < np.inf:
        return None
    return (value, value, value) if point.lower is None else (value, *ends)


def sweep_figure(
    keys: tuple[str, ...], table: Sequence[Point], folder: Path, shown: ShownUnit = SI
) -> Path:
    """Plot the leak rate of a sweep, in a unit, against the first field that is no seed.

    The axis of the leak rate is logarithmic; that of the field is if it spans more than a decade.
    Each combination of the other fields is a curve through the medians over the seeds. Each point
    has a bar over its range with all counted errors, and an open marker if it has not settled.
    Sealed points stand in a strip below the axis, points lifted off above it.
    """
    along = next((key for key in keys if key not in SEEDS), keys[0])
    table = [_in_unit(point, shown.per_solved) for point in table]
    names = list(dict.fromkeys(point.values[keys.index(along)] for point in table))
    places, unit = _places(names)
    curves = _curves(keys, along, table, places)
    path = folder / PICTURE_FILE
    with new_figure((6.4, 4.4), path) as figure:
        axes = figure.add_subplot()
        draw_curves(axes, curves, joined=along not in SEEDS)
        _name_places(axes, places, unit)
        axes.set_xlabel(f"{along} [{unit}]" if unit else along)
        axes.set_ylabel(f"leak rate [{shown.unit.replace('^3', '³')}]")
        axes.set_title(_caption(curves), fontsize=FONT_POINTS - 1)
        if len(curves) > 1:
            axes.legend(fontsize=FONT_POINTS - 2, frameon=False)
    return path


def _in_unit(point: Point, per_solved: float) -> Point:
    """The point with its leak rates in another unit, of which 1 m³/s is so many."""
    names = "leak_rate", "lower", "upper", "together_lower", "together_upper"
    rates = {name: getattr(point, name) for name in names}
    return replace(point, **{name: rate and rate * per_solved for name, rate in rates.items()})


def _curves(
    keys: tuple[str, ...], along: str, table: Sequence[Point], places: dict[str, float]
) -> list[Curve]:
    """Curves of a table; NotDrawn if there are none or too many."""
    of_label: dict[str, dict[float, list[Point]]] = {}
    for point in table:
        values = dict(zip(keys, point.values, strict=True))
        place = places[values.pop(along)]
        label = ", ".join(f"{key} = {values[key]}" for key in values if key not in SEEDS)
        of_label.setdefault(label, {}).setdefault(place, []).append(point)
    if len(of_label) > MOST_CURVES:
        raise NotDrawn(
            f"the picture would have {len(of_label)} curves, at most {MOST_CURVES} can be told "
            "apart"
        )
    curves = [
        Curve(label, tuple((at, Group((), tuple(of_place[at]))) for at in sorted(of_place)))
        for label, of_place in of_label.items()
    ]
    settled = (point for point in table if point.state != UNSETTLED)
    if not any(map(_bar, settled)):
        raise NotDrawn("no point of the sweep has a leak rate above 0: there is nothing to draw")
    return curves


def draw_curves(axes: "Axes", curves: Sequence[Curve], *, joined: bool) -> None:
    """Draw curves on a logarithmic axis, and strips for the other points.

    A line joins the places unless these are seeds.
    """
    bars = [bar for curve in curves for _, point in curve.points if (bar := _bar(point))]
    shown = [number for bar in bars for number in bar if 0 < number < np.inf]
    low, high = min(shown), max(shown)
    margin = (2 * high / low) ** MARGIN
    ends = [low / margin, high * margin]
    axes.set(yscale="log", ylim=ends)
    label_axis(axes.yaxis)
    for minor in (False, True):
        ticks = axes.get_yticks(minor=minor)
        axes.set_yticks(ticks[(ticks > ends[0]) & (ticks < ends[1])], minor=minor)
    for number, curve in enumerate(curves):
        medians = [
            (p, float(np.median(g.leak_rates))) for p, g in curve.groups if g.leak_rates.size
        ]
        line = np.array([pair for pair in medians if 0 < pair[1] < np.inf]).reshape(-1, 2)
        if joined:
            axes.plot(*line.T, color=f"C{number}", label=curve.label)
        for place, point in curve.points:
            if bar := _bar(point):
                value, lower, upper = bar
                # An open end reaches as far as the axis.
                span = max(lower, ends[0]), min(upper, ends[1])
                face = "white" if point.state == UNSETTLED else None
                axes.vlines(place, *span, color=f"C{number}", linewidth=2.0, alpha=0.3)
                axes.plot(place, value, f"C{number}{MARKERS[number]}", ms=4.0, mfc=face)
    for end, (state, outwards) in enumerate(zip(STRIPS, (1 / margin, margin), strict=True)):
        height = ends[end] * outwards
        counts = [
            (place, group.count(state), len(group.points), f"C{number}")
            for number, curve in enumerate(curves)
            for place, group in curve.groups
            if group.count(state)
        ]
        for place, some, points, colour in counts:
            axes.plot(place, height, STRIPS[state], color=colour, markersize=5.0)
            if points > 1:
                # The empty line below the text is as high as the mark.
                text = f"{some} of {points}\n"
                small = axes.text(place, height, text, color=colour, ha="center", va="center")
                small.set(size=FONT_POINTS - 3, linespacing=1.8)
        if counts:
            axes.axhline(ends[end], color="0.7", linewidth=0.8)
            words, left = state.replace(" ", "\n"), axes.get_yaxis_transform()
            axes.text(-0.01, height, words, transform=left, ha="right", va="center")
            ends[end] *= outwards**2
    axes.set_ylim(*ends)


def _caption(curves: Sequence[Curve]) -> str:
    """Text on the meaning of lines, bars and markers."""
    points = [point for curve in curves for _, point in curve.points]
    settled = [p for p in points if p.state != UNSETTLED]
    flows = [(p.lower, p.upper) for p in settled if _bar(p)]
    widest = max(relative_half_width(low or 0.0, high or 0.0) for low, high in flows)
    bars = f"bars: all counted errors (flow alone ±{per_cent(widest)} at most)"
    words = [bars if widest else "without bounds"]
    groups = [group for curve in curves for _, group in curve.groups]
    if any(len(group.points) > 1 for group in groups):
        left_out = sum(group.left_out for group in groups)
        without = f", without {left_out} of {len(points)} points" if left_out else ""
        words.insert(0, f"line: median of the seeds{without}")
    if len(settled) < len(points):
        words.append("open: ranges of points that have not settled")
    return "\n".join(words)


def _name_places(axes: "Axes", places: dict[str, float], unit: str | None) -> None:
    """Choose the scale of the field's axis, and label the places if they are far enough apart."""
    from matplotlib.ticker import NullLocator

    at = np.array(list(places.values()))
    if unit is None:
        # The end of a path distinguishes files.
        axes.set_xticks(at, [name[-LONGEST_NAME:] for name in places], rotation=30, ha="right")
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
    matches = {value: NUMBER_AND_UNIT.fullmatch(value.strip("\"' ")) for value in values}
    units = {match[2] if match else None for match in matches.values()}
    if len(units) == 1 and None not in units:
        return {value: float(match[1]) for value, match in matches.items() if match}, units.pop()
    return {value: float(i) for i, value in enumerate(matches)}, None
