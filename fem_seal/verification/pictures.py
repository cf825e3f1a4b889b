"""Figures of two studies: comparison of methods, price of accuracy."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fem_seal.errors import printable
from fem_seal.leak_rate import Bounded, relative_half_width
from fem_seal.render.plot import label_axis, legend_below, new_figure
from fem_seal.verification.cross_validation import EXACT, Row
from fem_seal.verification.trade import Trade

INSIDE = "0.88"
MOST_APART = 4.0  # distance at the rim of the picture
COLOURS = {"FE": "#b2452b", "adaptive": "#2654a4"}
MARKERS = {"finite-difference": "s", "uniform": "^", "adaptive": "o"}


def cross_validation_figure(
    rows: Sequence[Row], path: Path, title: str, reference: Bounded
) -> None:
    """Draw leak rates against the grid, and the magnitude of their errors against unknowns.

    A guaranteed reference is drawn as a band; errors below its half-width cannot be resolved.
    """
    from matplotlib.ticker import NullLocator, ScalarFormatter

    with new_figure((8.5, 5.4), path) as figure:
        rates, errors = figure.subplots(1, 2)
        for number, name in enumerate(dict.fromkeys(row.method for row in rows)):
            series = [row for row in rows if row.method == name and not row.reason]
            style = _style(name, number)
            rates.plot(
                [row.squares for row in series],
                [row.value / reference.value for row in series],
                **style,
            )
            shown = [row for row in series if abs(row.error) > EXACT]
            if shown:
                x, y = [row.unknowns for row in shown], [abs(row.error) for row in shown]
                errors.plot(x, y, **style)
        floor = relative_half_width(reference.lower, reference.upper)
        if floor:
            bracket = reference.lower / reference.value, reference.upper / reference.value
            rates.axhspan(*bracket, color=INSIDE, zorder=0, label="guaranteed bracket")
            errors.axhspan(errors.get_ylim()[0], floor, color=INSIDE, zorder=0)
        rates.axhline(1, color="0.4", lw=0.8)
        rates.set_xscale("log", base=2)
        rates.set_xticks(sorted({row.squares for row in rows}))
        rates.xaxis.set_major_formatter(ScalarFormatter())
        rates.xaxis.set_minor_locator(NullLocator())
        rates.set(
            xlabel="squares along the flow",
            ylabel="leak rate / reference",
            title=f"{_plain(title)}: every method on ever finer grids",
        )
        errors.set(
            xscale="log",
            yscale="log",
            xlabel="unknowns",
            ylabel="|error| / reference",
            title="Their errors; the bracket hides those in grey" if floor else "Their errors",
        )
        for axes in (rates, errors):
            axes.title.set_fontsize(10)
        legend_below(rates, "center", 4)


def claims_figure(rows: Sequence[Row], path: Path, title: str) -> None:
    """Draw claimed over true errors, and leak rates of several gaps in units of both errors."""
    with new_figure((8.5, 5.4), path) as figure:
        effectivity, distance = figure.subplots(1, 2)
        claimed = [row for row in rows if row.effectivity is not None and row.distance is not None]
        for number, name in enumerate(dict.fromkeys(row.method for row in rows)):
            series = [row for row in claimed if row.method == name]
            if not series:
                continue
            style = _style(name, number) | {"ls": ""}
            unknowns = [row.unknowns for row in series]
            effectivity.plot(unknowns, [row.effectivity for row in series], **style)
            references = [row.reference for row in series]
            apart = np.array([row.distance for row in series], dtype=float)
            distance.plot(references, apart.clip(-MOST_APART, MOST_APART), **style)
        effectivity.axhline(1, color="0.4", lw=0.8)
        effectivity.set(xscale="log", yscale="log", xlabel="unknowns")
        effectivity.set_ylabel("claimed error / true error, at least")
        effectivity.set_title("Claimed errors of every method, gap and grid", fontsize=10)
        distance.axhspan(-1, 1, color=INSIDE, zorder=0)
        distance.axhline(0, color="0.4", lw=0.8)
        distance.set(xscale="log", xlabel="guaranteed leak rate [m³/s]")
        distance.set_ylim(-1.1 * MOST_APART, 1.1 * MOST_APART)
        distance.set_ylabel("(leak rate - guaranteed) / (sum of both errors)")
        distance.set_title(f"Grey: both agree; beyond ±{MOST_APART:g} at the rim", fontsize=10)
        figure.suptitle(_plain(title), fontsize=10)
        legend_below(effectivity, "center", 4)


def _style(name: str, number: int) -> dict[str, object]:
    """Style of a method: colour by family, marker by kind of bound."""
    family = name.partition(" ")[0]
    colour = f"C{number}" if family == "FD" else COLOURS[family]
    side = next((s for s in ("upper", "lower") if s in name), "")
    plain = "sDPX*h"[number % 6] if family == "FD" else "o"
    marker = {"upper": "v", "lower": "^", "": plain}[side]
    dash = "--" if side else "-"
    return {"color": colour, "marker": marker, "ls": dash, "ms": 4, "lw": 1.2, "label": name}


def _plain(title: str) -> str:
    """Text without formulas: matplotlib would read dollars as the start of one."""
    return printable(title).replace("$", r"\$")


def trade_figure(result: Trade, path: Path) -> None:
    """Draw total error against CPU time and against memory, with the Pareto front."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    with new_figure((8.5, 4.8), path) as figure:
        time, memory = figure.subplots(1, 2, sharey=True)
        for certified, dash, words in ((True, "-", "with"), (False, "--", "without")):
            front = result.front(certified)
            seconds, errors = [p.seconds for p in front], [p.total_error for p in front]
            name = f"least time, {words} bounds"
            time.plot(seconds, errors, dash, color="0.75", lw=4, label=name)
        grids = list(dict.fromkeys(point.samples for point in result.points))
        # From light (coarse) to dark (fine): the order survives printing in grey.
        parts = np.linspace(0.85, 0.85 * (len(grids) == 1), len(grids))
        shades = dict(zip(grids, map(to_hex, colormaps["plasma"](parts)), strict=True))
        for point in result.points:
            colour = shades[point.samples]
            style = {"marker": MARKERS[point.flow.method], "color": colour, "ls": "", "ms": 6}
            time.plot(point.seconds, point.total_error, **style)
            memory.plot(point.memory_bytes / 1e6, point.total_error, **style)
        for (nx, ny), shade in shades.items():
            part = next(p.contact_error for p in result.points if p.samples == (nx, ny))
            time.axhline(part, color=shade, ls=":", lw=1)
            memory.axhline(part, color=shade, ls=":", lw=1)
            time.plot([], [], "o", color=shade, label=f"contact {nx} x {ny}")
        for method in dict.fromkeys(point.flow.method for point in result.points):
            time.plot([], [], MARKERS[method], color="0.3", label=f"flow {method}")
        time.plot([], [], ":", color="0.3", label="the contact grid's part")
        time.set(xscale="log", yscale="log", xlabel="CPU time [s]", ylabel="total relative error")
        time.set_title("What a smaller error costs in time", fontsize=10)
        label_axis(time.xaxis)
        label_axis(time.yaxis)
        memory.set_title("and in memory", fontsize=10)
        memory.set_xlabel("resident memory [MB]")
        legend_below(time, "center", 4)
