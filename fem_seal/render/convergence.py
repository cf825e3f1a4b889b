"""Plot of the bounds of the leak rate, and of their relative half-width, against unknowns."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.leak_rate import LevelRecord
from fem_seal.render.plot import label_axis, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UPPER, LOWER, HALF_WIDTH = "#b2452b", "#2654a4", "#333333"


def close_in(levels: Sequence[LevelRecord]) -> bool:
    """Whether there are two levels or more to show how the bounds closed."""
    return sum(level.upper > 0 for level in levels) > 1


def bounds_plot(levels: Sequence[LevelRecord], path: str | Path) -> None:
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


def draw_bounds(figure: "Figure", levels: Sequence[LevelRecord]) -> None:
    """Draw the two axes of `bounds_plot` into a figure without axes."""
    rates, widths = figure.subplots(1, 2)
    unknowns, lower, upper, half_width = np.array(
        [(level.unknowns, level.lower, level.upper, level.half_width) for level in levels], float
    ).T
    bounded, open_ = lower > 0, half_width > 0
    rates.fill_between(unknowns[bounded], lower[bounded], upper[bounded], color="0.88", linewidth=0)
    for values, marker, colour, name in (
        (upper, "v-", UPPER, "upper bound"),
        (np.where(bounded, lower, np.nan), "^-", LOWER, "lower bound"),
    ):
        rates.plot(unknowns, values, marker, color=colour, markersize=4, label=name)
    rates.set(xlabel="unknowns", ylabel="leak rate Q [m³/s]")
    widths.plot(unknowns[open_], half_width[open_], "o-", color=HALF_WIDTH, markersize=4)
    if half_width[-1] > 0 and len(levels) > 1:
        # From the first level to the last, through the last.
        law = half_width[-1] * unknowns[-1] / unknowns[[0, -1]]
        style = {"color": "0.5", "linewidth": 1, "zorder": 1, "label": "∝ 1 / unknowns"}
        widths.plot(unknowns[[0, -1]], law, "--", **style)
        widths.legend(frameon=False, loc="lower left")
    widths.set(xlabel="unknowns", ylabel="half-width of the bracket / mean")
    rates.legend(frameon=False, loc="upper right")
    for axes in (rates, widths):
        axes.set(xscale="log", yscale="log" if axes is rates or open_.any() else "linear")
        axes.margins(0.1)
        label_axis(axes.xaxis)
        if axes.get_yscale() == "log":
            label_axis(axes.yaxis)
