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
    of ln K on ln Q, or all that is known to be sealed, in which p is not known. It lies before the
    steepest fall of the fluid's pressure: K at a place influences p, and so the net load P - p, of
    all places behind it.

    Parameters
    ----------
    seal : seal of a result.json
    path : PNG file to write
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
    sealed = seal.patches[_median(seal)].state == "sealed"
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
        x, P = 1e3 * np.array(seal.path.x), 1e-6 * np.array(seal.path.contact_pressure)
        pressures.plot(x, P, "k", label="contact pressure P")
        _draw_fluid_pressure(seal, pressures, sealed)
        K = np.array([value or np.nan for value in seal.path.conductivity])
        if not sealed:
            conductivity.semilogy(x, K, "tab:red")
        else:
            _write_into(conductivity, _why_no_conductivity(seal))
    _legend_below(pressures, room=0.02)


def _draw_fluid_pressure(seal: SealRecord, axes: "Axes", sealed: bool) -> None:
    """Draw the fluid's pressure; inside a sealed part it is not known."""
    if seal.path is None:
        return
    x, p = 1e3 * np.array(seal.path.x), 1e-6 * np.array(seal.path.fluid_pressure)
    if not sealed or seal.sealing is None:
        axes.plot(x, p, "tab:blue", label="fluid pressure p, above ambient")
        return
    start, end = 1e3 * seal.sealing.start, 1e3 * seal.sealing.end
    before = np.append(x[x < start], start), np.append(p[x < start], p[0])
    behind = np.append(end, x[x > end]), np.append(p[-1], p[x > end])
    label = "fluid pressure p, above ambient; not known where sealed"
    axes.plot(*before, "o-", color="tab:blue", markevery=[-1], clip_on=False, label=label)
    axes.plot(*behind, "o-", color="tab:blue", markevery=[0], clip_on=False)


def _why_no_conductivity(seal: SealRecord) -> str:
    part, path = seal.sealing, seal.path
    if part is not None and path is not None and (part.start, part.end) == path.ends:
        return "K = 0 on the whole path"
    return "no fluid passes the sealed place:\nK elsewhere was not computed"


def _median(seal: SealRecord) -> int:
    """Index of the patch of median leak rate, as `median_patch` takes it."""
    order = sorted(range(len(seal.patches)), key=lambda k: seal.patches[k].value or 0.0)
    return order[len(order) // 2]


def _write_into(axes: "Axes", text: str) -> None:
    """Write a text into axes that would be empty."""
    axes.set_yticks([])
    box = {"facecolor": "white", "edgecolor": "none"}
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, bbox=box)


def _draw_loads(seal: SealRecord, axes: "Axes") -> None:
    """Draw K of every patch against the net load, all but the median patch in grey.

    A dotted line goes from the last load at which a patch leaks to the first at which it is sealed.
    """
    axes.set(xlabel="net load P - p [MPa]", title="every patch")
    tables = [one.conductivity.table for one in seal.patches if one.conductivity is not None]
    if not any((table.upper > 0).any() for table in tables):
        _draw_sealed_loads(tables, axes)
        return
    axes.set(ylabel="K [m³/(Pa s)]", yscale="log")
    axes.locator_params(axis="x", nbins=6)
    median, ends = _median(seal), []
    for number, one in enumerate(seal.patches):
        if one.conductivity is None:
            continue
        table, is_median = one.conductivity.table, number == median
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
    _legend_below(axes, room=0.08)


def _draw_sealed_loads(tables: list[ConductivityTable], axes: "Axes") -> None:
    """Draw the net loads from which on each patch is sealed, where none was seen to leak."""
    loads = [1e-6 * float(table.loads[0]) for table in tables]
    numbers = np.arange(1, len(loads) + 1)
    most = 1.25 * max(loads, default=1.0)
    axes.set(ylabel="patch", xlim=(0, most), ylim=(0, len(loads) + 1))
    axes.locator_params(axis="y", integer=True)
    axes.hlines(numbers, loads, most, color="tab:green", lw=3, alpha=0.4, label="sealed: K = 0")
    axes.plot(loads, numbers, "x", color="k", label="solved, and sealed; less was not solved")
    _legend_below(axes, room=0.08)


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
