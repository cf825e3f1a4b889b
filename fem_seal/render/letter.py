"""Figures of the 2012 letter from the data of `fem_seal.letter`, as PNG and PDF."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.film.grid_film import GridFilm
from fem_seal.grid import GridField
from fem_seal.letter.pictures import FlowPicture
from fem_seal.letter.rows import CurrentRow, ErrorRow, PerssonRow
from fem_seal.render.contact import CONTACT_KEY, contact_panel
from fem_seal.render.flow import CONTACT, FLOW_COLOURS, NO_FLOW, flow_panel
from fem_seal.render.page import write_page
from fem_seal.render.plot import new_figure
from fem_seal.render.window import Scale, Window

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FORMATS = ("png", "pdf")
PANEL_SIDE = 700  # pixels of the longer side of each panel
# Part of each side of the cell that the lower row of Figs. 1 and 2 shows magnified.
MAGNIFIED = 0.25
DECADES = 4  # length of the colour bar of Fig. 2
LAWS = {"persson": "Persson (2001)", "wang-mueser": "Wang and Müser (2017)"}
# The colours of models also differ in their grey values; seeds differ in the marker.
BEARING, ELASTIC, PERSSON = "#b2452b", "#1f4e9e", "#444444"
MARKERS = ("o", "s", "^", "D", "v", "p", "h", "<", ">", "*")


def contact_figure(
    contacts: dict[str, GridField], folder: Path, panel_side: int = PANEL_SIDE
) -> list[Path]:
    """Draw Fig. 1: contact and open domains of each model, and a part magnified below.

    Parameters
    ----------
    contacts : gap [m] by model
    folder : folder for fig1.png and fig1.pdf
    panel_side : pixels of the longer side of each panel
    """
    whole = [
        contact_panel(GridFilm(gap, "periodic"), long_side=panel_side, title=_title(model, gap))
        for model, gap in contacts.items()
    ]
    parts = [
        contact_panel(GridFilm(gap, "periodic"), window=_part(gap), long_side=panel_side)
        for gap in contacts.values()
    ]
    return [write_page([whole, parts], p, key=CONTACT_KEY) for p in _paths(folder, "fig1")]


def flow_figure(
    flows: dict[str, FlowPicture], folder: Path, panel_side: int = PANEL_SIDE
) -> list[Path]:
    """Draw Fig. 2: flow density of each model over its peak, and a part magnified below.

    Parameters
    ----------
    flows : flow by model
    folder : folder for fig2.png and fig2.pdf
    panel_side : pixels of the longer side of each panel
    """
    scale = Scale("flow density / peak", 10.0**-DECADES, 1.0, True, FLOW_COLOURS, "min")
    whole, parts = [], []
    for model, picture in flows.items():
        field = replace(picture.flow, flux=picture.flow.flux / picture.peak)
        title = f"{_title(model, picture.gap)}, peak {picture.peak:.2g} m²/s"
        film = GridFilm(picture.gap, "periodic")
        part = _part(picture.gap)
        whole.append(flow_panel(field, film, scale, title=title, long_side=panel_side))
        parts.append(flow_panel(field, film, scale, window=part, long_side=panel_side))
    key = (CONTACT, NO_FLOW)
    return [
        write_page([whole, parts], path, scale=scale, key=key) for path in _paths(folder, "fig2")
    ]


def _title(model: str, gap: GridField) -> str:
    return f"{model}, A/A0 = {np.mean(gap.values == 0):.3f}"


def _part(gap: GridField) -> Window:
    """Window of the magnified part, at the centre of the cell."""
    Lx, Ly = gap.size
    low, high = 0.5 * (1 - MAGNIFIED), 0.5 * (1 + MAGNIFIED)
    return Window(low * Lx, high * Lx, low * Ly, high * Ly)


def _paths(folder: Path, name: str) -> list[Path]:
    """Paths of a figure in every format."""
    return [folder / f"{name}.{suffix}" for suffix in FORMATS]


def current_figure(
    currents: Sequence[CurrentRow], persson: Sequence[PerssonRow], folder: Path
) -> list[Path]:
    """Draw Fig. 3: leak rate over that at first contact, against contact area.

    Parameters
    ----------
    currents : points of both models and all seeds; the logarithmic axis has no place for sealed
        ones
    persson : Persson's predictions with the modified Bruggeman medium, for each law of the area
    folder : folder for fig3.png and fig3.pdf
    """
    paths = _paths(folder, "fig3")
    with new_figure((9.6, 4.6), *paths) as figure:
        counted, corrected = figure.subplots(1, 2, sharey=True)
        for model, colour in (("bearing", BEARING), ("elastic", ELASTIC)):
            rows = [row for row in currents if row.model == model]
            _points(counted, rows, colour, model)
            medium = "bruggeman" if model == "bearing" else "modified_measured"
            _lines(counted, rows, medium, colour)
        elastic = [row for row in currents if row.model == "elastic" and row.value > 0]
        for marker, rows in _of_seeds(elastic):
            corrected.plot(
                [row.area_corrected for row in rows],
                [row.value for row in rows],
                marker,
                color=ELASTIC,
                markersize=5,
                markerfacecolor="white",
                label=None
                if rows[0].seed > elastic[0].seed
                else "elastic, certified finite elements",
            )
        for (law, name), style in zip(LAWS.items(), ("-.", "-"), strict=True):
            for seed in sorted({row.seed for row in persson}):
                shown = [r for r in persson if (r.law, r.seed) == (law, seed) and r.current > 0]
                corrected.plot(
                    [row.area for row in shown],
                    [row.current for row in shown],
                    style,
                    color=PERSSON,
                    linewidth=1,
                    label=f"Persson, area of {name}" if seed == persson[0].seed else None,
                )
        smallest = min(row.lower for row in currents if row.lower > 0)
        counted.set(
            xlabel="counted contact area A/A0",
            ylabel="leak rate / leak rate at first contact",
            yscale="log",
            xlim=(0, 0.55),
            ylim=(smallest / 30, 2),
        )
        corrected.set(xlabel="contact area A/A0, corrected for the perimeter", xlim=(0, 0.55))
        for axes in (counted, corrected):
            axes.legend(frameon=False, fontsize=7, loc="lower left")
    return paths


def _of_seeds(rows: Sequence[CurrentRow]) -> Iterator[tuple[str, list[CurrentRow]]]:
    """Marker and rows of each seed, in the order of the seeds."""
    for seed, marker in zip(sorted({row.seed for row in rows}), MARKERS * 9, strict=False):
        yield marker, [row for row in rows if row.seed == seed]


def _points(axes: "Axes", rows: Sequence[CurrentRow], colour: str, model: str) -> None:
    """Draw brackets as error bars, finite differences as crosses with the band of their links."""
    label, fd_label = f"{model}, certified finite elements", f"{model}, finite differences"
    first = True
    for marker, of_seed in _of_seeds(rows):
        points = [row for row in of_seed if row.value > 0]
        area = [row.area for row in points]
        value = np.array([row.value for row in points])
        bars = value - [row.lower for row in points], [row.upper for row in points] - value
        axes.errorbar(
            area,
            value,
            yerr=bars,
            fmt=marker,
            label=label if first else None,
            color=colour,
            markersize=5,
            markerfacecolor="white",
            capsize=2,
        )
        bands = [
            (row.area + 0.003, row.linear_gap, row.harmonic, row.arithmetic)
            for row in points
            if row.harmonic is not None
        ]
        # Drawn beside the bracket, not over it. Zero has no place on the logarithmic axis.
        band = np.array([numbers for numbers in bands if numbers[2]], dtype=float).reshape(-1, 4)
        if not band.size:
            continue
        axes.errorbar(
            band[:, 0],
            band[:, 1],
            yerr=(band[:, 1] - band[:, 2], band[:, 3] - band[:, 1]),
            fmt="x",
            color=colour,
            alpha=0.55,
            markersize=4,
            elinewidth=0.8,
            label=fd_label if first else None,
        )
        first = False


def _lines(axes: "Axes", rows: Sequence[CurrentRow], medium: str, colour: str) -> None:
    """Draw the leak rate of Bruggeman's medium, geometric mean over the seeds."""
    areas = sorted({round(row.area, 2) for row in rows})
    x, y = [], []
    for area in areas:
        values = [getattr(row, medium) for row in rows if round(row.area, 2) == area]
        if min(values) > 0:
            x.append(area)
            y.append(np.exp(np.mean(np.log(values))))
    name = "Bruggeman" if medium == "bruggeman" else "modified Bruggeman (A* measured)"
    axes.plot(x, y, "-", color=colour, linewidth=1.2, label=f"{name}, simulated gaps")


