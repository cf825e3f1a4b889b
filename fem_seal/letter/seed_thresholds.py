"""Percolation thresholds of one surface under one model."""

from dataclasses import dataclass
from time import process_time

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.letter.bisection import ThresholdBracket, crossings
from fem_seal.letter.constriction import ConstrictionShare, constriction_share
from fem_seal.letter.spanning import PAIRS, Criterion, Snapshot, criteria_of
from fem_seal.letter.surfaces import MODELS, PITCH, Model, RoughCase
from fem_seal.memory import peak_memory
from fem_seal.progress import Report, silent
from fem_seal.registry import choose

# The pair of connectivities by which the flow solver decides whether a gap leaks.
REFERENCE = "triangulation"
# Factor by which a load is lowered if the contact computed anew is sealed within its tolerance.
LESS_LOAD = 0.998


@dataclass(frozen=True)
class Search:
    """Settings of the search for thresholds.

    Parameters
    ----------
    resolution : float
        Width of the brackets in A/A0.
    edges : tuple[str, ...]
        Kinds of edges, names in `spanning.EDGES`.
    flow : bool
        Whether to solve the flow through the last open contact, for its constriction.
    """

    resolution: float = 0.002
    edges: tuple[str, ...] = ("open", "periodic")
    flow: bool = True

    def __post_init__(self) -> None:
        if not 0 < self.resolution < 1:
            raise InvalidInput(f"resolution of A/A0 must lie in (0, 1), got {self.resolution}")
        if not self.edges:
            raise InvalidInput("name at least one kind of edges")
        criteria_of(self.edges)


@dataclass(frozen=True)
class SeedThresholds:
    """Thresholds of one surface under one model.

    Attributes
    ----------
    case, model, seed : RoughCase
        Ensemble, contact model and surface.
    search : Search
        Settings of the search.
    brackets : tuple[ThresholdBracket, ...]
        Brackets of every criterion.
    constriction : ConstrictionShare or None
        Constriction of the last computed contact that leaks between side walls, if
        `search.flow`.
    seconds : float
        CPU time of the search [s].
    peak_memory_bytes : int
        Largest memory of the process.
    """

    case: RoughCase
    model: str
    seed: int
    search: Search
    brackets: tuple[ThresholdBracket, ...]
    constriction: ConstrictionShare | None
    seconds: float
    peak_memory_bytes: int

    def of(self, pair: str, edges: str, corrected: bool = False) -> float:
        """A*/A0 of a pair: mean of the areas where contact begins and where open ceases to span.

        Parameters
        ----------
        pair : one of `spanning.PAIRS`
        edges : one of `search.edges`
        corrected : whether the perimeter correction of the area is applied
        """
        return float(np.mean([_area(b, corrected) for b in self._pair(pair, edges)]))

    def between(self, pair: str, edges: str) -> tuple[float, float]:
        """A/A0 where contact begins to span and where open ceases to."""
        contact, open_ = self._pair(pair, edges)
        return _area(contact, False), _area(open_, False)

    def at_threshold(self, edges: str) -> Snapshot:
        """Snapshot of the reference pair's brackets that lies nearest to A*."""
        threshold = self.of(REFERENCE, edges)
        ends = [end for b in self._pair(REFERENCE, edges) for end in (b.before, b.after)]
        return min(ends, key=lambda end: abs(end.area - threshold))

    def _pair(self, pair: str, edges: str) -> tuple[ThresholdBracket, ThresholdBracket]:
        contact, open_ = choose(PAIRS, pair, "pair")
        of = {bracket.criterion: bracket for bracket in self.brackets}
        return of[Criterion("contact", contact, edges)], of[Criterion("open", open_, edges)]


def _area(bracket: ThresholdBracket, corrected: bool) -> float:
    name = "area_corrected" if corrected else "area"
    return 0.5 * (getattr(bracket.before, name) + getattr(bracket.after, name))


def seed_thresholds(
    case: RoughCase,
    model: str,
    seed: int,
    search: Search,
    *,
    threads: int = 1,
    report: Report = silent,
) -> SeedThresholds:
    """Compute the thresholds of one surface under one model.

    Parameters
    ----------
    case, seed : the surface
    model : "bearing" or "elastic"
    search : settings
    threads : threads of an elastic contact
    report : called with each contact

    Raises
    ------
    InvalidInput
        For an unknown model.
    NotConverged
        If a contact or a flow does not converge.
    """
    start = process_time()
    pressing = choose(MODELS, model, "model")
    surface = case.surface(seed)
    brackets = crossings(
        surface,
        pressing,
        criteria_of(search.edges),
        search.resolution,
        threads=threads,
        progress=lambda text: report("contact", text),
    )
    constriction = None
    if search.flow and "open" in search.edges:
        report("flow through the last open contact", "")
        sealing = Criterion("open", "triangulation", "open")
        last = next(b.before.load for b in brackets if b.criterion == sealing)
        gap = _last_open(surface, pressing, last, threads)
        # A disc with the radius of the shortest wavelength contains one constriction; a radius of
        # two samples makes sure that it contains a triangle.
        constriction = constriction_share(gap, max(case.short, 2) * PITCH)
    return SeedThresholds(
        case=case,
        model=model,
        seed=seed,
        search=search,
        brackets=tuple(brackets),
        constriction=constriction,
        seconds=process_time() - start,
        peak_memory_bytes=peak_memory(),
    )


def _last_open(surface: GridField, pressing: Model, load: float, threads: int) -> GridField:
    """Gap that leaks under a load, lowered if the contact without a start seals by a sample."""
    while True:
        gap = pressing.press(surface, load, None, threads).gap
        if not GridFilm(gap).sealed:
            return gap
        load *= LESS_LOAD
