"""Reproduction of the letter: thresholds, pictures, currents and their errors; runs can resume."""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TypeVar

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.letter import pictures, rows
from fem_seal.letter.cascade_start import CascadeStart, cascade_start
from fem_seal.letter.flow_points import FlowPoint, GridPoint, flow_point, grid_point
from fem_seal.letter.percolation import percolation, threshold_task
from fem_seal.letter.persson_curve import (
    LOADS,
    PerssonPoint,
    SampledSpectrum,
    persson_curve,
)
from fem_seal.letter.seed_thresholds import REFERENCE, Search, SeedThresholds
from fem_seal.letter.store import write_json, write_table
from fem_seal.letter.surfaces import MODELS, PressedSurface, RoughCase
from fem_seal.letter.threshold_rows import DifferenceRow, ThresholdRow
from fem_seal.memory import peak_memory
from fem_seal.parallel import Comm
from fem_seal.points import Chain, Outcome, RecordFolder, Work
from fem_seal.points.study import StudyTask, chain_of, compute_study
from fem_seal.progress import Report, silent
from fem_seal.theory.persson import AREA_LAWS

Point = TypeVar("Point")

# Contact areas of Fig. 3 beside first contact; the largest may be sealed for some surfaces.
AREAS = {
    "bearing": (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.45, 0.48),
    "elastic": (0.02, 0.05, 0.1, 0.2, 0.3, 0.35, 0.38, 0.4, 0.42),
}
# Contact areas at which the contact grid is refined, for the first seed.
REFINED_AREAS = (0.05, 0.1, 0.2, 0.3, 0.35, 0.4)
# Measures of the flow density by which the models are compared.
MEASURED = ("total", "body", "peak", "participation", "half")
# Contact area at which the start of the cascade is measured, beside first contact.
CASCADE_AREA = 0.2


@dataclass(frozen=True)
class Plan:
    """Settings of a run.

    Parameters
    ----------
    case : RoughCase
        Ensemble of surfaces.
    seeds : int
        Number of surfaces, of seeds 1, 2, ...
    rtol : float
        Largest relative width (upper - lower) / √(lower upper) of the certified leak rates.
    grid_factors : tuple[int, ...]
        Refinements of the contact grid; the first is 1.
    search : Search
        Search of the thresholds.
    areas : dict[str, tuple[float, ...]]
        Contact areas A/A0 for each model.
    refined : tuple[float, ...]
        Contact areas at which the contact grid is refined.
    cascade : bool
        Whether to measure the error of the cascade's start against the converged pressure.
    differences : bool
        Whether to compute the points of Fig. 3 by finite differences as well.
    loads : tuple[float, ...]
        Mean pressures of Persson's curve, in units of E* h'rms.
    threads : int
        Threads of an elastic contact; they change no result beyond its tolerance.
    """

    case: RoughCase
    seeds: int = 3
    rtol: float = 0.1
    grid_factors: tuple[int, ...] = (1, 2)
    search: Search = field(default_factory=Search)
    areas: dict[str, tuple[float, ...]] = field(default_factory=lambda: dict(AREAS))
    refined: tuple[float, ...] = REFINED_AREAS
    cascade: bool = True
    differences: bool = True
    loads: tuple[float, ...] = LOADS
    threads: int = 1

    def __post_init__(self) -> None:
        if self.seeds < 1:
            raise InvalidInput(f"the number of seeds must be at least 1, got {self.seeds}")
        if not 0 < self.rtol < 2:
            raise InvalidInput(f"rtol must lie in (0, 2), got {self.rtol}")
        for model in MODELS:
            areas = self.areas[model]
            # Effective media are compared up to 0.8 A*, which must hold a point.
            if not (0 < min(areas) <= 0.3 and max(areas) < 1):
                raise InvalidInput(
                    f"{model} areas must lie in (0, 1), the least at most at 0.3, got {areas}"
                )


