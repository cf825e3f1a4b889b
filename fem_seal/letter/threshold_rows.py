"""Thresholds of an ensemble: means over its seeds."""

from dataclasses import dataclass

import numpy as np

from fem_seal.letter.seed_thresholds import SeedThresholds
from fem_seal.letter.spanning import PAIRS


@dataclass(frozen=True)
class ThresholdRow:
    """Thresholds of an ensemble: means over seeds, and standard deviations as spreads.

    Attributes
    ----------
    n, hurst, short, long, model : int, float, float, float, str
        The ensemble.
    pair, edges : str
        Definition of spanning.
    seeds : int
        Number of surfaces.
    threshold, spread : float
        Mean and standard deviation of A*/A0.
    corrected, corrected_spread : float or None
        The same after the perimeter correction; elastic contact only.
    contact_begins, open_ceases : float
        A/A0 where contact begins and where open ceases to span; A* is their mean.
    half_width : float
        Half the distance of these two areas, mean over seeds. Between them both phases span, or
        neither does.
    euler_contact, euler_open, perimeter, largest_contact, largest_open : float
        Measures of the contact nearest to A*, as in `Snapshot`.
    constriction_gap : float or None
        Gap of the constriction [m].
    constriction_share : float or None
        Share of the dissipation around the constriction.
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
    half_width: float
    euler_contact: float
    euler_open: float
    perimeter: float
    largest_contact: float
    largest_open: float
    constriction_gap: float | None
    constriction_share: float | None


def threshold_rows(points: list[SeedThresholds]) -> list[ThresholdRow]:
    """One row for each pair of connectivities and kind of edges, from the seeds of one ensemble."""
    first = points[0]
    return [_row(points, pair, edges) for edges in first.search.edges for pair in PAIRS]


def _row(points: list[SeedThresholds], pair: str, edges: str) -> ThresholdRow:
    case = points[0].case
    raw = [point.of(pair, edges) for point in points]
    # In elastic contact a pixel that carries any pressure counts as contact, which makes the area
    # too large. Counting the samples above a cut has no such bias.
    elastic = points[0].model == "elastic"
    corrected = [point.of(pair, edges, corrected=True) for point in points if elastic]
    events = np.array([point.between(pair, edges) for point in points])
    begins, ceases = events.mean(axis=0)
    contact, open_ = PAIRS[pair]
    snapshots = [point.at_threshold(edges) for point in points]
    constrictions = [point.constriction for point in points if point.constriction]
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
        corrected=_mean(corrected),
        corrected_spread=_spread(corrected),
        contact_begins=float(begins),
        open_ceases=float(ceases),
        half_width=float(np.mean(np.abs(events[:, 1] - events[:, 0]))) / 2,
        euler_contact=float(np.mean([end.euler_contact[contact] for end in snapshots])),
        euler_open=float(np.mean([end.euler_open[open_] for end in snapshots])),
        perimeter=float(np.mean([end.perimeter for end in snapshots])),
        largest_contact=float(np.mean([end.largest_contact for end in snapshots])),
        largest_open=float(np.mean([end.largest_open for end in snapshots])),
        constriction_gap=_mean([constriction.gap for constriction in constrictions]),
        constriction_share=_mean([constriction.share for constriction in constrictions]),
    )


@dataclass(frozen=True)
class DifferenceRow:
    """Decrease of the threshold by elastic deformation, for the same surfaces.

    Attributes
    ----------
    n, hurst, short, long : int, float, float, float
        The ensemble.
    pair, edges : str
        Definition of spanning, the same for both models.
    seeds : int
        Number of surfaces.
    difference, spread : float, float or None
        Mean and standard deviation of A*/A0 of the bearing model less that of the elastic one.
    """

    n: int
    hurst: float
    short: float
    long: float
    pair: str
    edges: str
    seeds: int
    difference: float
    spread: float | None


def difference_rows(points: list[SeedThresholds]) -> list[DifferenceRow]:
    """One row for each ensemble, edges and pair, from the surfaces computed in both models."""
    of = {(point.case, point.model, point.seed): point for point in points}
    rows = []
    for case in dict.fromkeys(point.case for point in points):
        seeds = sorted({point.seed for point in points if point.case == case})
        both = [
            (of[case, "bearing", seed], of[case, "elastic", seed])
            for seed in seeds
            if (case, "bearing", seed) in of and (case, "elastic", seed) in of
        ]
        for edges in both[0][0].search.edges if both else ():
            for pair in PAIRS:
                values = [cut.of(pair, edges) - pressed.of(pair, edges) for cut, pressed in both]
                rows.append(
                    DifferenceRow(
                        n=case.n,
                        hurst=case.hurst,
                        short=case.short,
                        long=case.long * case.n,
                        pair=pair,
                        edges=edges,
                        seeds=len(both),
                        difference=float(np.mean(values)),
                        spread=_spread(values),
                    )
                )
    return rows


def _mean(values: list[float]) -> float | None:
    return float(np.mean(values)) if values else None


def _spread(values: list[float]) -> float | None:
    """Standard deviation over seeds; None for a single seed."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else None
