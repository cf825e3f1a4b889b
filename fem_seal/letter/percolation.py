"""Percolation thresholds of bearing and elastic contact over seeds, sizes and cut-offs."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fem_seal.letter.seed_thresholds import Search, SeedThresholds, seed_thresholds
from fem_seal.letter.store import PointStore, write_json, write_table
from fem_seal.letter.surfaces import RoughCase
from fem_seal.letter.threshold_rows import ThresholdRow, threshold_rows
from fem_seal.progress import Report, silent

JSON_FILE, TABLE_FILE = "percolation.json", "percolation.csv"


@dataclass(frozen=True)
class Study:
    """Thresholds of all surfaces, and their means over seeds as rows."""

    rows: list[ThresholdRow]
    seeds: list[SeedThresholds] = field(default_factory=list)


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
    """Thresholds of many ensembles; surfaces that the folder holds are not computed again.

    Parameters
    ----------
    cases, seeds, models : all combinations are computed
    out : folder of a file for each surface in points/, and of percolation.json and
        percolation.csv, which hold all surfaces of the folder, by whatever run
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
            rows.extend(threshold_rows(points))
    _gather(store, search, out)
    return Study(rows, done)


def _gather(store: PointStore[SeedThresholds], search: Search, out: Path) -> None:
    """Write the tables of all points of one search that the folder holds, by any writer."""
    before: list[SeedThresholds] | None = None
    # Repeated until nothing has come meanwhile: the last table then misses no finished point.
    while (points := [p for p in store.there("threshold-*") if p.search == search]) != before:
        before = points
        ensembles: dict[tuple[RoughCase, str], list[SeedThresholds]] = {}
        for point in points:
            ensembles.setdefault((point.case, point.model), []).append(point)
        rows = [row for ensemble in ensembles.values() for row in threshold_rows(ensemble)]
        write_json(out / JSON_FILE, Study(rows, points))
        write_table(out / TABLE_FILE, rows)
