"""What the seeds of a sweep have in common: medians and spreads of the leak rate."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_seal.files import write_text
from fem_seal.sweep.point import Point
from fem_seal.tables import csv_text

SUMMARY_FILE = "summary.csv"
SEEDS = ("surface.seed", "surface.twin_seed")
COLUMNS = ("points", "leaking", "sealed", "median", "lowest", "highest", "decades")


@dataclass(frozen=True)
class Group:
    """Points of a sweep that differ by their seed alone.

    Attributes
    ----------
    values : tuple of str
        Of the fields that are no seed.
    points : tuple of Point
        Those that have a result.
    """

    values: tuple[str, ...]
    points: tuple[Point, ...]

    @property
    def leak_rates(self) -> np.ndarray:
        """Leak rates of the points that have one [m³/s]; 0 where sealed."""
        rates = [point.numbers["leak_rate"] for point in self.points]
        return np.array([rate for rate in rates if isinstance(rate, float | int)], dtype=float)

    def row(self) -> tuple[str | float | int | None, ...]:
        """Cells of COLUMNS; `decades` is the standard deviation of log10 of the leaking ones."""
        rates = self.leak_rates
        if rates.size == 0:
            return len(self.points), 0, 0, None, None, None, None
        leaking = rates[rates > 0]
        return (
            len(self.points),
            leaking.size,
            rates.size - leaking.size,
            float(np.median(rates)),
            float(rates.min()),
            float(rates.max()),
            float(np.std(np.log10(leaking), ddof=1)) if leaking.size > 1 else None,
        )


def groups(keys: tuple[str, ...], table: Sequence[Point]) -> list[Group]:
    """Group the points of a table by all values but the seed, in the order of the table."""
    kept = [i for i, key in enumerate(keys) if key not in SEEDS]
    found: dict[tuple[str, ...], list[Point]] = {}
    for point in table:
        points = found.setdefault(tuple(point.values[i] for i in kept), [])
        if point.numbers["state"]:
            points.append(point)
    return [Group(values, tuple(points)) for values, points in found.items()]


def write_summary(keys: tuple[str, ...], table: Sequence[Point], folder: Path) -> Path | None:
    """Write median and spread over the seeds as CSV; nothing if no seed varies.

    Parameters
    ----------
    keys : tuple of str
        What varies.
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
