"""Thresholds of percolation against the short cut-off."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, NullLocator

from demos.letter.events import REFERENCE
from demos.letter.style import COLOURS, LETTERS_THRESHOLDS, MARKERS, paths
from demos.letter.thresholds import ThresholdRow
from fem_seal.render.plot import new_figure

CORRECTED = "#16805f"
# Quantities of the threshold rows: model, fields of mean and deviation, colour, filled marker.
KINDS = {
    "bearing": ("bearing", "threshold", "deviation", COLOURS["bearing"], True),
    "elastic, contact counted": ("elastic", "threshold", "deviation", COLOURS["elastic"], True),
    "elastic, less what pixels add along the perimeter": (
        "elastic", "corrected", "corrected_deviation", CORRECTED, False,
    ),
}  # fmt: skip


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
            place = ensembles.index((row.case.n, row.case.hurst)) - 0.5 * (len(ensembles) - 1)
            _draw_row(axes, row, 1.05**place, sizes[row.case.n], opacity[row.case.hurst])
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


def _draw_row(axes: Axes, row: ThresholdRow, apart: float, marker: str, opacity: float) -> None:
    """Draw the thresholds of one ensemble, a factor `apart` from its cut-off."""
    for model, value, deviation, colour, filled in KINDS.values():
        if model == row.model:
            axes.errorbar(
                [row.case.short * apart],
                [getattr(row, value)],
                yerr=[(getattr(row, deviation) or 0.0) / row.seeds**0.5],
                fmt=marker,
                color=colour,
                mfc=colour if filled else "white",
                alpha=opacity,
                markersize=5.5,
                capsize=2,
                linewidth=0.9,
            )


def _threshold_marks(sizes: dict[int, str], opacity: dict[float, float]) -> list[Line2D]:
    """Entries of the legend: kinds of threshold, samples along a side, Hurst exponents."""
    kinds = [
        _mark("o", colour, name, colour if filled else "white")
        for name, (*_, colour, filled) in KINDS.items()
    ]
    kinds += [_mark(marker, "0.3", f"n = {n}", "0.3") for n, marker in sizes.items()]
    return kinds + [_mark("o", "0.3", f"H = {H:g}", "0.3", faint) for H, faint in opacity.items()]


def _mark(marker: str, colour: str, label: str, face: str = "white", alpha: float = 1.0) -> Line2D:
    """Entry of a legend."""
    return Line2D(
        [], [], marker=marker, color=colour, mfc=face, ls="none", label=label, alpha=alpha
    )
