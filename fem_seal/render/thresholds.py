"""Figure of percolation thresholds against the short cut-off, also corrected for pixels."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.letter.seed_thresholds import REFERENCE
from fem_seal.letter.threshold_rows import ThresholdRow
from fem_seal.render.plot import new_figure
from fem_seal.theory.bruggeman import ELASTIC_THRESHOLD

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("png", "pdf")
MARKERS = ("o", "s", "^", "D", "v", "p")
APART = 1.05  # ratio of the places of two points of equal cut-off, drawn in the order of n and H
PALE = 0.45  # opacity of points whose Hurst exponent is not the largest


@dataclass(frozen=True)
class _Kind:
    """A quantity of the rows and the style of its points."""

    name: str  #: name in the legend
    model: str  #: contact model of the rows to draw
    #: names of two fields of a row: threshold, and its standard deviation over the seeds
    value: str
    spread: str
    colour: str
    filled: bool  #: whether markers are filled; visible also in print without colour


KINDS = (
    _Kind("bearing", "bearing", "threshold", "spread", "#b2452b", True),
    _Kind("elastic, contact counted", "elastic", "threshold", "spread", "#1f4e9e", True),
    _Kind(
        "elastic, less what pixels add along the perimeter",
        "elastic",
        "corrected",
        "corrected_spread",
        "#16805f",
        False,
    ),
)


def threshold_figure(rows: Sequence[ThresholdRow], folder: Path) -> list[Path]:
    """Plot A*/A0 of the triangulation against the short cut-off in samples.

    Bars are the standard error of the mean over seeds. Lines mark one half, where a cut surface
    percolates by symmetry, and 0.42, the letter's elastic threshold (W. B. Dapp et al., Phys. Rev.
    Lett. 108, 244301 (2012)).

    Parameters
    ----------
    rows : rows of one or several runs of `fem_seal.letter.percolation`. Only those with the kind of
        edges of the first row are drawn
    folder : folder for thresholds.png and thresholds.pdf
    """
    paths = [folder / f"thresholds.{suffix}" for suffix in FORMATS]
    with new_figure((6.6, 4.4), *paths) as figure:
        _draw(figure, [r for r in rows if (r.pair, r.edges) == (REFERENCE, rows[0].edges)])
    return paths


def _draw(figure: "Figure", rows: Sequence[ThresholdRow]) -> None:
    from matplotlib.ticker import FormatStrFormatter, NullLocator

    axes = figure.subplots()
    sizes = sorted({row.n for row in rows})
    ensembles = sorted({(row.n, row.hurst) for row in rows})
    steepest = max(row.hurst for row in rows)
    for row in rows:
        position = ensembles.index((row.n, row.hurst)) - 0.5 * (len(ensembles) - 1)
        marker = MARKERS[sizes.index(row.n) % len(MARKERS)]
        alpha = 1.0 if row.hurst == steepest else PALE
        for kind in KINDS:
            if kind.model == row.model:
                _point(axes, row, kind, row.short * APART**position, marker, alpha)
    axes.set(xlabel="short cut-off λs [samples]", ylabel="percolation threshold A*/A0")
    axes.set_xscale("log", base=2)
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticks(sorted({row.short for row in rows}))
    left, right = axes.get_xlim()
    axes.set_xlim(left, right * 1.25)
    for height, name in ((0.5, "one half"), (ELASTIC_THRESHOLD, "the letter's\nelastic contact")):
        axes.axhline(height, color="0.55", linewidth=0.8, zorder=0)
        axes.text(right * 1.2, height, name, va="bottom", ha="right", fontsize=7, color="0.35")
    _legend(figure, sizes, sorted({row.hurst for row in rows}))


def _point(
    axes: "Axes", row: ThresholdRow, kind: _Kind, x: float, marker: str, alpha: float
) -> None:
    """Draw a mean with its standard error (0 for a single seed)."""
    axes.errorbar(
        [x],
        [getattr(row, kind.value)],
        yerr=[(getattr(row, kind.spread) or 0.0) / np.sqrt(row.seeds)],
        fmt=marker,
        color=kind.colour,
        markerfacecolor=kind.colour if kind.filled else "white",
        alpha=alpha,
        markersize=5.5,
        capsize=2,
        linewidth=0.9,
    )


def _legend(figure: "Figure", sizes: list[int], hursts: list[float]) -> None:
    """Explain colour and filling (quantity), marker (n) and opacity (H) below the figure."""
    from matplotlib.lines import Line2D

    def entry(marker: str, colour: str, filled: bool, name: str, alpha: float = 1.0) -> Line2D:
        face = colour if filled else "white"
        point = Line2D([], [], marker=marker, color=colour, markerfacecolor=face, label=name)
        point.set(linestyle="none", alpha=alpha)
        return point

    entries = [entry("o", kind.colour, kind.filled, kind.name) for kind in KINDS]
    entries += [
        entry(MARKERS[k % len(MARKERS)], "0.3", True, f"n = {n}") for k, n in enumerate(sizes)
    ]
    if len(hursts) > 1:
        entries += [
            entry("o", "0.3", True, f"H = {H:g}", 1.0 if hursts[-1] == H else PALE)
            for H in hursts[::-1]
        ]
    figure.legend(handles=entries, loc="outside lower center", frameon=False, fontsize=7.5, ncols=3)
