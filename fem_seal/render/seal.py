"""Picture of a seal: pressures and conductivity along the path, and K of every patch."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.results.seal import SealRecord

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def seal_picture(seal: SealRecord, path: str | Path) -> Path:
    """Draw P(x), p(x) and K(x) of the patch of median leak rate, and K against the net load.

    The part of the path that decides the leak rate is shaded: the one with 90 % of the influence
    of ln K on ln Q, or all of it that is known to be sealed. It lies before the steepest fall of
    the fluid's pressure, which lowers the net load of all places behind it.

    Parameters
    ----------
    seal : SealRecord
        Of result.json.
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
    """Draw the figure of `seal_picture`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 7), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.2, 1))
    pressures = figure.add_subplot(grid[0, 0])
    conductivity = figure.add_subplot(grid[1, 0], sharex=pressures)
    _draw_path(seal, pressures, conductivity)
    _draw_loads(seal, figure.add_subplot(grid[:, 1]))
    return figure


def _draw_path(seal: SealRecord, pressures: "Axes", conductivity: "Axes") -> None:
    pressures.set(ylabel="pressure [MPa]", title="along the leak path, from inlet to outlet")
    conductivity.set(xlabel="x [mm]", ylabel="K(P - p) [m³/(Pa s)]")
    pressures.tick_params(labelbottom=False)
    sealed = seal.sealing is not None and seal.leak_rate is not None and seal.leak_rate.upper == 0
    if seal.sealing is not None:
        for axes in (pressures, conductivity):
            # As wide as a line at least: a seal may be known to be sealed at one place alone.
            axes.axvspan(
                1e3 * seal.sealing.start,
                1e3 * seal.sealing.end,
                facecolor="tab:green",
                edgecolor="tab:green",
                alpha=0.4 if sealed else 0.12,
                label="sealed: K = 0" if sealed else "90 % of d ln Q/d ln K",
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
            _say(conductivity, "no fluid passes the sealed place:\nK elsewhere was not computed")
    if seal.sealing is not None:
        pressures.legend(fontsize=8)


def _say(axes: "Axes", words: str) -> None:
    """Write words into axes that would be empty."""
    axes.set_yticks([])
    box = {"facecolor": "white", "edgecolor": "none"}
    axes.text(0.5, 0.5, words, ha="center", va="center", transform=axes.transAxes, bbox=box)


def _draw_loads(seal: SealRecord, axes: "Axes") -> None:
    axes.set(
        xlabel="net load P - p [MPa]",
        ylabel="K [m³/(Pa s)]",
        title="every patch; lines: bounds, dotted: sealed",
    )
    axes.locator_params(axis="x", nbins=6)
    drawn = False
    for number, one in enumerate(seal.patches):
        if one.conductivity is None:
            continue
        table, colour = one.conductivity.table, f"C{number % 10}"
        open_ = table.upper > 0
        w = 1e-6 * table.loads
        for steps in (table.lowest, table.highest):
            between = np.repeat(1e-6 * steps.loads, 2)[1:-1]
            inside = np.repeat(steps.conductivity[1:-1], 2)
            inside[inside == 0] = np.nan
            axes.plot(between, inside, color=colour, alpha=0.5, lw=0.5)
        value = table.value[open_]
        axes.plot(w[open_], value, ".", color=colour, label=f"patch {number + 1}")
        drawn = drawn or bool(open_.any())
        if not open_.all():
            axes.axvline(w[np.argmin(open_)], color=colour, ls=":", lw=0.8)
    if drawn:
        axes.set_yscale("log")
        axes.legend(fontsize=8)
    else:
        _say(axes, "every patch is sealed" if seal.patches[0].conductivity else "lifted off")
