"""Thresholds of an ensemble: means over its seeds."""

from dataclasses import dataclass

import numpy as np

from fem_seal.letter.seed_thresholds import SeedThresholds
from fem_seal.letter.spanning import PAIRS


@dataclass(frozen=True)
class ThresholdRow:
    """Thresholds of an ensemble: means over seeds; spreads are standard deviations of one seed.

    n .. model : the ensemble; pair, edges : what spanning means
    threshold, spread : A*/A0
    corrected, corrected_spread : after the perimeter correction; elastic contact only
    contact_begins, open_ceases : the two areas whose mean A* is
    euler_contact, euler_open : at the contact nearest to A*, on the torus
    perimeter : edges of pixels between contact and open there, for each sample of the surface
    largest_contact, largest_open : shares of A0 there
    constriction_gap : [m]; constriction_share : of the dissipation
    """

    n: int
    hurst: float
    short: float
    long: float
    model: str
    pair: str
    edges: str
    seeds: int
    threshold: float
    spread: float | None
    corrected: float | None
    corrected_spread: float | None
    contact_begins: float
    open_ceases: float
    euler_contact: float
    euler_open: float
    perimeter: float
    largest_contact: float
    largest_open: float
    constriction_gap: float | None
    constriction_share: float | None


def threshold_rows(points: list[SeedThresholds]) -> list[ThresholdRow]:
    """Rows of every pair of connectivities and kind of edges, from the seeds of one ensemble."""
    first = points[0]
    return [_row(points, pair, edges) for edges in first.search.edges for pair in PAIRS]


def _row(points: list[SeedThresholds], pair: str, edges: str) -> ThresholdRow:
    case = points[0].case
    raw = [point.of(pair, edges) for point in points]
    # A pixel that carries pressure counts whole; a cut through the heights counts without bias.
    elastic = points[0].model == "elastic"
    corrected = [point.of(pair, edges, corrected=True) for point in points if elastic]
    begins, ceases = np.mean([point.between(pair, edges) for point in points], axis=0)
    contact, open_ = PAIRS[pair]
    near = [point.at_threshold(edges) for point in points]
    tight = [point.constriction for point in points if point.constriction]
    return ThresholdRow(
        n=case.n,
        hurst=case.hurst,
        short=case.short,
        long=case.long * case.n,
        model=points[0].model,
        pair=pair,
        edges=edges,
        seeds=len(points),
        threshold=float(np.mean(raw)),
        spread=_spread(raw),
        corrected=float(np.mean(corrected)) if corrected else None,
        corrected_spread=_spread(corrected),
        contact_begins=float(begins),
        open_ceases=float(ceases),
        euler_contact=float(np.mean([end.euler_contact[contact] for end in near])),
        euler_open=float(np.mean([end.euler_open[open_] for end in near])),
        perimeter=float(np.mean([end.perimeter for end in near])),
        largest_contact=float(np.mean([end.largest_contact for end in near])),
        largest_open=float(np.mean([end.largest_open for end in near])),
        constriction_gap=float(np.mean([t.gap for t in tight])) if tight else None,
        constriction_share=float(np.mean([t.share for t in tight])) if tight else None,
    )


def _spread(values: list[float]) -> float | None:
    """Standard deviation of one seed; one seed has none."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else None
