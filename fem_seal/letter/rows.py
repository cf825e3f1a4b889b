"""Tables of the letter's Fig. 3 and of the errors of its leak rates."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from fem_seal.errors import present
from fem_seal.letter.flow_points import FlowPoint, GridPoint
from fem_seal.letter.persson_curve import PerssonPoint
from fem_seal.letter.surfaces import CONTACT_MODULUS, SLOPE
from fem_seal.theory.bruggeman import ELASTIC_THRESHOLD, effective_dimension


@dataclass(frozen=True)
class CurrentRow:
    """Leak rates of a contact over that of its surface at first contact.

    Attributes
    ----------
    model : str
        Contact model.
    seed : int
        Seed of the surface.
    area, area_corrected : float
        A/A0, counted in samples and corrected for the perimeter.
    state : "leaking" or "sealed"
        State of the contact.
    lower, value, upper : float
        Certified bounds by finite elements, and their geometric mean.
    harmonic, linear_gap, arithmetic : float or None
        Finite differences by link rule; None if they were left out.
    bruggeman : float
        Effective medium of Bruggeman with the same gaps, in dimension 2.
    modified, modified_measured : float or None
        The same in the effective dimension n_eff of the letter, with A* = 0.42 and with the A* of
        this run; elastic contact only.
    unknowns : int
        Unknowns of the last mesh.
    """

    model: str
    seed: int
    area: float
    area_corrected: float
    state: str
    lower: float
    value: float
    upper: float
    harmonic: float | None
    linear_gap: float | None
    arithmetic: float | None
    bruggeman: float
    modified: float | None
    modified_measured: float | None
    unknowns: int


@dataclass(frozen=True)
class PerssonRow:
    """Persson's prediction for the spectrum of one surface.

    Attributes
    ----------
    law : str
        Law of the contact area, a name in `theory.persson.AREA_LAWS`.
    seed : int
        Surface.
    load : float
        Mean pressure over E* h'rms.
    area : float
        A/A0 of the continuum, to be compared with the corrected area.
    current : float
        Leak rate over the certified one of the same surface at first contact.
    """

    law: str
    seed: int
    load: float
    area: float
    current: float


@dataclass(frozen=True)
class TheoryRow:
    """An elastic contact beside Persson's theory.

    Attributes
    ----------
    law : str
        Law of the contact area.
    seed : int
        Surface.
    load : float
        Mean pressure over E* h'rms.
    area, area_corrected : float
        A/A0, counted in samples and corrected for the perimeter.
    kappa, kappa_corrected : float
        κ = (A/A0) / load of either area.
    theory_area : float
        A/A0 of the theory under the same load.
    at_area, at_load : float
        Leak rate of the theory over the certified one, at the corrected area and under the same
        load; 0 where the theory is sealed.
    """

    law: str
    seed: int
    load: float
    area: float
    area_corrected: float
    kappa: float
    kappa_corrected: float
    theory_area: float
    at_area: float
    at_load: float


@dataclass(frozen=True)
class ErrorRow:
    """Errors of one elastic contact's leak rate.

    Attributes
    ----------
    seed : int
        Surface.
    area, area_finest, corrected, corrected_finest : float
        A/A0, counted and corrected, on the coarsest and the finest grid.
    flow : float
        Relative half-width of the bracket.
    contact_grid : float or None
        |ln| of the ratio of the leak rates on the finest and the coarsest grid; None if one of
        them is sealed.
    last_change : float or None
        The same on the two finest grids.
    finest_factor : int
        Refinement of the finest grid.
    current, current_finest : float
        Leak rates over the leak rate at first contact.
    """

    seed: int
    area: float
    flow: float
    contact_grid: float | None
    last_change: float | None
    finest_factor: int
    area_finest: float
    corrected: float
    corrected_finest: float
    current: float
    current_finest: float


def current_rows(points: Sequence[FlowPoint], threshold: float) -> list[CurrentRow]:
    """Divide the leak rates of points by the leak rate of their surface at first contact.

    Parameters
    ----------
    points : points of any models and seeds, with one at area 0 for each seed
    threshold : measured A*/A0 of elastic contact

    Returns
    -------
    list of CurrentRow, without the first contacts
    """
    first = first_contacts(points)
    return [_row(point, first[point.seed], threshold) for point in points if point.wanted > 0]


def first_contacts(points: Sequence[FlowPoint]) -> dict[int, float]:
    """Leak rate at first contact by seed [m^3/s]."""
    return {point.seed: point.value for point in points if point.wanted == 0}


def _row(point: FlowPoint, first: float, threshold: float) -> CurrentRow:
    elastic = point.model == "elastic"
    difference = point.finite_difference

    def over_first(links: str) -> float | None:
        return difference[links] / first if difference else None

    def modified(at: float) -> float | None:
        dimension = effective_dimension(point.area, at)
        return point.gaps.leak_rate(dimension) / first if elastic else None

    return CurrentRow(
        model=point.model,
        seed=point.seed,
        area=point.area,
        area_corrected=point.area_corrected,
        state=point.state,
        lower=point.lower / first,
        value=point.value / first,
        upper=point.upper / first,
        harmonic=over_first("harmonic"),
        linear_gap=over_first("linear-gap"),
        arithmetic=over_first("arithmetic"),
        bruggeman=point.gaps.leak_rate(2.0) / first,
        modified=modified(ELASTIC_THRESHOLD),
        modified_measured=modified(threshold),
        unknowns=point.unknowns,
    )


def persson_rows(
    law: str, seed: int, curve: Sequence[PerssonPoint], first: float
) -> list[PerssonRow]:
    """Divide Persson's leak rates by the leak rate of the surface at first contact."""
    return [PerssonRow(law, seed, p.load, p.area, p.leak_rate / first) for p in curve]


