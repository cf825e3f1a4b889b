"""Tables of the letter's Fig. 3 and of the errors of its leak rates."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from fem_seal.letter.flow_points import FlowPoint, GridPoint
from fem_seal.letter.persson_curve import PerssonPoint
from fem_seal.theory.bruggeman import ELASTIC_THRESHOLD, effective_dimension


@dataclass(frozen=True)
class CurrentRow:
    """Leak rates of a contact over that of its surface at first contact.

    Attributes
    ----------
    model, seed : str
        Contact model and surface.
    area, area_corrected : float
        A/A0, counted in samples and corrected for the perimeter.
    state : "leaking" or "sealed"
        State of the contact.
    lower, value, upper : float
        Certified finite elements.
    harmonic, linear_gap, arithmetic : float
        Finite differences by link rule.
    bruggeman : float
        Bruggeman's medium of the same gaps in dimension 2.
    modified, modified_measured : float or None
        The same in the letter's n_eff, with A* = 0.42 and with the A* of this run; elastic
        contact only.
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
    harmonic: float
    linear_gap: float
    arithmetic: float
    bruggeman: float
    modified: float | None
    modified_measured: float | None
    unknowns: int


@dataclass(frozen=True)
class PerssonRow:
    """Persson's prediction.

    Attributes
    ----------
    area : float
        A/A0.
    current : float
        Leak rate over the mean leak rate at first contact.
    """

    area: float
    current: float


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
    points : of any models and seeds, with one at area 0 for each seed
    threshold : measured A*/A0 of elastic contact

    Returns
    -------
    list of CurrentRow, first contacts left out
    """
    first = first_contacts(points)
    return [_row(point, first[point.seed], threshold) for point in points if point.wanted > 0]


def first_contacts(points: Sequence[FlowPoint]) -> dict[int, float]:
    """Leak rate at first contact by seed [m^3/s]."""
    return {point.seed: point.value for point in points if point.wanted == 0}


def _row(point: FlowPoint, first: float, threshold: float) -> CurrentRow:
    elastic = point.model == "elastic"
    difference = point.finite_difference

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
        harmonic=difference["harmonic"] / first,
        linear_gap=difference["linear-gap"] / first,
        arithmetic=difference["arithmetic"] / first,
        bruggeman=point.gaps.leak_rate(2.0) / first,
        modified=modified(ELASTIC_THRESHOLD),
        modified_measured=modified(threshold),
        unknowns=point.unknowns,
    )


def persson_rows(curve: Sequence[PerssonPoint], first: dict[int, float]) -> list[PerssonRow]:
    """Divide Persson's leak rates by the mean leak rate at first contact over seeds."""
    mean = float(np.mean(list(first.values())))
    return [PerssonRow(point.area, point.leak_rate / mean) for point in curve]


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
        Number of points.
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
    """Compare the methods; effective media up to 0.8 of the thresholds of both models."""
    leaking = [row for row in rows if row.value > 0]
    values = [row.value for row in leaking]
    below = {"bearing": 0.8 * bearing, "elastic": 0.8 * elastic}
    open_ = [row for row in leaking if row.area <= below[row.model]]
    bearing_rows = [row for row in open_ if row.model == "bearing"]
    elastic_rows = [row for row in open_ if row.model == "elastic"]
    return Agreement(
        decades=float(np.log10(max(values) / min(values))),
        bands_overlap=sum(r.harmonic <= r.upper and r.arithmetic >= r.lower for r in leaking),
        compared=len(leaking),
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
