"""Curves of Fig. 3 that its leak rates are compared with: effective media, Persson's theory."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from demos.letter.currents import Current
from demos.letter.persson import Prediction
from demos.letter.style import COLOURS, LETTERS_THRESHOLDS

LAWS = {"persson": ("Persson (2001)", "-."), "wang-mueser": ("Wang and Müser (2017)", "-")}
PERSSON = "#444444"
# Effective medium beside each model, and its field of a `Current`.
MEDIA = {
    "bearing": ("Bruggeman", "bruggeman"),
    "elastic": ("modified Bruggeman, A* = 0.42", "modified"),
}


def draw_media(axes: Axes, currents: Sequence[Current]) -> None:
    """Draw the effective medium of each model, and the letter's threshold as a band."""
    for model, (name, medium) in MEDIA.items():
        curve = {"color": COLOURS[model], "linewidth": 1.2, "label": f"{name}, same gaps"}
        axes.plot(*_medium(currents, model, medium), "-", **curve)
        middle, error = LETTERS_THRESHOLDS[model]
        band = {"color": COLOURS[model], "alpha": 0.13, "lw": 0}
        band["label"] = f"the letter's A*: {middle:g} ± {error:g}"
        axes.axvspan(middle - error, middle + error, **band)


def draw_theory(axes: Axes, persson: Sequence[Prediction]) -> None:
    """Draw the leaking part of each of Persson's curves."""
    for row in _curves(persson):
        x, y = ([getattr(r, name) for r in row] for name in ("area", "current"))
        name, dash = LAWS[row[0].law]
        style = {"color": PERSSON, "linewidth": 1, "label": f"Persson, area of {name}"}
        axes.plot(x, y, dash, **style)


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