def theory_rows(points: Sequence[FlowPoint], curves: Sequence[PerssonRow]) -> list[TheoryRow]:
    """Compare the elastic contacts that leak with the curve of their surface, for each area law.

    Parameters
    ----------
    points : points of all models and seeds, with one at area 0 for each seed
    curves : Persson's prediction for each law and surface, with increasing loads
    """
    first = first_contacts(points)
    elastic = [point for point in points if point.model == "elastic" and point.wanted > 0]
    # A sealed contact has no leak rate to compare the theory with.
    pressed = [point for point in elastic if point.value > 0]
    rows = []
    for law in dict.fromkeys(row.law for row in curves):
        for point in pressed:
            curve = [row for row in curves if (row.law, row.seed) == (law, point.seed)]
            load = present(point.mean_pressure, "mean pressure") / (CONTACT_MODULUS * SLOPE)
            current = point.value / first[point.seed]
            areas, loads = [row.area for row in curve], [row.load for row in curve]
            currents = [row.current for row in curve]
            rows.append(
                TheoryRow(
                    law=law,
                    seed=point.seed,
                    load=load,
                    area=point.area,
                    area_corrected=point.area_corrected,
                    kappa=point.area / load,
                    kappa_corrected=point.area_corrected / load,
                    theory_area=float(np.interp(load, loads, areas)),
                    at_area=_between(point.area_corrected, areas, currents) / current,
                    at_load=_between(load, loads, currents) / current,
                )
            )
    return rows


def _between(x: float, xs: Sequence[float], currents: Sequence[float]) -> float:
    """Current at x, interpolated in its logarithm; 0 from the first sealed point on."""
    k = int(np.searchsorted(xs, x))
    if k >= len(xs) or currents[k] == 0:
        return 0.0
    leaking = [current for current in currents if current > 0]
    return float(np.exp(np.interp(x, xs[: len(leaking)], np.log(leaking))))


