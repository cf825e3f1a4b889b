"""Every method on the same gap over ever finer grids: sign, size and order of each error.

A row is one method on one grid. Linear elements give three rows: both bounds and their geometric
mean. Finite differences give a number; its change from the grid before is taken as its error band.
The reference does not depend on finite differences: it is the exact leak rate where that is known,
otherwise the narrowest guaranteed bracket of the same gap.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from math import log2, prod
from pathlib import Path
from typing import Any

from fem_seal.arguments import choose
from fem_seal.errors import InvalidInput
from fem_seal.files import digest_of_sources
from fem_seal.film import GridFilm
from fem_seal.flow_settings import FlowSettings
from fem_seal.leak_rate import Bounded, middle_of, relative_half_width
from fem_seal.points import StudyTask, Work, points_of
from fem_seal.progress import Report, silent
from fem_seal.verification.exact_cases import ExactCase, finer_film
from fem_seal.verification.methods import METHODS, Answer

SMOOTH_ORDER = 2.0  # order in the energy of linear elements and of central differences
EXACT = 1e-7  # smaller relative errors count as none: CG stops at 1e-8 of the energy
# The correction of a bound is right to the root of that, and smaller than the half-width.
OF_CORRECTION = 1e-4


@dataclass(frozen=True)
class Row:
    """A leak rate by one method on one grid, compared with the reference."""

    method: str  #: name of the method, for linear elements with the bound: "FE upper"
    squares: int = field(metadata={"header": "grid"})  #: squares of the grid along the flow
    unknowns: int  #: unknowns of the solve
    value: float = field(metadata={"header": "Q [m^3/s]"})  #: leak rate [m^3/s]
    error: float = field(metadata={"header": "error/Q"})  #: error relative to the reference
    #: relative error that the method itself claims: half-width of its bracket, or change from the
    #: coarser grid. None on the first grid of a method without bounds
    band: float | None = field(metadata={"header": "band/Q"})
    #: order of convergence in the spacing, observed and by theory. None where the error is below
    #: the half-width of the reference, or where theory gives no simple order
    order: float | None
    expected: float | None
    #: claimed error over true error, at least; None for bounds
    effectivity: float | None
    #: from the reference, in units of the sum of both errors; None for bounds
    distance: float | None
    verdict: str  #: comparison with the reference: "bound", "no answer", or as of `judge`
    seconds: float  #: CPU time [s]
    reference: float  #: leak rate with which the value is compared [m^3/s]
    reason: str = ""  #: sentence on why there is no answer; empty if there is one
    gap: str = ""  #: the fields of the scene that tell this gap from others of the study


Series = dict[str, dict[int, Answer]]  # by method, and by squares of the grid along the flow


@dataclass(frozen=True, eq=False)
class StudiedGap:
    """A gap on ever finer grids, the fluid in it, and what is known of its leak rate."""

    settings: FlowSettings
    #: by squares of each grid along the flow, twice those of the grid before: films, and how many
    #: times their spacing is halved
    grids: dict[int, tuple[tuple[GridFilm, ...], int]]
    exact: float | None = None  #: leak rate; None: the narrowest bracket is the reference
    order: float | None = SMOOTH_ORDER  #: expected of each bound

    def __post_init__(self) -> None:
        if any(film.sealed for films, _ in self.grids.values() for film in films):
            raise InvalidInput("a gap is sealed: every method says 0, there is nothing to compare")

    @classmethod
    def of_film(cls, film: GridFilm, settings: FlowSettings, grids: int = 3) -> "StudiedGap":
        """A film that leaks; each further grid halves the spacing of the same gap."""
        first = film.gap.shape[0]
        return cls(settings, {first * 2**times: ((film,), times) for times in range(grids)})

    @classmethod
    def of_case(cls, case: ExactCase, squares: Sequence[int]) -> "StudiedGap":
        """A case whose leak rate is known, sampled anew on each grid."""
        grids = {n: (case.films(n), 0) for n in squares}
        return cls(FlowSettings(1 / 12, 1.0, rtol=0.01), grids, case.exact, case.order)


def compare(
    gaps: Sequence[StudiedGap],
    methods: Sequence[str] = tuple(METHODS),
    *,
    out: Path | None = None,
    work: Work | None = None,
    report: Report = silent,
) -> list[tuple[tuple[Row, ...], Bounded]] | None:
    """Compare every method with the exact leak rate of a gap, or with its guaranteed bracket.

    Beside an exact leak rate the verdict is "high", "low" or "exact". The bounds hold for the
    sampled gap: on a coarse grid both may lie on one side of the exact leak rate.

    The methods are names in `METHODS`; without an exact leak rate "uniform" or "adaptive" must be
    among them. Each method on each grid is a point of the study (`points_of`).

    Returns the rows of each gap by method and grid, and their reference; None if some points are
    left to other parts of the study.
    """
    if not {"uniform", "adaptive"}.intersection(methods) and any(gap.exact is None for gap in gaps):
        raise InvalidInput("without an exact leak rate, methods must hold 'uniform' or 'adaptive'")
    tasks = [_tasks(gap, methods) for gap in gaps]
    every = [task for of_gap in tasks for _, task in of_gap]
    points = points_of(every, Answer, out, work, report)
    if points is None:
        return None
    answers, compared = iter(points), []
    for gap, of_gap in zip(gaps, tasks, strict=True):
        series: Series = {}
        for n, _ in of_gap:
            answer = next(answers)
            series.setdefault(answer.method, {})[n] = answer
        exact = gap.exact
        reference = _bracket(series) if exact is None else Bounded(exact, exact, exact)
        compared.append((tuple(_rows_of_gap(gap, series, reference)), reference))
    return compared


def _tasks(gap: StudiedGap, methods: Sequence[str]) -> list[tuple[int, StudyTask[Answer]]]:
    """Tasks of a gap by grid and method, each with the squares of the grid."""
    # The adaptive method refines on its own: one run is enough, of the finest samples.
    once = min(gap.grids) if gap.exact is None else max(gap.grids)
    return [
        (n, _task(films, gap.settings, times, method))
        for n, (films, times) in gap.grids.items()
        for method in methods
        if method != "adaptive" or n == once
    ]


def _bracket(series: Series) -> Bounded:
    """The narrowest guaranteed bracket of all methods and grids."""
    answers = [answer for on_grids in series.values() for answer in on_grids.values()]
    lower = max(answer.lower for answer in answers if answer.lower is not None)
    upper = min(answer.upper for answer in answers if answer.upper is not None)
    return Bounded(middle_of(lower, upper), lower, upper)


def _task(
    films: tuple[GridFilm, ...], settings: FlowSettings, times: int, method: str
) -> StudyTask[Answer]:
    """Task of one method on films whose spacing is halved a number of times."""
    choose(METHODS, method, "method")
    inputs = sha256(repr((settings, times, method, digest_of_sources())).encode())
    for film in films:
        gap = film.gap
        read = film.sides, film.representation, gap.shape, gap.spacing, gap.periodic
        inputs.update(repr(read).encode())
        inputs.update(gap.values.tobytes())
    squares = films[0].gap.shape[0] * 2**times
    return StudyTask(
        f"{method}-{squares}-{inputs.hexdigest()[:24]}",
        f"grid {squares}, {method}",
        answer_on,
        (films, settings, times, method),
    )


def answer_on(films: Sequence[GridFilm], settings: FlowSettings, times: int, method: str) -> Answer:
    """Answer of a method; for several films geometric means (that of bounds is a bound)."""
    answers = [METHODS[method](finer_film(film, times), settings) for film in films]

    def mean(name: str) -> Any:
        """Geometric mean of a number of all films, None if they have none."""
        numbers = [getattr(answer, name) for answer in answers]
        return None if None in numbers else prod(numbers) ** (1 / len(numbers))

    return Answer(
        answers[0].method,
        mean("value"),
        mean("lower"),
        mean("upper"),
        max(answer.unknowns for answer in answers),
        sum(answer.seconds for answer in answers),
        next((answer.reason for answer in answers if answer.reason), ""),
    )


def _rows_of_gap(gap: StudiedGap, series: Series, reference: Bounded) -> Iterator[Row]:
    """Rows of each method over the grids; bounds have rows of their own before their mean."""
    doubt = relative_half_width(reference.lower, reference.upper)
    for method, on_grids in series.items():
        bounded = all(answer.lower is not None for answer in on_grids.values())
        ends = {"upper": " upper", "lower": " lower", "value": " √(lo·hi)"}
        for end, words in ends.items() if bounded else [("value", "")]:
            coarse: float | None = None  # leak rate on the grid before, if there is one
            for n, answer in on_grids.items():
                value, rounding = getattr(answer, end), EXACT
                error = value / reference.value - 1
                band: float | None = None
                if answer.lower is not None and answer.upper is not None:
                    band = relative_half_width(answer.lower, answer.upper)
                    rounding = max(EXACT, OF_CORRECTION * band)
                elif coarse is not None and not answer.reason:
                    band = abs(value - coarse) / value
                true, unsure = abs(error) + doubt, max(doubt, rounding)
                claimed = None if band is None or end != "value" else band * (1 + error)
                if answer.reason:
                    verdict = "no answer"
                elif gap.exact is not None:
                    verdict = _side(error, rounding)
                else:
                    verdict = judge(value, band, reference) if end == "value" else "bound"
                yield Row(
                    method=f"{method}{words}",
                    squares=n,
                    unknowns=answer.unknowns,
                    value=value,
                    error=error,
                    band=band,
                    order=coarse and _observed(coarse / reference.value - 1, error, unsure),
                    expected=None if method == "adaptive" else gap.order,
                    effectivity=claimed / true if claimed is not None and true > rounding else None,
                    distance=None if claimed is None else error / max(claimed + doubt, EXACT),
                    verdict=verdict,
                    seconds=answer.seconds,
                    reference=reference.value,
                    reason=answer.reason,
                )
                coarse = None if answer.reason else value


def _observed(coarse: float, fine: float, unsure: float) -> float | None:
    """Order of convergence from the errors on a grid and on one of half the spacing."""
    if min(abs(coarse), abs(fine)) <= unsure:
        return None
    return log2(abs(coarse / fine))


def judge(value: float, band: float | None, reference: Bounded) -> str:
    """Compare a number and its error band with the guaranteed bracket.

    "inside" the bracket; "agrees" if band and bracket overlap; "disagrees" if they do not: the
    method then underestimates its error; "outside" if the number lies outside the bracket and has
    no band, as the first of a series.
    """
    rounding = EXACT * reference.value
    if reference.lower - rounding <= value <= reference.upper + rounding:
        return "inside"
    if band is None:
        return "outside"
    overlap = value * (1 - band) <= reference.upper and reference.lower <= value * (1 + band)
    return "agrees" if overlap else "disagrees"


def _side(error: float, rounding: float) -> str:
    if abs(error) <= rounding:
        return "exact"
    return "high" if error > 0 else "low"
