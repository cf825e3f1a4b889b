"""Percolation thresholds against the short cut-off: counted, and without what pixels add."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fem_seal.render.aside import written_aside
from fem_seal.render.page import DPI, FONT_POINTS
from fem_seal.study.letter.seed_thresholds import REFERENCE
from fem_seal.study.letter.threshold_rows import ThresholdRow

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FORMATS = ("png", "pdf")
BEARING, ELASTIC = "#b2452b", "#1f4e9e"
MARKERS = ("o", "s", "^", "D", "v", "p")


def threshold_figure(rows: Sequence[ThresholdRow], folder: Path) -> list[Path]:
    """Plot A*/A0 of the triangulation against the short cut-off in samples.

    Parameters
    ----------
    rows : of `fem_seal.study.percolation`; those of the first edges are drawn
    folder : of thresholds.png and thresholds.pdf

    Returns
    -------
    The files.
    """
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.ticker import FormatStrFormatter

    shown = [r for r in rows if (r.pair, r.edges) == (REFERENCE, rows[0].edges)]
    ensembles = sorted({(r.n, r.hurst) for r in shown})
    paths = []
    with matplotlib.rc_context({"font.size": FONT_POINTS, "pdf.fonttype": 42}):
        figure = Figure(figsize=(6.4, 4.2), dpi=DPI, facecolor="white", layout="constrained")
        axes = figure.subplots()
        for k, ensemble in enumerate(ensembles):
            some = [r for r in shown if (r.n, r.hurst) == ensemble]
            # Side by side, so that the bars of equal cut-offs can be told apart.
            shift = 1.05 ** (k - 0.5 * (len(ensembles) - 1))
            _draw(axes, sorted(some, key=lambda r: r.short), shift, MARKERS[k % len(MARKERS)])
        axes.axhline(0.5, color="0.6", linewidth=0.8)
        axes.set(xlabel="short cut-off [samples]", ylabel="percolation threshold A*/A0")
        axes.set_xscale("log", base=2)
        axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
        figure.legend(loc="outside lower center", frameon=False, fontsize=7, ncols=2)
        for suffix in FORMATS:
            paths.append(folder / f"thresholds.{suffix}")
            with written_aside(paths[-1]) as aside:
                figure.savefig(aside, dpi=DPI)
    return paths


def _draw(axes: "Axes", rows: Sequence[ThresholdRow], shift: float, marker: str) -> None:
    """Both models of one ensemble; bars are the spread of one seed."""
    cut = [r for r in rows if r.model == "bearing"]
    pressed = [r for r in rows if r.model == "elastic"]
    name = f"n = {rows[0].n}, H = {rows[0].hurst:g}"
    raw, corrected = ("threshold", "spread"), ("corrected", "corrected_spread")
    for chosen, (value, spread), colour, fill, line, what in (
        (cut, raw, BEARING, BEARING, "-", "bearing"),
        (pressed, raw, ELASTIC, ELASTIC, "-", "elastic, counted"),
        (pressed, corrected, ELASTIC, "white", ":", "elastic, perimeter-corrected"),
    ):
        axes.errorbar(
            [r.short * shift for r in chosen],
            [getattr(r, value) for r in chosen],
            yerr=[getattr(r, spread) or 0.0 for r in chosen],
            fmt=marker + line,
            color=colour,
            markerfacecolor=fill,
            markersize=5,
            capsize=2,
            linewidth=0.8,
            label=f"{what}, {name}",
        )
