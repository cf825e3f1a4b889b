"""Figures of the letter, and of the thresholds, as PNG and PDF."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, NullLocator

from demos.letter.currents import FLOW_AREA, Current
from demos.letter.flows import Picture
from demos.letter.persson import Prediction
from demos.letter.thresholds import REFERENCE, ThresholdRow
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.colours import CONTACT, NO_FLOW
from fem_seal.render.flow import FLOW_COLOURS, draw_flow
from fem_seal.render.page import Window, add_bar, page, window_of
from fem_seal.render.plot import new_figure
from fem_seal.render.samples import CONTACT_KEY, draw_contact
from fem_seal.render.scale import Scale

FORMATS = ("png", "pdf")
PANEL_SIDE = 3.5  # longer side of each panel of Figs. 1 and 2 [inch]
MAGNIFIED = 0.25  # part of each side of the cell that their lower row shows
DECADES = 5  # length of the colour bar of Fig. 2
LAWS = {"persson": ("Persson (2001)", "-."), "wang-mueser": ("Wang and Müser (2017)", "-")}
# The colours of models also differ in their grey values; seeds and sizes differ in the marker.
COLOURS = {"bearing": "#b2452b", "elastic": "#1f4e9e"}
CORRECTED, PERSSON = "#16805f", "#444444"
# Effective medium beside each model, and its field of a `Current`.
MEDIA = {
    "bearing": ("Bruggeman", "bruggeman"),
    "elastic": ("modified Bruggeman, A* = 0.42", "modified"),
}
MARKERS = ("o", "s", "^", "D", "v", "p", "h", "<", ">", "*")
# What the letter's text says of Fig. 3: A*/A0 of each model with its uncertainty (elastic: one half
# less 0.075 ± 0.015), and by how many decades elastic deformation reduces the flow at A/A0 = 0.2.
LETTERS_THRESHOLDS = {"bearing": (0.5, 0.02), "elastic": (0.425, 0.025)}
LETTERS_DECADES = 3


def contact_figure(contacts: dict[str, Picture], folder: Path) -> None:
    """Fig. 1: contact and open domains of each model, and a part magnified below."""
    films = {model: GridFilm(picture.gap, "periodic") for model, picture in contacts.items()}
    window, shape = window_of(next(iter(films.values()))), (2, len(films))
    with page(
        window, *paths(folder, "fig1"), shape=shape, side=PANEL_SIDE, key=CONTACT_KEY
    ) as axes:
        for (model, film), whole, part in zip(films.items(), *axes, strict=True):
            draw_contact(whole, film, title=_title(model, film.gap))
            draw_contact(part, film, window=_part(film.gap))


def flow_figure(flows: dict[str, Picture], folder: Path) -> None:
    """Fig. 2: flow density of both models on one scale, and a part magnified below."""
    peak = float(flows["bearing"].density.max())
    name = "flow density / peak of the bearing model"
    scale = Scale(name, 10.0**-DECADES, 1.0, True, FLOW_COLOURS, "min")
    window, shape = window_of(GridFilm(flows["bearing"].gap, "periodic")), (2, len(flows))
    key = (CONTACT, NO_FLOW)
    with page(window, *paths(folder, "fig2"), shape=shape, side=PANEL_SIDE, key=key) as axes:
        for (model, picture), whole, part in zip(flows.items(), *axes, strict=True):
            field = replace(picture.flow, flux=picture.flow.flux / peak)
            film = GridFilm(picture.gap, "periodic")
            draw_flow(whole, field, film, scale, title=_title(model, picture.gap))
            draw_flow(part, field, film, scale, window=_part(picture.gap))
        for row in axes:
            add_bar(row[-1], scale)


def _title(model: str, gap: GridField) -> str:
    return f"{model}, A/A0 = {np.mean(gap.values == 0):.3f}"


def _part(gap: GridField) -> Window:
    """Window of the magnified part, at the centre of the cell."""
    Lx, Ly = gap.size
    low, high = 0.5 * (1 - MAGNIFIED), 0.5 * (1 + MAGNIFIED)
    return Window(low * Lx, high * Lx, low * Ly, high * Ly)


def paths(folder: Path, name: str) -> list[Path]:
    """Paths of a figure in every format."""
    return [folder / f"{name}.{suffix}" for suffix in FORMATS]


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
        _draw_media(counted, currents)
        _draw_decades(counted, leaking)
        _draw_theory(corrected, persson)
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


def _draw_media(axes: Axes, currents: Sequence[Current]) -> None:
    """Draw the effective medium of each model, and the letter's threshold as a band."""
    for model, (name, medium) in MEDIA.items():
        curve = {"color": COLOURS[model], "linewidth": 1.2, "label": f"{name}, same gaps"}
        axes.plot(*_medium(currents, model, medium), "-", **curve)
        middle, error = LETTERS_THRESHOLDS[model]
        band = {"color": COLOURS[model], "alpha": 0.13, "lw": 0}
        band["label"] = f"the letter's A*: {middle:g} ± {error:g}"
        axes.axvspan(middle - error, middle + error, **band)


def _draw_theory(axes: Axes, persson: Sequence[Prediction]) -> None:
    for row in _curves(persson):
        x, y = ([getattr(r, name) for r in row] for name in ("area", "current"))
        name, dash = LAWS[row[0].law]
        style = {"color": PERSSON, "linewidth": 1, "label": f"Persson, area of {name}"}
        axes.plot(x, y, dash, **style)


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


