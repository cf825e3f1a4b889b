"""Percolation thresholds of bearing and elastic contact over seeds, sizes and cut-offs."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.memory import peak_memory
from fem_seal.progress import Report, silent
from fem_seal.study.letter.bisection import Bracket, crossings
from fem_seal.study.letter.constriction import ConstrictionShare, constriction_share
from fem_seal.study.letter.spanning import PAIRS, Criterion, Snapshot, criteria_of
from fem_seal.study.letter.store import PointStore, write_json, write_table
from fem_seal.study.letter.surfaces import MODELS, PITCH, Model, RoughCase
from fem_seal.topology.lattice import choose
from fem_seal.topology.percolation import is_sealed

# Of all pairs the one whose geometry the flow solver has, too.
REFERENCE = "triangulation"
# Step back from a load at which the last constriction is a matter of the contact's tolerance.
LESS_LOAD = 0.998
JSON_FILE, TABLE_FILE = "percolation.json", "percolation.csv"


@dataclass(frozen=True)
class Search:
    """How thresholds are looked for.

    resolution : width of the brackets in A/A0
    edges : names out of `spanning.EDGES`
    flow : whether the flow through the last open contact is solved for its constriction
    """

    resolution: float = 0.002
    edges: tuple[str, ...] = ("open", "periodic")
    flow: bool = True

    def __post_init__(self):
        if not 0 < self.resolution < 1:
            raise InvalidInput(f"resolution of A/A0 must lie in (0, 1), got {self.resolution}")
        if not self.edges:
            raise InvalidInput("name at least one kind of edges")
        criteria_of(self.edges)


@dataclass(frozen=True)
class SeedThresholds:
    """Thresholds of one surface under one model.

    brackets : of every criterion
    constriction : of the last contact seen that leaks between side walls, if it was asked for
    """

    case: RoughCase
    model: str
    seed: int
    search: Search
    brackets: tuple[Bracket, ...]
    constriction: ConstrictionShare | None
    seconds: float
    peak_memory_bytes: int

    def of(self, pair: str, edges: str, corrected: bool = False) -> float:
        """A*/A0 of a pair of connectivities: mean of where the two phases change over.

        Parameters
        ----------
        pair : one of `spanning.PAIRS`
        edges : one that was searched
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

    def _pair(self, pair: str, edges: str) -> tuple[Bracket, Bracket]:
        contact, open_ = choose(PAIRS, pair, "pair")
        found = {bracket.criterion: bracket for bracket in self.brackets}
        return found[Criterion("contact", contact, edges)], found[Criterion("open", open_, edges)]


def _area(bracket: Bracket, corrected: bool) -> float:
    name = "area_corrected" if corrected else "area"
    return 0.5 * (getattr(bracket.before, name) + getattr(bracket.after, name))


@dataclass(frozen=True)
class ThresholdRow:
    """Thresholds of an ensemble: means over seeds; spreads are standard deviations of one seed.

    n .. model : the ensemble; pair, edges : what spanning means
    threshold, spread : A*/A0
    corrected, corrected_spread : after the perimeter correction; elastic contact only
    contact_begins, open_ceases : the two areas whose mean A* is
    euler_contact, euler_open : at the contact nearest to A*, on the torus
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
    largest_contact: float
    largest_open: float
    constriction_gap: float | None
    constriction_share: float | None


@dataclass(frozen=True)
class Study:
    """All thresholds of a run and what they amount to."""

    rows: list[ThresholdRow]
    seeds: list[SeedThresholds] = field(default_factory=list)


def seed_thresholds(
    case: RoughCase,
    model: str,
    seed: int,
    search: Search,
    *,
    threads: int = 1,
    report: Report = silent,
) -> SeedThresholds:
    """Find the thresholds of one surface.

    Parameters
    ----------
    case, seed : the surface
    model : "bearing" or "elastic"
    search : how to look
    threads : of the FFTs
    report : told of each contact

    Raises
    ------
    InvalidInput
        For an unknown model.
    NotConverged
        If a contact or a flow does not converge.
    """
    start = perf_counter()
    pressing = choose(MODELS, model, "model")
    surface = case.surface(seed)
    stage = f"{model} {case.name} seed {seed}"
    brackets = crossings(
        surface,
        pressing,
        criteria_of(search.edges),
        search.resolution,
        threads=threads,
        news=lambda text: report(stage, text),
    )
    constriction = None
    if search.flow and "open" in search.edges:
        report(stage, "flow through the last open contact")
        sealing = Criterion("open", "triangulation", "open")
        last = next(b.before.load for b in brackets if b.criterion == sealing)
        gap = _last_open(surface, pressing, last, threads)
        # A wavelength has one constriction; two samples at least, to hold a triangle.
        constriction = constriction_share(gap, max(case.short, 2) * PITCH)
    return SeedThresholds(
        case=case,
        model=model,
        seed=seed,
        search=search,
        brackets=tuple(brackets),
        constriction=constriction,
        seconds=perf_counter() - start,
        peak_memory_bytes=peak_memory(),
    )


def _last_open(surface: GridField, pressing: Model, load: float, threads: int) -> GridField:
    """Gap under a load seen open; a little less where a cold start seals it by a sample."""
    while True:
        gap = pressing.press(surface, load, None, threads).gap
        if not is_sealed(gap, "wall", "linear"):
            return gap
        load *= LESS_LOAD


def percolation(
    cases: Sequence[RoughCase],
    seeds: Sequence[int],
    out: Path,
    *,
    models: Sequence[str] = ("bearing", "elastic"),
    search: Search | None = None,
    threads: int = 1,
    report: Report = silent,
) -> Study:
    """Thresholds of many ensembles; surfaces that the folder holds already are not done again.

    Parameters
    ----------
    cases, seeds, models : all combinations are computed
    out : folder of percolation.json, percolation.csv and a file for each surface in points/
    search, threads, report : as in `seed_thresholds`

    Returns
    -------
    Study

    Raises
    ------
    InvalidInput
        If the folder holds other settings or cannot be written.
    NotConverged
        If a contact does not converge.
    """
    search = search or Search()
    store = PointStore(out / "points", SeedThresholds)
    done, rows = [], []
    for case in cases:
        for model in models:
            points = [
                store.point(
                    f"threshold-{model}-{case.name}-seed{seed}",
                    lambda c=case, m=model, s=seed: seed_thresholds(
                        c, m, s, search, threads=threads, report=report
                    ),
                    lambda point, c=case: (point.case, point.search) == (c, search),
                )
                for seed in seeds
            ]
            done.extend(points)
            rows.extend(_rows(points))
    study = Study(rows, done)
    write_json(out / JSON_FILE, study)
    write_table(out / TABLE_FILE, rows)
    return study


def _rows(points: list[SeedThresholds]) -> list[ThresholdRow]:
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
        largest_contact=float(np.mean([end.largest_contact for end in near])),
        largest_open=float(np.mean([end.largest_open for end in near])),
        constriction_gap=float(np.mean([t.gap for t in tight])) if tight else None,
        constriction_share=float(np.mean([t.share for t in tight])) if tight else None,
    )


def _spread(values: list[float]) -> float | None:
    """Standard deviation of one seed; one seed has none."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else None
