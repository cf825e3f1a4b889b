"""How far the methods of the letter's Fig. 3 agree, and both models differ."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from demos.letter.currents import FLOW_AREA, Current

# Effective media are compared up to this part of the letter's thresholds.
UP_TO = {"bearing": 0.75 * 0.5, "elastic": 0.75 * 0.42}


@dataclass(frozen=True)
class Agreement:
    """Agreement of the methods over all points of Fig. 3."""

    decades: float  #: log10 of the largest over the smallest certified current
    overlap: int  #: points where the band of finite differences meets the certified bracket
    compared: int  #: points with finite differences
    bruggeman: float  #: largest factor between Bruggeman's current and the bracket, bearing model
    modified: float  #: the same for the modified medium, elastic contact


def agreement(points: Sequence[Current]) -> Agreement:
    """Compare the methods."""
    leaking = [point for point in points if point.value > 0]
    values = [point.value for point in leaking]
    banded = [point for point in leaking if point.harmonic is not None]
    return Agreement(
        decades=float(np.log10(max(values) / min(values))),
        overlap=sum(p.harmonic <= p.upper and p.arithmetic >= p.lower for p in banded),
        compared=len(banded),
        bruggeman=_worst((p, p.bruggeman) for p in leaking if p.model == "bearing"),
        modified=_worst((p, p.modified) for p in leaking if p.model == "elastic"),
    )


def _worst(pairs: Iterable[tuple[Current, float]]) -> float:
    """Largest factor by which a current lies outside the bracket of its point, at least 1."""
    return max(
        (
            max(rate / point.upper, point.lower / rate, 1.0)
            for point, rate in pairs
            if rate and point.area <= UP_TO[point.model]
        ),
        default=1.0,
    )


def total_decades(points: Sequence[Current], corrected: bool = False) -> list[float]:
    """log10 of bearing over elastic leak rate at A/A0 = 0.2, for each seed that has both.

    If `corrected`, the bearing contact has the corrected area of the elastic one in place of the
    counted one; its leak rate is interpolated between points of Fig. 3.
    """
    logs = []
    for elastic in points:
        if elastic.model != "elastic" or elastic.wanted != FLOW_AREA or not elastic.value:
            continue
        cuts = [p for p in points if p.model == "bearing" and p.seed == elastic.seed and p.value]
        curve = np.array(sorted((p.wanted, np.log10(p.value)) for p in cuts)).reshape(-1, 2).T
        at = elastic.corrected if corrected else elastic.wanted
        if cuts and curve[0, 0] <= at <= curve[0, -1]:
            logs.append(float(np.interp(at, *curve) - np.log10(elastic.value)))
    return logs