def error_figure(errors: Sequence[ErrorRow], folder: Path) -> list[Path]:
    """Draw the error of the contact grid and the relative half-width of the bracket.

    Parameters
    ----------
    errors : at least one row
    folder : folder for errors.png and errors.pdf
    """
    paths = _paths(folder, "errors")
    with new_figure((5.2, 3.8), *paths) as figure:
        axes = figure.subplots()
        area = [row.area for row in errors]
        finest = errors[0].finest_factor
        axes.semilogy(area, [row.flow for row in errors], "o-", color=ELASTIC, mfc="white")
        names = ["flow: half-width of the bracket", f"contact grid: |ln Q({finest}n)/Q(n)|"]
        refined = [row for row in errors if row.contact_grid]
        changes = [row.contact_grid for row in refined]
        axes.semilogy([row.area for row in refined], changes, "s--", color=BEARING)
        if finest > 2:
            names.append(f"contact grid: |ln Q({finest}n)/Q({finest // 2}n)|")
            refined = [row for row in errors if row.last_change]
            changes = [row.last_change for row in refined]
            axes.semilogy([row.area for row in refined], changes, "^:", color=BEARING)
        axes.legend(names, frameon=False)
        axes.set(xlabel="relative contact area A/A0", ylabel="relative error of the leak rate")
    return paths
