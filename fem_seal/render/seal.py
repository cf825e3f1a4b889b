"""Picture of a seal: pressures and conductivity along the path, and K of every patch."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.results.seal import SealRecord, lifted_words
from fem_seal.upscaling.conductivity import ConductivityTable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def seal_picture(seal: SealRecord, path: str | Path) -> Path:
    """Draw P(x), p(x) and K(x) of the patch of median leak rate, and K against the net load.

    The part of the path that decides the leak rate is shaded: the part with 90 % of the influence
    of ln K on ln Q, or all that is known to be sealed. It lies before the steepest fall of the
    fluid's pressure: K at a place influences p, and so the net load P - p, of all places behind it.

    Parameters
    ----------
    seal : SealRecord
        Seal of a result.json.
    path : str or Path
        PNG file to write.

    Returns
    -------
    Path
    """
    figure = seal_figure(seal)
    path = Path(path)
    figure.savefig(path, dpi=120)
    return path


def seal_figure(seal: SealRecord) -> "Figure":
    """Draw the figure of `seal_picture`; for a seal that is lifted off only the two pressures."""
    from matplotlib.figure import Figure

    if seal.leak_rate is None:
        figure = Figure(figsize=(7, 5), layout="constrained")
        _draw_lifted(seal, figure.add_subplot())
        return figure
    figure = Figure(figsize=(11, 7.5), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.2, 1))
    pressures = figure.add_subplot(grid[0, 0])
    conductivity = figure.add_subplot(grid[1, 0], sharex=pressures)
    _draw_path(seal, pressures, conductivity)
    _draw_loads(seal, figure.add_subplot(grid[:, 1]))
    return figure


def _draw_lifted(seal: SealRecord, axes: "Axes") -> None:
    """Draw the contact pressure, and the fluid pressure that is nowhere below it."""
    axes.set(xlabel="x [mm]", ylabel="pressure [MPa]")
    axes.set_title(lifted_words(seal).replace(", is", ",\nis"), fontsize=11)
    if seal.path is None:
        _write_into(axes, "this result has no pressures: run it again")
        return
    x = 1e3 * np.array(seal.path.x)
    axes.plot(x, 1e-6 * np.array(seal.path.contact_pressure), "k", label="contact pressure P")
    inlet = 1e-6 * np.array(seal.path.fluid_pressure)
    axes.plot(x, inlet, "tab:blue", label="fluid pressure at the inlet, above ambient")
    axes.set_ylim(bottom=0)
    _legend_below(axes)


def _legend_below(axes: "Axes", room: float = 0.12) -> None:
    """Put the legend below the axes; there it hides no data."""
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    axes.legend(
        list(once.values()),
        list(once),
        fontsize=9,
        loc="upper center",
        bbox_to_anchor=(0.5, -room),
        frameon=False,
        ncols=2,
    )


def _draw_path(seal: SealRecord, pressures: "Axes", conductivity: "Axes") -> None:
    title = "along the leak path, from inlet to outlet"
    pressures.set(ylabel="pressure [MPa]", title=title)
    conductivity.set(xlabel="x [mm]", ylabel="K(P - p) [m³/(Pa s)]")
    pressures.tick_params(labelbottom=False)
    sealed = seal.leak_rate is not None and seal.leak_rate.upper == 0
    if seal.sealing is not None:
        for axes in (pressures, conductivity):
            # At least as wide as a line: a seal may be known to be sealed at one place only.
            axes.axvspan(
                1e3 * seal.sealing.start,
                1e3 * seal.sealing.end,
                facecolor="tab:green",
                edgecolor="tab:green",
                alpha=0.4 if sealed else 0.12,
                label="sealed: K = 0" if sealed else "decides the leak rate (90 %)",
            )
    if seal.path is not None:
        x, P, p = (
            np.array(values)
            for values in (seal.path.x, seal.path.contact_pressure, seal.path.fluid_pressure)
        )
        pressures.plot(1e3 * x, 1e-6 * P, "k", label="contact pressure P")
        pressures.plot(1e3 * x, 1e-6 * p, "tab:blue", label="fluid pressure p, above ambient")
        K = np.array([value or np.nan for value in seal.path.conductivity])
        if np.nanmax(K, initial=0.0) > 0:
            conductivity.semilogy(1e3 * x, K, "tab:red")
        else:
            _write_into(
                conductivity, "no fluid passes the sealed place:\nK elsewhere was not computed"
            )
    _legend_below(pressures, room=0.02)


def _write_into(axes: "Axes", text: str) -> None:
    """Write a text into axes that would be empty."""
    axes.set_yticks([])
    box = {"facecolor": "white", "edgecolor": "none"}
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, bbox=box)


def _draw_loads(seal: SealRecord, axes: "Axes") -> None:
    """Draw K of every patch against the net load, all but the median patch in grey."""
    axes.set(xlabel="net load P - p [MPa]", ylabel="K [m³/(Pa s)]", title="every patch")
    axes.locator_params(axis="x", nbins=6)
    order = sorted(range(len(seal.patches)), key=lambda k: seal.patches[k].value or 0.0)
    median = order[len(order) // 2]
    drawn = False
    for number, one in enumerate(seal.patches):
        if one.conductivity is None:
            continue
        table, is_median = one.conductivity.table, number == median
        colour, layer = ("tab:red", 3) if is_median else ("0.6", 2)
        open_ = table.upper > 0
        w = 1e-6 * table.loads
        label = "patch of median leak rate, at the left" if is_median else "other patches"
        axes.plot(
            w[open_], table.value[open_], ".-", color=colour, lw=0.8, zorder=layer, label=label
        )
        drawn = drawn or bool(open_.any())
        if is_median and open_.any():
            _draw_bounds(table, axes)
        if not open_.all():
            at = float(w[np.argmin(open_)])
            axes.axvline(at, color=colour, ls=":", lw=1, zorder=layer, label="sealed from here on")
    if drawn:
        axes.set_yscale("log")
        _legend_below(axes, room=0.08)
    else:
        _write_into(axes, "every patch is sealed")


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