def total_decades(rows: Sequence[CurrentRow], area: float, corrected: bool = False) -> float | None:
    """log10 of the leak rate of the bearing model over that of the elastic one, mean over seeds.

    Parameters
    ----------
    rows : rows of both models
    area : counted A/A0 of the elastic contact
    corrected : whether the bearing contact has the corrected area of the elastic one, in place of
        the counted one; the area of a bearing contact needs no correction. Its leak rate is
        interpolated between points of Fig. 3

    Returns
    -------
    float; None if there is no elastic point at that area, or no bearing points on both sides
    """
    logs = []
    for row in rows:
        if row.model != "elastic" or abs(row.area - area) > 0.005 or row.value == 0:
            continue
        cuts = sorted(
            (r.area, np.log10(r.value))
            for r in rows
            if r.model == "bearing" and r.seed == row.seed and r.value > 0
        )
        at = row.area_corrected if corrected else row.area
        areas, currents = zip(*cuts, strict=True) if cuts else ((), ())
        if not cuts or not min(areas) <= at <= max(areas):
            return None
        logs.append(np.interp(at, areas, currents) - np.log10(row.value))
    return float(np.mean(logs)) if logs else None


def error_rows(points: Sequence[GridPoint], first: dict[int, float]) -> list[ErrorRow]:
    """Errors of flow and contact grid of each point."""
    return [_error_row(point, first[point.seed]) for point in points]


def _error_row(point: GridPoint, first: float) -> ErrorRow:
    return ErrorRow(
        seed=point.seed,
        area=point.areas[0],
        flow=point.flow_error,
        contact_grid=_finite(point.contact_grid_error),
        last_change=_finite(point.last_change),
        finest_factor=point.factors[-1],
        area_finest=point.areas[-1],
        corrected=point.corrected[0],
        corrected_finest=point.corrected[-1],
        current=point.values[0] / first,
        current_finest=point.values[-1] / first,
    )


def _finite(change: float) -> float | None:
    return change if np.isfinite(change) else None


@dataclass(frozen=True)
class Agreement:
    """Agreement of the methods over all compared points.

    Attributes
    ----------
    decades : float
        log10 of the largest over the smallest certified current.
    bands_overlap : int
        Number of points where the band of finite differences (harmonic to arithmetic links) and
        the certified bracket overlap.
    compared : int
        Number of points that were computed by both.
    bruggeman_bearing : float
        Largest factor between Bruggeman's current and the bracket, bearing model.
    modified_elastic, modified_measured_elastic : float
        The same for the modified medium, elastic contact.
    """

    decades: float
    bands_overlap: int
    compared: int
    bruggeman_bearing: float
    modified_elastic: float
    modified_measured_elastic: float


def agreement(rows: Sequence[CurrentRow], bearing: float, elastic: float) -> Agreement:
    """Compare the methods; the effective media only up to 0.8 of the threshold of each model."""
    leaking = [row for row in rows if row.value > 0]
    values = [row.value for row in leaking]
    banded = [
        (row, row.harmonic, row.arithmetic)
        for row in leaking
        if row.harmonic is not None and row.arithmetic is not None
    ]
    below = {"bearing": 0.8 * bearing, "elastic": 0.8 * elastic}
    open_ = [row for row in leaking if row.area <= below[row.model]]
    bearing_rows = [row for row in open_ if row.model == "bearing"]
    elastic_rows = [row for row in open_ if row.model == "elastic"]
    return Agreement(
        decades=float(np.log10(max(values) / min(values))),
        bands_overlap=sum(low <= r.upper and high >= r.lower for r, low, high in banded),
        compared=len(banded),
        bruggeman_bearing=_worst((row, row.bruggeman) for row in bearing_rows),
        modified_elastic=_worst((row, row.modified) for row in elastic_rows),
        modified_measured_elastic=_worst((row, row.modified_measured) for row in elastic_rows),
    )


def _worst(pairs: Iterable[tuple[CurrentRow, float | None]]) -> float:
    """Largest factor by which a current lies outside the bracket of its row, at least 1."""
    return max(
        (max(number / row.upper, row.lower / number, 1.0) for row, number in pairs if number),
        default=1.0,
    )
