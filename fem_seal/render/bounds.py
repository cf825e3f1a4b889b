"""Plot of the bounds of the leak rate, and of their relative half-width, against unknowns."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.leak_rate import Level
from fem_seal.render.plot import label_axis, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

UPPER, LOWER, HALF_WIDTH = "#b2452b", "#2654a4", "#333333"


def close_in(levels: Sequence[Level]) -> bool:
    """Whether there are two levels or more to show how the bounds closed."""
    return sum(level.upper > 0 for level in levels) > 1


def bounds_plot(levels: Sequence[Level], path: str | Path) -> Path:
    """Plot the bounds, and the half-width of the bracket, against unknowns on logarithmic axes.

    A logarithmic axis has no place for a lower bound of zero: for such a level the plot shows the
    upper bound and a relative half-width of 1. The thin line is proportional to 1/unknowns, the
    optimal rate of adaptive linear elements for an energy. `path` ends in .png, .pdf or .svg.
    """
    levels = [level for level in levels if level.upper > 0]
    if not levels:
        raise InvalidInput(
            "there are no bounds to plot: the leak rate holds no level with flow; "
            "only methods with bounds keep their levels"
        )
    with new_figure((7.5, 3.4), path) as figure:
        draw_bounds(figure, levels)
    return Path(path)


def draw_bounds(figure: "Figure", levels: Sequence[Level]) -> None:
    """Draw the two axes of `bounds_plot` into a figure without axes."""
    rates, widths = figure.subplots(1, 2)
    _limits(rates, widths, levels)
    unknowns = np.array([level.unknowns for level in levels], dtype=float)
    upper = np.array([level.upper for level in levels])
    lower = np.array([level.lower for level in levels])
    bounded = lower > 0
    rates.fill_between(unknowns[bounded], lower[bounded], upper[bounded], color="0.88", linewidth=0)
    rates.plot(unknowns, upper, "v-", color=UPPER, markersize=4, label="upper bound")
    rates.plot(
        unknowns[bounded], lower[bounded], "^-", color=LOWER, markersize=4, label="lower bound"
    )
    rates.set(xlabel="unknowns", ylabel="leak rate Q [m³/s]")
    rates.legend(frameon=False, loc="upper right")
    half_width = np.array([level.half_width for level in levels])
    positive = half_width > 0
    widths.plot(unknowns[positive], half_width[positive], "o-", color=HALF_WIDTH, markersize=4)
    _optimal_rate(widths, levels)
    widths.set(xlabel="unknowns", ylabel="half-width of the bracket / mean")


def _limits(rates: "Axes", widths: "Axes", levels: Sequence[Level]) -> None:
    """Make the axes logarithmic, with limits beside all levels."""
    unknowns = np.array([level.unknowns for level in levels], dtype=float)
    values = np.array([[level.lower, level.upper] for level in levels])
    half_width = np.array([level.half_width for level in levels])
    shown = ((rates, values[values > 0]), (widths, half_width[half_width > 0]))
    for axes, numbers in shown:
        axes.set(xscale="log", xlim=(unknowns.min() / 1.3, unknowns.max() * 1.3))
        label_axis(axes.xaxis)
        if numbers.size == 0:  # all half-widths are 0: the bounds are equal
            continue
        axes.set(yscale="log", ylim=(numbers.min() / 1.6, numbers.max() * 1.6))
        label_axis(axes.yaxis)


def _optimal_rate(axes: "Axes", levels: Sequence[Level]) -> None:
    """Draw the line ∝ 1/unknowns through the last level; none for a single level."""
    last = levels[-1]
    if last.half_width == 0 or len(levels) == 1:
        return
    unknowns = np.array([levels[0].unknowns, last.unknowns], dtype=float)
    line = last.half_width * last.unknowns / unknowns
    axes.plot(unknowns, line, "--", color="0.5", linewidth=1, zorder=1, label="∝ 1 / unknowns")
    axes.legend(frameon=False, loc="lower left")
