"""Picture of a sweep: the leak rate against the field that varies, with its range as a bar."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import geometric_mean
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.errors import InvalidInput
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
LONGEST_NAME = 24  # most characters of a name under the axis
MARGIN = 4.0  # factor from the lowest and the highest leak rate to the edges of the picture
# States of points without a leak rate, their marks, and the edge of the picture that shows them.
EDGES = {"sealed": ("x", 0.0), "lifted off": ("^", 1.0)}
# Points of a curve by their place on the axis, ascending; those of one place differ in their seed.
Curve = dict[float, Group]


class NotDrawn(InvalidInput):
    """These points make no picture."""


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
    Sealed points stand on the lower edge, points lifted off on the upper one.
    """
    along = next((key for key in keys if key not in SEEDS), keys[0])
    table = [_in_unit(point, shown.per_solved) for point in table]
    names = list(dict.fromkeys(point.values[keys.index(along)] for point in table))
    places, unit = _places_on_axis(names)
    joined = along not in SEEDS
    curves = _curves(keys, along, table, places)
    path = folder / PICTURE_FILE
    with new_figure((6.4, 4.4), path) as figure:
        axes = figure.add_subplot()
        axes.margins(x=0.1)  # room for the counts of sealed points
        _set_leak_rate_axis(axes, table)
        for number, (label, curve) in enumerate(curves.items()):
            if joined:
                axes.plot(*_median_line(curve).T, color=f"C{number}", label=label)
            _draw_curve(axes, curve, f"C{number}", MARKERS[number])
        _scale_places(axes, places, unit)
        axes.set_xlabel(f"{along} [{unit}]" if unit else along)
        axes.set_ylabel(f"leak rate [{shown.unit.replace('^3', '³')}]")
        words = "bars: all counted errors; open: not settled"
        if joined and not SEEDS.isdisjoint(keys):
            words = f"line: median of the seeds that have settled; {words}"
        axes.set_title(words, fontsize=FONT_POINTS - 1, pad=18)
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
) -> dict[str, Curve]:
    """Curves of a table by the values of their other fields; NotDrawn if none or too many."""
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
    if not any(map(_bar, table)):
        raise NotDrawn("no point of the sweep has a leak rate above 0: there is nothing to draw")
    return {
        label: {at: Group((), tuple(of_place[at])) for at in sorted(of_place)}
        for label, of_place in of_label.items()
    }


def _set_leak_rate_axis(axes: "Axes", points: Iterable[Point]) -> None:
    """Logarithmic axis around all bars, and the names of the states that stand on its edges."""
    ends = [end for bar in filter(None, map(_bar, points)) for end in bar if 0 < end < np.inf]
    axes.set(yscale="log", ylim=(min(ends) / MARGIN, max(ends) * MARGIN))
    label_axis(axes.yaxis)
    for state, (_, edge) in EDGES.items():
        if any(point.state == state for point in points):
            axes.text(1.01, edge, state, transform=axes.transAxes, va="center")


def _draw_curve(axes: "Axes", curve: Curve, colour: str, marker: str) -> None:
    """Draw the points of a curve with their bars, and those without a leak rate on the edges."""
    for place, group in curve.items():
        for point in group.points:
            if bar := _bar(point):
                value, *ends = bar
                face = "white" if point.state == UNSETTLED else None
                # An open end reaches as far as the axis.
                span = np.clip(ends, *axes.get_ylim())
                axes.vlines(place, *span, color=colour, linewidth=2.0, alpha=0.3)
                axes.plot(place, value, marker, color=colour, markersize=4.0, mfc=face)
        for state, (mark, edge) in EDGES.items():
            if count := group.count(state):
                on_edge = axes.get_xaxis_transform()
                axes.plot(place, edge, mark, color=colour, transform=on_edge, clip_on=False)
                if len(group.points) > 1:
                    of_all = f"  {count} of {len(group.points)}"
                    text = axes.text(place, edge, of_all, color=colour, transform=on_edge)
                    text.set(va="bottom", fontsize=FONT_POINTS - 3)


def _median_line(curve: Curve) -> np.ndarray:
    """(n, 2): places and medians over the seeds, where these are leak rates that can be drawn."""
    rates = [(place, group.leak_rates) for place, group in curve.items()]
    medians = [(place, np.median(of_seeds)) for place, of_seeds in rates if of_seeds.size]
    return np.array([pair for pair in medians if 0 < pair[1] < np.inf]).reshape(-1, 2)


def _scale_places(axes: "Axes", places: dict[str, float], unit: str | None) -> None:
    """Name places that have no unit; else the field's axis is logarithmic beyond a decade."""
    at = list(places.values())
    if unit is None:
        # The end of a path distinguishes files.
        axes.set_xticks(at, [name[-LONGEST_NAME:] for name in places], rotation=30, ha="right")
    elif 0 < DECADE * min(at) < max(at):
        axes.set_xscale("log")
        label_axis(axes.xaxis)


def _places_on_axis(values: Sequence[str]) -> tuple[dict[str, float], str | None]:
    """Place of each value on the axis, and the unit of all values.

    Values that are not numbers in one unit are placed one after the other; the unit is then None.
    """
    matches = {value: NUMBER_AND_UNIT.fullmatch(value.strip("\"' ")) for value in values}
    units = {match[2] if match else None for match in matches.values()}
    if len(units) == 1 and None not in units:
        return {value: float(match[1]) for value, match in matches.items() if match}, units.pop()
    return {value: float(i) for i, value in enumerate(matches)}, None
