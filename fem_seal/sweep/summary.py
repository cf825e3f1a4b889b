"""Statistics of the leak rate over the seeds of a sweep: median and spread."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_seal.files import write_text
from fem_seal.sweep.point import Point
from fem_seal.tables import csv_text

SUMMARY_FILE = "summary.csv"
SEEDS = ("surface.seed", "surface.twin_seed")
COLUMNS = ("points", "leaking", "sealed", "lifted_off", "median", "lowest", "highest", "decades")


@dataclass(frozen=True)
class Group:
    """Points of a sweep that differ by their seed alone.

    Attributes
    ----------
    values : tuple of str
        Values of the fields other than the seed.
    points : tuple of Point
        The points that have a result.
    """

    values: tuple[str, ...]
    points: tuple[Point, ...]

    @property
    def leak_rates(self) -> np.ndarray:
        """Leak rates of the points [m³/s]: 0 where sealed, infinite where lifted off."""
        off = {"lifted off": np.inf}
        rates = [off.get(str(p.numbers["state"]), p.numbers["leak_rate"]) for p in self.points]
        return np.array([rate for rate in rates if isinstance(rate, float | int)], dtype=float)

    def row(self) -> tuple[str | float | int | None, ...]:
        """Cells of COLUMNS; `decades` is the standard deviation of log10 of the rates that leak.

        Median, lowest and highest are left out where they belong to points that are lifted off.
        """
        rates = self.leak_rates
        leaking = rates[(rates > 0) & np.isfinite(rates)]
        sealed, lifted_off = int(np.sum(rates == 0)), int(np.sum(np.isinf(rates)))
        counts = len(self.points), leaking.size, sealed, lifted_off
        if rates.size == 0:
            return *counts, None, None, None, None
        spread = float(np.std(np.log10(leaking), ddof=1)) if leaking.size > 1 else None
        ranks = (float(rate) for rate in (np.median(rates), rates.min(), rates.max()))
        return *counts, *(rate if np.isfinite(rate) else None for rate in ranks), spread


def groups(keys: tuple[str, ...], table: Sequence[Point]) -> list[Group]:
    """Group the points of a table by all values but the seed, in the order of the table."""
    kept = [i for i, key in enumerate(keys) if key not in SEEDS]
    points_of: dict[tuple[str, ...], list[Point]] = {}
    for point in table:
        points = points_of.setdefault(tuple(point.values[i] for i in kept), [])
        if point.numbers["state"]:
            points.append(point)
    return [Group(values, tuple(points)) for values, points in points_of.items()]


def write_summary(keys: tuple[str, ...], table: Sequence[Point], folder: Path) -> Path | None:
    """Write median and spread over the seeds as CSV; nothing if no seed varies.

    Parameters
    ----------
    keys : tuple of str
        Fields that vary.
    table : sequence of Point
    folder : pathlib.Path
    """
    if not set(keys) & set(SEEDS):
        return None
    others = tuple(key for key in keys if key not in SEEDS)
    lines = ((*group.values, *group.row()) for group in groups(keys, table))
    path = folder / SUMMARY_FILE
    write_text(path, csv_text((*others, *COLUMNS), lines))
    return path