@dataclass(frozen=True)
class Letter:
    """Content of letter.json: the letter's quantities as measured by this run.

    Attributes
    ----------
    plan : Plan
        Settings of the run.
    finished : datetime
        Time at which it ended.
    seconds_in_points : float
        CPU time of the thresholds and of the points of Fig. 3 [s].
    peak_memory_bytes : int
        Largest memory of a process.
    thresholds : list[ThresholdRow]
        Percolation thresholds.
    differences : list[DifferenceRow]
        Thresholds of the bearing model less those of the elastic one, for the same surfaces.
    flows : dict[str, pictures.FlowMeasures]
        Fig. 2 as numbers, by model.
    decades : dict[str, float]
        log10 of the flow density of the bearing model over that of the elastic one, by the name
        of the measure.
    total_decades, total_decades_corrected : float or None
        log10 of the leak rate of the bearing model over that of the elastic one at A/A0 = 0.2,
        mean over seeds; at equal counted area, and with the bearing contact at the corrected
        area of the elastic one.
    agreement : rows.Agreement
        Agreement of the methods.
    cascade : list[CascadeStart]
        Errors of the cascade's first guess; empty if the plan leaves them out.
    errors : list[rows.ErrorRow]
        Errors of flow and contact grid; empty if the plan leaves them out.
    theory : list[rows.TheoryRow]
        Area against load, and Persson's leak rates.
    """

    plan: Plan
    finished: datetime
    seconds_in_points: float
    peak_memory_bytes: int
    thresholds: list[ThresholdRow]
    differences: list[DifferenceRow]
    flows: dict[str, pictures.FlowMeasures]
    decades: dict[str, float]
    total_decades: float | None
    total_decades_corrected: float | None
    agreement: rows.Agreement
    cascade: list[CascadeStart]
    errors: list[rows.ErrorRow]
    theory: list[rows.TheoryRow]


@dataclass(frozen=True, eq=False)
class Figures:
    """Data of the figures.

    Attributes
    ----------
    contacts : dict[str, GridField]
        Gaps of Fig. 1.
    flows : dict[str, pictures.FlowPicture]
        Flows of Fig. 2.
    currents : list[rows.CurrentRow]
        Rows of Fig. 3.
    persson : list[rows.PerssonRow]
        Rows of Persson's prediction in Fig. 3.
    errors : list[rows.ErrorRow]
        Rows of the errors.
    """

    contacts: dict[str, GridField]
    flows: dict[str, pictures.FlowPicture]
    currents: list[rows.CurrentRow]
    persson: list[rows.PerssonRow]
    errors: list[rows.ErrorRow]


@dataclass(frozen=True)
class Points:
    """Chains of all points of a plan, by kind.

    The elastic points of Fig. 3 of one surface form a chain, in which each contact starts from the
    contacts before it; every other point is a chain of its own.

    Attributes
    ----------
    flows, refined, cascade : list of Chain
        Points of Fig. 3, the same on refined contact grids, and starts of the cascade.
    gaps, pictures : list of Chain
        Data of Figs. 1 and 2, one point for each model.
    thresholds : list of Chain
        Thresholds, one point for each model and seed.
    """

    flows: list[Chain[FlowPoint]]
    refined: list[Chain[GridPoint]]
    cascade: list[Chain[CascadeStart]]
    gaps: list[Chain[GridField]]
    pictures: list[Chain[pictures.FlowPicture]]
    thresholds: list[Chain[SeedThresholds]]

    @classmethod
    def of(cls, plan: Plan, out: Path) -> "Points":
        """Points of a plan, in the folder `out`."""
        gaps, flows = _pictures(plan, out)
        return cls(
            _flow_points(plan, out),
            _grid_points(plan, out),
            _cascade(plan, out) if plan.cascade else [],
            gaps,
            flows,
            _thresholds(plan, out),
        )

    @property
    def all(self) -> list[Chain]:
        """All chains, those that take longest first: several jobs then end together."""
        return [
            *self.flows,
            *self.thresholds,
            *self.gaps,
            *self.pictures,
            *self.refined,
            *self.cascade,
        ]


def compute_points_of(
    plan: Plan, out: Path, report: Report = silent, work: Work | None = None
) -> Outcome:
    """Compute the points of a plan that the folder lacks.

    Parameters
    ----------
    plan : settings
    out : folder of points/, with a file for each point, and of the data of Figs. 1 and 2
    report : called with each point
    work : how the points are shared among workers; one after the other if left out

    Raises
    ------
    InvalidInput
        If the folder holds points of other settings or cannot be written.
    NotConverged
        If a contact or a flow does not converge; the other points are computed all the same.
    """
    return compute_study(Points.of(plan, out).all, work, report)