def _medium(currents: Sequence[Current], model: str, medium: str) -> tuple[list, list]:
    """Areas and leak rates of a medium, geometric mean over the seeds."""
    rows = [point for point in currents if point.model == model]
    x, y = [], []
    for area in sorted({row.wanted for row in rows}):
        values = [getattr(row, medium) for row in rows if row.wanted == area]
        if min(values) > 0:
            x.append(area)
            y.append(float(np.exp(np.mean(np.log(values)))))
    return x, y


def _curves(persson: Sequence[Prediction]) -> list[list[Prediction]]:
    """Leaking parts of the curves by law and seed."""
    keys = dict.fromkeys((row.law, row.seed) for row in persson)
    curves = [[r for r in persson if (r.law, r.seed) == key and r.current > 0] for key in keys]
    return [curve for curve in curves if curve]


def _draw_errors(axes: Axes, elastic: Sequence[Current], style: dict) -> None:
    """Draw the errors of elastic points: half-width of the bracket, change of the grid."""
    areas, widths = ([getattr(p, name) for p in elastic] for name in ("area", "half_width"))
    axes.plot(areas, widths, mfc="white", markersize=5, **style)
    finer = [point for point in elastic if point.grid_change]
    if finer:
        areas, changes = ([getattr(p, name) for p in finer] for name in ("area", "grid_change"))
        style = {**style, "color": "k", "label": "error of the contact's grid"}
        axes.plot(areas, changes, markersize=5, **style)


def _mark(marker: str, colour: str, label: str, face: str = "white", alpha: float = 1.0) -> Line2D:
    """Entry of a legend."""
    return Line2D(
        [], [], marker=marker, color=colour, mfc=face, ls="none", label=label, alpha=alpha
    )


# Quantities of the threshold rows: model, fields of mean and deviation, colour, filled marker.
KINDS = {
    "bearing": ("bearing", "threshold", "deviation", COLOURS["bearing"], True),
    "elastic, contact counted": ("elastic", "threshold", "deviation", COLOURS["elastic"], True),
    "elastic, less what pixels add along the perimeter": (
        *("elastic", "corrected", "corrected_deviation", CORRECTED, False),
    ),
}


def threshold_figure(rows: Sequence[ThresholdRow], folder: Path) -> None:
    """A*/A0 of the triangulation against the short cut-off in samples.

    Lines mark one half, where a cut surface percolates by symmetry, and the letter's elastic
    threshold.
    """
    rows = [row for row in rows if row.pair == REFERENCE]
    sizes = dict(zip(sorted({row.case.n for row in rows}), MARKERS * 9, strict=False))
    hursts = sorted({row.case.hurst for row in rows}, reverse=True)
    opacity = dict(zip(hursts, np.linspace(1, 0.35, len(hursts)), strict=True))
    ensembles = sorted({(row.case.n, row.case.hurst) for row in rows})
    with new_figure((6.6, 4.6), *paths(folder, "thresholds")) as figure:
        axes = figure.subplots()
        for row in rows:
            apart = 1.05 ** (
                ensembles.index((row.case.n, row.case.hurst)) - 0.5 * (len(ensembles) - 1)
            )
            for model, value, deviation, colour, filled in KINDS.values():
                if model == row.model:
                    axes.errorbar(
                        [row.case.short * apart],
                        [getattr(row, value)],
                        yerr=[(getattr(row, deviation) or 0.0) / row.seeds**0.5],
                        fmt=sizes[row.case.n],
                        color=colour,
                        mfc=colour if filled else "white",
                        alpha=opacity[row.case.hurst],
                        markersize=5.5,
                        capsize=2,
                        linewidth=0.9,
                    )
        letters = LETTERS_THRESHOLDS["elastic"][0]
        for height, name in ((0.5, "one half"), (letters, "the letter's\nelastic contact")):
            axes.axhline(height, color="0.55", linewidth=0.8, zorder=0)
            axes.text(
                1.01, height, name, transform=axes.get_yaxis_transform(), va="center", fontsize=7
            )
        axes.set_xscale("log", base=2)
        axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xticks(sorted({row.case.short for row in rows}))
        axes.set(
            xlabel="short cut-off λs [samples]",
            ylabel="percolation threshold A*/A0",
            title="Elastic contact percolates earlier than a cut",
        )

        figure.legend(
            handles=_threshold_marks(sizes, opacity),
            loc="outside lower center",
            frameon=False,
            fontsize=7.5,
            ncols=3,
            title="mean over seeds; bars: its standard error (none for a single seed)",
            title_fontsize=7.5,
        )


def _threshold_marks(sizes: dict[int, str], opacity: dict[float, float]) -> list[Line2D]:
    """Entries of the legend: kinds of threshold, samples along a side, Hurst exponents."""
    kinds = [
        _mark("o", colour, name, colour if filled else "white")
        for name, (*_, colour, filled) in KINDS.items()
    ]
    kinds += [_mark(marker, "0.3", f"n = {n}", "0.3") for n, marker in sizes.items()]
    return kinds + [_mark("o", "0.3", f"H = {H:g}", "0.3", faint) for H, faint in opacity.items()]
