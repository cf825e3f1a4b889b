"""Picture of a sweep: the leak rate against what varies, its bounds as bars."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.render.page import FONT_POINTS
from fem_seal.render.plot import new_figure
from fem_seal.sweep.point import Point
from fem_seal.sweep.summary import SEEDS, Group, groups

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PICTURE_FILE = "sweep.png"
# More curves could not be told apart.
MOST_CURVES = 10
DECADE = 10.0
MOST_TICKS = 12
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")


def sweep_figure(keys: tuple[str, ...], table: Sequence[Point], folder: Path) -> Path:
    """Plot the leak rate of a sweep against the first field that is no seed.

    Bars are the bounds. Where a seed varies, each surface is a pale point, and a line joins the
    medians over the seeds. Each combination of the other fields is a curve. An axis that spans more
    than a decade is logarithmic; sealed points, which a logarithmic axis cannot show, are left out.

    Parameters
    ----------
    keys : tuple of str
        What varies.
    table : sequence of Point
    folder : pathlib.Path
        Where sweep.png goes.

    Raises
    ------
    InvalidInput
        If no point leaks, or there are too many curves.
    """
    others = tuple(key for key in keys if key not in SEEDS)
    curves: dict[tuple[str, ...], list[tuple[str, Group]]] = {}
    if others:
        for group in groups(keys, table):
            curves.setdefault(group.values[1:], []).append((group.values[0], group))
    else:
        seeds = [point for point in table if point.numbers["state"]]
        curves[()] = [(point.values[0], Group((), (point,))) for point in seeds]
    if not any(np.any(group.leak_rates > 0) for curve in curves.values() for _, group in curve):
        raise InvalidInput("no point of the sweep leaks: there is nothing to draw")
    if len(curves) > MOST_CURVES:
        raise InvalidInput(
            f"the picture would have {len(curves)} curves, at most {MOST_CURVES} can be told apart"
        )
    along = others[0] if others else keys[0]
    places, unit = _places([value for curve in curves.values() for value, _ in curve])
    path = folder / PICTURE_FILE
    with new_figure((6.4, 4.4), path) as figure:
        axes = figure.add_subplot()
        for number, (values, curve) in enumerate(curves.items()):
            label = ", ".join(map("{} = {}".format, others[1:], values))
            _draw(axes, [(places[value], group) for value, group in curve], f"C{number}", label)
        if (
            unit is not None
            and min(places.values()) > 0
            and max(places.values()) > DECADE * min(places.values())
        ):
            axes.set_xscale("log")
        if unit is None or len(places) <= MOST_TICKS:
            numbers = [f"{place:g}" for place in places.values()]
            axes.set_xticks(list(places.values()), list(places) if unit is None else numbers)
            axes.minorticks_off()
        low, high = axes.dataLim.intervaly
        if low > 0 and high > DECADE * low:
            axes.set_yscale("log")
        axes.tick_params(labelsize=FONT_POINTS - 1)
        axes.set_xlabel(f"{along} [{unit}]" if unit else along, fontsize=FONT_POINTS)
        axes.set_ylabel("leak rate [m³/s]", fontsize=FONT_POINTS)
        if axes.get_legend_handles_labels()[1] and any(others) and len(keys) > 1:
            axes.legend(fontsize=FONT_POINTS - 2, frameon=False)
    return path


def _draw(axes: "Axes", curve: list[tuple[float, Group]], colour: str, label: str) -> None:
    """Draw all points with their bounds, and a line through the medians."""
    several = any(len(group.points) > 1 for _, group in curve)
    for place, group in curve:
        for point in group.points:
            value, lower, upper = (point.numbers[key] for key in ("leak_rate", "lower", "upper"))
            if not isinstance(value, float) or value <= 0:
                continue
            bars = None
            # A lower bound of 0 has no place on a logarithmic axis.
            if isinstance(lower, float) and isinstance(upper, float) and lower > 0:
                bars = [[value - lower], [upper - value]]
            axes.errorbar(
                [place],
                [value],
                bars,
                fmt="o",
                markersize=3 if several else 4,
                capsize=0 if several else 3,
                color=colour,
                alpha=0.35 if several else 1.0,
            )
    medians = [(place, float(np.median(group.leak_rates))) for place, group in curve]
    leaking = sorted((place, median) for place, median in medians if median > 0)
    if several:
        axes.plot(
            *zip(*leaking, strict=True), "s-", color=colour, label=f"median, {label}".strip(", ")
        )
    elif len(leaking) > 1:
        axes.plot(*zip(*leaking, strict=True), "-", color=colour, linewidth=1, label=label or "_")


def _places(values: Sequence[str]) -> tuple[dict[str, float], str | None]:
    """Where each value stands on the axis, and the unit that all share.

    Values that are no numbers of one unit stand one after the other; the unit is then None.
    """
    found = {value: _NUMBER.fullmatch(value.strip("\"' ")) for value in values}
    units = {match[2].strip() if match else None for match in found.values()}
    if len(units) == 1 and None not in units:
        return {value: float(match[1]) for value, match in found.items() if match}, units.pop()
    return {value: float(i) for i, value in enumerate(found)}, None
