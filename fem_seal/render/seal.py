"""Picture of a seal: pressures and conductivity along the path, and K of every patch."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import per_cent
from fem_seal.render.plot import FONT_POINTS, legend_below, new_figure
from fem_seal.results.records import SealRecord
from fem_seal.results.words import lifted_words
from fem_seal.upscaling.conductivity import ConductivityTable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def seal_picture(seal: SealRecord, path: str | Path) -> None:
    """Draw P(x), p(x) and K(x) of the patch of median leak rate, and K against the net load.

    The part of the path that decides the leak rate is shaded: the part with 90 % of the influence
    of ln K on ln Q, or all that is known to be sealed, in which p is not known. It lies before the
    steepest fall of the fluid's pressure: K at a place influences p, and so the net load P - p, of
    all places behind it.

    A sealed seal has no K along its path; in place of it stands how far each patch is from
    leaking. Of a seal that is lifted off only the two pressures are drawn.
    """
    with new_figure((11, 7.5), path) as figure:
        draw_seal(figure, seal)


def draw_seal(figure: "Figure", seal: SealRecord) -> None:
    """Draw the axes of `seal_picture`."""
    if seal.leak_rate is None:
        figure.set_size_inches(7, 5)
        pressures = figure.add_subplot()
        _draw_path(seal, pressures)
        title = lifted_words(seal).replace(", is", ",\nis")
        pressures.set_title(title, fontsize=FONT_POINTS)
        pressures.set(xlabel="x [mm]")
        legend_below(pressures, "center")
    elif seal.median.state == "sealed":
        figure.set_size_inches(11, 4.5)
        pressures, margins = figure.subplots(1, 2)
        _draw_path(seal, pressures)
        pressures.set(xlabel="x [mm]")
        _draw_margins(seal, margins)
        legend_below(pressures, "left")
    else:
        grid = figure.add_gridspec(2, 2, width_ratios=(1.2, 1))
        pressures = figure.add_subplot(grid[0, 0])
        conductivity = figure.add_subplot(grid[1, 0], sharex=pressures)
        _draw_path(seal, pressures)
        _draw_path(seal, conductivity, of_fluid=False)
        pressures.tick_params(labelbottom=False)
        _draw_loads(seal, figure.add_subplot(grid[:, 1]))
        legend_below(pressures, "left")


def _draw_path(seal: SealRecord, axes: "Axes", *, of_fluid: bool = True) -> None:
    """Draw both pressures along the path, or its conductivity; shade the part that decides."""
    sealed, path = seal.median.state == "sealed", seal.path
    x, p = 1e3 * np.array(path.x), 1e-6 * np.array(path.fluid_pressure)
    if seal.sealing is not None:
        start, end = 1e3 * seal.sealing.start, 1e3 * seal.sealing.end
        # With an edge, since a seal may be known to be sealed at one place only.
        axes.axvspan(
            start,
            end,
            facecolor="tab:green",
            edgecolor="tab:green",
            alpha=0.4 if sealed else 0.12,
            label="sealed: K = 0; p is not known" if sealed else "decides the leak rate (90 %)",
        )
        if sealed:
            p[(start < x) & (x < end)] = np.nan
    if not of_fluid:
        axes.set(xlabel="x [mm]", ylabel="K at P - p [m³/(Pa s)]", yscale="log")
        axes.plot(*_at_steps(x, path.conductivity), "tab:red")
        return
    axes.set(ylabel="pressure [MPa]", title="along the leak path, from inlet to outlet")
    axes.plot(x, 1e-6 * np.array(path.total_pressure), "k", label="total pressure P")
    axes.plot(x, p, "tab:blue", label="fluid pressure p, above ambient")


def _at_steps(x: np.ndarray, conductivity: Sequence[float | None]) -> tuple[np.ndarray, np.ndarray]:
    """Middles of the places of one conductivity, and both ends of the path, with their K.

    K falls with the net load in steps, and is estimated at the middle of each
    (`ConductivityTable.interpolated`).
    """
    K = np.array([value or np.nan for value in conductivity])
    steps = np.split(np.arange(len(x)), 1 + np.flatnonzero(np.diff(K)))
    middles = [x[step].mean() for step in steps]
    return np.array([x[0], *middles, x[-1]]), K[[0, *(step[0] for step in steps), -1]]


def _draw_margins(seal: SealRecord, axes: "Axes") -> None:
    """Draw the net loads at which each patch leaks and is sealed, and that of the tightest place.

    The place of the highest total pressure has this net load when fluid of the inlet's pressure
    reaches it: by how much it exceeds the load from which on the patches are sealed is to spare.
    """
    tables = [patch.conductivity for patch in seal.patches if patch.conductivity is not None]
    sealed_from = [1e-6 * table.loads[table.upper == 0].min(initial=np.inf) for table in tables]
    leaks_to = np.array([table.loads[table.upper > 0].max(initial=0.0) for table in tables]) / 1e6
    numbers = np.arange(1, len(tables) + 1)
    has = 1e-6 * (max(seal.path.total_pressure) - seal.path.fluid_pressure[0])
    spare = has - np.median(sealed_from)
    words = f"half of them have at least {1e3 * spare:.3g} kPa to spare, {per_cent(spare / has)}"
    axes.set_title(words if spare > 0 else "sealed at this net load; less was not solved")
    axes.set(xlabel="net load P - p [MPa]", ylabel="patch", xlim=(0, 1.25 * has))
    axes.set_ylim(0, len(tables) + 1)
    axes.locator_params(axis="y", integer=True)
    starts = np.minimum(sealed_from, 1.25 * has)
    for low, high, colour, label in (
        (starts, 1.25 * has, "tab:green", "sealed: K = 0"),
        (0, leaks_to, "tab:red", "leaks"),
    ):
        if np.any(high > low):
            axes.hlines(numbers, low, high, colour, lw=5, alpha=0.4, label=label)
    axes.axvline(has, color="k", lw=1, label="highest net load along the path")
    legend_below(axes, "right")


def _draw_loads(seal: SealRecord, axes: "Axes") -> None:
    """Draw K of every patch against the net load, all but the median patch in grey.

    A dotted line goes from the last load at which a patch leaks to the first at which it is sealed.
    """
    axes.set(xlabel="net load P - p [MPa]", title="every patch")
    axes.set(ylabel="K [m³/(Pa s)]", yscale="log")
    axes.locator_params(axis="x", nbins=6)
    median, ends = seal.median, []
    for one in seal.patches:
        if one.conductivity is None:
            continue
        table, is_median = one.conductivity, one is median
        colour, layer = ("tab:red", 3) if is_median else ("0.6", 2)
        open_ = table.upper > 0
        w, K = 1e-6 * table.loads, table.value
        label = "patch of median leak rate, at the left" if is_median else "other patches"
        axes.plot(w[open_], K[open_], ".-", color=colour, lw=0.8, zorder=layer, label=label)
        if is_median and open_.any():
            _draw_bounds(table, axes)
        if not open_.all():
            ends.append((w[np.argmin(open_)], w[open_], K[open_], colour, layer))
    lowest, _ = axes.get_ylim()
    axes.set_ylim(bottom=lowest)
    for sealed, w, K, colour, layer in ends:
        to = [*w[-1:], sealed], [*K[-1:], lowest]
        axes.plot(*to, ":", color=colour, lw=1, zorder=layer)
        axes.plot(
            sealed, lowest, "x", color=colour, clip_on=False, zorder=layer + 3,
            label="sealed at this net load and above",
        )  # fmt: skip
    legend_below(axes, "right")


def _draw_bounds(table: ConductivityTable, axes: "Axes") -> None:
    """Shade the bounds of K at and between the loads of a table."""
    w = np.repeat(1e-6 * table.lowest.loads, 2)[1:-1]
    lower, upper = (
        np.repeat(steps.conductivity[1:-1], 2) for steps in (table.lowest, table.highest)
    )
    # A logarithmic axis has no place for a lower bound of 0.
    least = 0.1 * table.value[table.value > 0].min()
    lower[upper == 0] = upper[upper == 0] = np.nan
    lower = np.maximum(lower, least)
    axes.fill_between(w, lower, upper, facecolor="tab:red", alpha=0.2, lw=0, label="its bounds")
