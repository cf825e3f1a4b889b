"""Fig. 3 of the letter: leak rates against contact area, and their errors."""

from collections.abc import Iterable, Sequence
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from demos.letter.currents import FLOW_AREA, Current
from demos.letter.fig3_theory import draw_media, draw_theory
from demos.letter.persson import Prediction
from demos.letter.style import COLOURS, LETTERS_DECADES, MARKERS, paths
from fem_seal.render.plot import new_figure


def current_figure(
    currents: Sequence[Current], persson: Sequence[Prediction], folder: Path
) -> None:
    """Fig. 3: leak rate over that at first contact, against contact area; and its errors."""
    leaking = [point for point in currents if point.value > 0]
    with new_figure((10, 7.4), *paths(folder, "fig3")) as figure:
        places = [["counted", "corrected"], ["errors", "key"]]
        axes = figure.subplot_mosaic(places, gridspec_kw={"height_ratios": (3, 1.4)})
        counted, corrected, errors = (axes[name] for name in ("counted", "corrected", "errors"))
        _draw_series(counted, corrected, errors, leaking)
        draw_media(counted, currents)
        _draw_decades(counted, leaking)
        draw_theory(corrected, persson)
        lowest = min(point.lower for point in leaking) / 30
        for panel in (counted, corrected):
            unit = {"color": "k", "markersize": 9, "label": "first contact, the unit"}
            panel.plot([0], [1], "*", clip_on=False, zorder=5, **unit)
            panel.set(yscale="log", xlim=(0, 0.55), ylim=(lowest, 2))
        area = "contact area A/A0, counted in samples"
        ratio = "leak rate / leak rate at first contact"
        title = "Elastic contacts leak less than cuts of the same area"
        counted.set(xlabel=area, ylabel=ratio, title=title)
        title = "Persson's theory belongs on the corrected area"
        corrected.set(xlabel="contact area A/A0, corrected for the perimeter", title=title)
        title = "How well the elastic leak rates are known"
        errors.set(yscale="log", xlim=(0, 0.55), xlabel=area, ylabel="relative error", title=title)
        _draw_key(axes["key"], (counted, corrected, errors))


def _draw_series(counted: Axes, corrected: Axes, errors: Axes, leaking: Sequence[Current]) -> None:
    """Draw the leak rates of each model and seed, and the errors of the elastic ones."""
    markers = dict(zip(sorted({point.seed for point in leaking}), MARKERS * 9, strict=False))
    for model, seed in product(COLOURS, markers):
        points = [p for p in leaking if (p.model, p.seed) == (model, seed)]
        style = {"color": COLOURS[model], "marker": markers[seed]}
        style |= {"linestyle": "none", "label": f"{model}, seed {seed}, certified"}
        _draw_currents(counted, [point.area for point in points], points, style)
        _draw_differences(counted, points, style["color"])
        if model == "elastic":
            _draw_currents(corrected, [point.corrected for point in points], points, style)
            _draw_errors(errors, points, style)


def _draw_key(axes: Axes, panels: Iterable[Axes]) -> None:
    """Draw the labels of all panels, each once, whatever the number of its artists."""
    axes.axis("off")
    named = {}
    for panel in panels:
        handles, labels = panel.get_legend_handles_labels()
        named |= dict(zip(labels, handles, strict=True))
    bars = "bars: bracket of the flow, widened by the contact grid's error where it is known"
    style = {"fontsize": 7, "title": bars, "title_fontsize": 7}
    axes.legend(named.values(), named, ncols=2, frameon=False, loc="center", **style)


def _draw_currents(axes: Axes, areas: list[float], points: Sequence[Current], style: dict) -> None:
    """Draw certified leak rates; bars are the brackets, widened by the contact grid's error."""
    values = np.array([point.value for point in points])
    grid = np.exp([point.grid_change or 0.0 for point in points])
    lower, upper = (np.array([getattr(p, end) for p in points]) for end in ("lower", "upper"))
    bars = [values - lower / grid, upper * grid - values]
    axes.errorbar(areas, values, bars, markersize=5, mfc="white", capsize=2.5, **style)


def _draw_differences(axes: Axes, points: Sequence[Current], colour: str) -> None:
    """Draw finite differences beside the brackets: a cross, and the band of the link rules."""
    # Left out, or zero, for which the logarithmic axis has no place.
    points = [point for point in points if point.harmonic]
    if not points:
        return
    low, middle, high = (
        np.array([getattr(point, rule) for point in points])
        for rule in ("harmonic", "linear_gap", "arithmetic")
    )
    axes.errorbar(
        [point.area + 0.004 for point in points],
        middle,
        [middle - low, high - middle],
        fmt="x",
        color=colour,
        alpha=0.55,
        markersize=4,
        elinewidth=0.8,
        label="finite differences, band of link rules",
    )


def _draw_decades(axes: Axes, leaking: Sequence[Current]) -> None:
    """Draw an arrow from the bearing contacts at A/A0 = 0.2 down by the letter's three decades."""
    start = [p.value for p in leaking if p.model == "bearing" and p.wanted == FLOW_AREA]
    if start:
        top = float(np.exp(np.mean(np.log(start))))
        end = top * 10.0**-LETTERS_DECADES
        arrow = {"arrowstyle": "->", "color": "0.45"}
        axes.annotate("", (FLOW_AREA, end), (FLOW_AREA, top), arrowprops=arrow)
        words = {"ha": "right", "va": "bottom", "fontsize": 7.5, "color": "0.35"}
        axes.text(FLOW_AREA - 0.005, end, "the letter:\nthree decades", **words)


def _draw_errors(axes: Axes, elastic: Sequence[Current], style: dict) -> None:
    """Draw the errors of elastic points: half-width of the bracket, change of the grid."""
    areas, widths = ([getattr(p, name) for p in elastic] for name in ("area", "half_width"))
    axes.plot(areas, widths, mfc="white", markersize=5, **style)
    finer = [point for point in elastic if point.grid_change]
    if finer:
        areas, changes = ([getattr(p, name) for p in finer] for name in ("area", "grid_change"))
        style = {**style, "color": "k", "label": "error of the contact's grid"}
        axes.plot(areas, changes, markersize=5, **style)