def letter(
    plan: Plan, out: Path, report: Report = silent, work: Work | None = None
) -> tuple[Letter, Figures]:
    """Compute the points that the folder lacks, and gather all of them.

    Parameters
    ----------
    plan : settings
    out : folder of letter.json, the data of each figure, and points/ with a file for each point
    report, work : as of `compute_points_of`

    Returns
    -------
    Letter and the data of its figures.

    Raises
    ------
    InvalidInput
        If the folder holds points of other settings or cannot be written, or lacks points that
        are computed elsewhere.
    NotConverged
        If a contact or a flow does not converge; the other points are computed all the same.
    """
    outcome = compute_points_of(plan, out, report, work)
    if outcome.missing:
        raise InvalidInput(f"{outcome.missing} points of the letter in {out} are not computed yet")
    gather_only = Work(gather=True)
    study = percolation(
        [plan.case], range(1, plan.seeds + 1), out, search=plan.search, work=gather_only
    )
    thresholds = {model: _threshold(study.rows, plan, model) for model in MODELS}
    stored = Points.of(plan, out)
    contacts = dict(zip(MODELS, _read(stored.gaps), strict=True))
    flows = dict(zip(MODELS, _read(stored.pictures), strict=True))
    points, refined, cascade = _read(stored.flows), _read(stored.refined), _read(stored.cascade)
    first = rows.first_contacts(points)
    currents = rows.current_rows(points, thresholds["elastic"])
    persson = [
        row
        for law in AREA_LAWS
        for seed in first
        for row in rows.persson_rows(law, seed, _curve(plan, law, seed), first[seed])
    ]
    measures = {model: pictures.FlowMeasures.of(picture) for model, picture in flows.items()}
    figures = Figures(contacts, flows, currents, persson, rows.error_rows(refined, first))
    result = Letter(
        plan=plan,
        finished=datetime.now(UTC),
        seconds_in_points=sum(seed.seconds for seed in study.seeds)
        + sum(point.seconds for point in points),
        peak_memory_bytes=max(peak_memory(), *(p.peak_memory_bytes for p in points)),
        thresholds=study.rows,
        differences=study.differences,
        flows=measures,
        decades={name: pictures.decades(measures, name) for name in MEASURED},
        total_decades=rows.total_decades(currents, pictures.FLOW_AREA),
        total_decades_corrected=rows.total_decades(currents, pictures.FLOW_AREA, corrected=True),
        agreement=rows.agreement(currents, thresholds["bearing"], thresholds["elastic"]),
        cascade=cascade,
        errors=figures.errors,
        theory=rows.theory_rows(points, persson),
    )
    _write(result, figures, out)
    return result, figures


def _write(result: Letter, figures: Figures, out: Path) -> None:
    """Write letter.json and the tables of the figures."""
    write_table(out / "fig3.csv", figures.currents)
    write_table(out / "fig3-persson.csv", figures.persson)
    write_table(out / "theory.csv", result.theory)
    if figures.errors:
        write_table(out / "errors.csv", figures.errors)
    write_json(out / "letter.json", result)


def _curve(plan: Plan, law: str, seed: int) -> list[PerssonPoint]:
    """Persson's curve of one surface."""
    spectrum = SampledSpectrum.of(plan.case, plan.case.surface(seed))
    return persson_curve(spectrum, loads=plan.loads, area=law)


def _threshold(thresholds: list[ThresholdRow], plan: Plan, model: str) -> float:
    """A*/A0 of the reference pair with the first kind of edges."""
    key = (model, REFERENCE, plan.search.edges[0])
    return next(row.threshold for row in thresholds if (row.model, row.pair, row.edges) == key)


def _read(chains: list[Chain[Point]]) -> list[Point]:
    """Read the points of chains that have been computed."""
    return [
        chain.folder.load(chain.folder.path_of(task.name))
        for chain in chains
        for task in chain.tasks
    ]


def _thresholds(plan: Plan, out: Path) -> list[Chain[SeedThresholds]]:
    """Thresholds of each model and seed."""
    folder = RecordFolder(out / "points", SeedThresholds)
    return [
        chain_of(folder, threshold_task(plan.case, model, seed, plan.search, plan.threads))
        for model in MODELS
        for seed in range(1, plan.seeds + 1)
    ]


