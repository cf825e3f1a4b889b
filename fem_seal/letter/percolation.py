"""Percolation thresholds of bearing and elastic contact over seeds, sizes and cut-offs."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fem_seal.letter.seed_thresholds import Search, SeedThresholds, seed_thresholds
from fem_seal.letter.store import write_json, write_table
from fem_seal.letter.surfaces import MODELS, RoughCase
from fem_seal.letter.threshold_rows import (
    DifferenceRow,
    ThresholdRow,
    difference_rows,
    threshold_rows,
)
from fem_seal.parallel import Comm
from fem_seal.points import RecordFolder, Work
from fem_seal.points.study import StudyTask, chain_of, compute_study
from fem_seal.progress import Report, silent

JSON_FILE, TABLE_FILE = "percolation.json", "percolation.csv"
DIFFERENCES_FILE = "differences.csv"


@dataclass(frozen=True)
class Study:
    """Thresholds of an ensemble.

    Attributes
    ----------
    rows : list[ThresholdRow]
        One row for each definition of spanning.
    seeds : list[SeedThresholds]
        Thresholds of each seed.
    """

    rows: list[ThresholdRow]
    seeds: list[SeedThresholds] = field(default_factory=list)

    @property
    def differences(self) -> list[DifferenceRow]:
        """Bearing less elastic thresholds of the same surfaces."""
        return difference_rows(self.seeds)


def percolation(
    cases: Sequence[RoughCase],
    seeds: Sequence[int],
    out: Path,
    *,
    models: Sequence[str] = tuple(MODELS),
    search: Search | None = None,
    threads: int = 1,
    work: Work | None = None,
    report: Report = silent,
) -> Study:
    """Thresholds of many ensembles; surfaces in the folder are not computed again.

    Parameters
    ----------
    cases, seeds, models : all combinations are computed
    out : folder. points/ has a file for each surface; percolation.json and percolation.csv have
        the thresholds of all its surfaces, also those of other runs; differences.csv has the
        thresholds of the bearing model less those of the elastic one
    work : how the surfaces are shared among workers; one after the other if left out
    search, threads, report : as in `seed_thresholds`

    Returns
    -------
    Study, of those surfaces that have been computed.

    Raises
    ------
    InvalidInput
        If the folder holds other settings or cannot be written.
    NotConverged
        If a contact does not converge; the other surfaces are computed all the same.
    """
    search = search or Search()
    folder = RecordFolder(out / "points", SeedThresholds)
    ensembles = [
        [threshold_task(case, model, seed, search, threads) for seed in seeds]
        for case in cases
        for model in models
    ]
    chains = [chain_of(folder, task) for tasks in ensembles for task in tasks]
    compute_study(chains, work, report, lambda: _gather(folder, search, out))
    done: list[SeedThresholds] = []
    rows: list[ThresholdRow] = []
    for tasks in ensembles:
        stored = (folder.point(task.name) for task in tasks)
        points = [point for point in stored if point is not None]
        done.extend(points)
        rows.extend(threshold_rows(points) if points else [])
    return Study(rows, done)


class ThresholdTask(StudyTask[SeedThresholds]):
    """Thresholds of a surface under one model; each contact is reported."""

    def compute(self, handed_on: None, report: Report, comm: Comm) -> SeedThresholds:
        """Compute the thresholds of the surface."""
        return self.function(*self.arguments, **self.options, report=report)


def threshold_task(
    case: RoughCase, model: str, seed: int, search: Search, threads: int = 1
) -> ThresholdTask:
    """Task of one surface under one model."""
    return ThresholdTask(
        f"threshold-{model}-{case.name}-seed{seed}",
        f"{model} {case.name} seed {seed}",
        seed_thresholds,
        (case, model, seed, search),
        {"threads": threads},
        {"case": case, "search": search},
    )


def _gather(folder: RecordFolder[SeedThresholds], search: Search, out: Path) -> None:
    """Write the tables of all points of one search in the folder, also those of other runs."""
    before: list[SeedThresholds] = []
    # Repeat until no other run has added a point meanwhile: the tables then miss no finished point.
    while (points := [p for p in folder.matching("threshold-*") if p.search == search]) != before:
        before = points
        ensembles: dict[tuple[RoughCase, str], list[SeedThresholds]] = {}
        for point in points:
            ensembles.setdefault((point.case, point.model), []).append(point)
        rows = [row for ensemble in ensembles.values() for row in threshold_rows(ensemble)]
        write_json(out / JSON_FILE, Study(rows, points))
        write_table(out / TABLE_FILE, rows)
        differences = difference_rows(points)
        if differences:
            write_table(out / DIFFERENCES_FILE, differences)