def _pictures(
    plan: Plan, out: Path
) -> tuple[list[Chain[GridField]], list[Chain[pictures.FlowPicture]]]:
    """Chains of the data of Figs. 1 and 2, one for each model; kept in .npz files."""
    case, threads = plan.case, plan.threads
    gaps, flows = pictures.GapFolder(out), pictures.FlowFolder(out)
    contact_chains, flow_chains = [], []
    for model in MODELS:
        name = f"{model}-{case.name}"
        contact: StudyTask[GridField] = StudyTask(
            f"fig1-{name}", f"Fig. 1 {model}", pictures.contact_picture_data, (case, model, threads)
        )
        flow: StudyTask[pictures.FlowPicture] = StudyTask(
            f"fig2-{name}",
            f"Fig. 2 {model}",
            pictures.flow_picture_data,
            (case, model, plan.rtol, threads),
        )
        contact_chains.append(chain_of(gaps, contact))
        flow_chains.append(chain_of(flows, flow))
    return contact_chains, flow_chains


def _flow_points(plan: Plan, out: Path) -> list[Chain[FlowPoint]]:
    """Points of Fig. 3; first contact is the same for both models and computed once."""
    folder = RecordFolder(out / "points", FlowPoint)
    case, rtol = plan.case, plan.rtol
    # Points with finite differences and points without them must not share a file.
    kind = "flow" if plan.differences else "certified"

    def task(model: str, seed: int, area: float) -> FlowTask:
        """One point of Fig. 3."""
        name = f"{kind}-{model}-{case.name}-seed{seed}-A{area:g}"
        return FlowTask(
            name,
            name,
            flow_point,
            (case, model, seed, area),
            {"rtol": rtol, "threads": plan.threads, "differences": plan.differences},
            {"case": case, "rtol": rtol},
        )

    seeds = range(1, plan.seeds + 1)
    elastic = [
        Chain(
            folder,
            tuple(task("elastic", seed, area) for area in (0.0, *sorted(plan.areas["elastic"]))),
            partial(PressedSurface, case, "elastic", seed, plan.threads),
        )
        for seed in seeds
    ]
    bearing = [
        Chain(
            folder,
            (task("bearing", seed, area),),
            partial(PressedSurface, case, "bearing", seed, plan.threads),
        )
        for seed in seeds
        for area in plan.areas["bearing"]
    ]
    return [*elastic, *bearing]


class FlowTask(StudyTask[FlowPoint]):
    """A point of Fig. 3; its contact starts from the contacts before it in its chain."""

    def compute(self, handed_on: PressedSurface, report: Report, comm: Comm) -> FlowPoint:
        """Press the surface and compute its leak rates."""
        report("contact and flow", "")
        return self.function(*self.arguments, **self.options, pressed=handed_on)


def _grid_points(plan: Plan, out: Path) -> list[Chain[GridPoint]]:
    """Leak rates on refined contact grids, for the first seed."""
    folder = RecordFolder(out / "points", GridPoint)
    case, rtol, factors = plan.case, plan.rtol, plan.grid_factors
    names = {area: f"grid-{case.name}-seed1-A{area:g}" for area in plan.refined}
    return [
        chain_of(
            folder,
            StudyTask(
                name,
                name,
                grid_point,
                (case, 1, area),
                {"rtol": rtol, "factors": factors, "threads": plan.threads},
                {"case": case, "rtol": rtol, "factors": factors},
            ),
        )
        for area, name in names.items()
    ]


def _cascade(plan: Plan, out: Path) -> list[Chain[CascadeStart]]:
    """Starts of the cascade, at first contact and for a contact of each model."""
    folder = RecordFolder(out / "points", CascadeStart)
    case = plan.case
    contacts = (("elastic", 0.0), *((model, CASCADE_AREA) for model in MODELS))
    names = {contact: f"cascade-{contact[0]}-{case.name}-A{contact[1]:g}" for contact in contacts}
    return [
        chain_of(
            folder,
            StudyTask(
                name, name, cascade_start, (case, model, area, plan.threads), {}, {"case": case}
            ),
        )
        for (model, area), name in names.items()
    ]
