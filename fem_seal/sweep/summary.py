"""Statistics of the leak rate over the seeds of a sweep: median and spread."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_seal.files import write_text
from fem_seal.scene.scene import SEEDS
from fem_seal.sweep.point import UNSETTLED, Point
from fem_seal.tables import csv_text

SUMMARY_FILE = "summary.csv"
COLUMNS = (
    "points", "leaking", "sealed", "lifted_off", "unsettled", "left_out",
    "median", "lowest", "highest", "decades",
)  # fmt: skip


@dataclass(frozen=True)
class Group:
    """Points of a sweep that differ by their seed alone."""

    values: tuple[str, ...]  #: of the fields other than the seed
    points: tuple[Point, ...]

    @property
    def leak_rates(self) -> np.ndarray:
        """Leak rates of the points [m³/s]: 0 where sealed, infinite where lifted off.

        Points that failed, or whose contact and flow have not settled, have none.
        """
        known = {"sealed": 0.0, "lifted off": np.inf}
        rates = [known.get(str(point.state), point.leak_rate or None) for point in self.points]
        return np.array([rate for rate in rates if rate is not None])

    def count(self, state: str) -> int:
        """Number of points in a state."""
        return sum(point.state == state for point in self.points)

    @property
    def left_out(self) -> int:
        """Number of points that have no leak rate."""
        return len(self.points) - self.leak_rates.size

    def row(self) -> tuple[str | float | int | None, ...]:
        """Cells of COLUMNS; `decades` is the standard deviation of log10 of the rates that leak.

        Median, lowest and highest are those of the points that have a leak rate, and are empty
        where they belong to points that are lifted off.
        """
        rates = self.leak_rates
        leaking = rates[(rates > 0) & np.isfinite(rates)]
        others = map(self.count, ("sealed", "lifted off", UNSETTLED))
        counts = len(self.points), leaking.size, *others, self.left_out
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
        points_of.setdefault(tuple(point.values[i] for i in kept), []).append(point)
    return [Group(values, tuple(points)) for values, points in points_of.items()]


def write_summary(keys: tuple[str, ...], table: Sequence[Point], folder: Path) -> None:
    """Write median and spread over the seeds as CSV; nothing if no seed, of `keys`, varies."""
    if SEEDS.intersection(keys):
        others = tuple(key for key in keys if key not in SEEDS)
        lines = ((*group.values, *group.row()) for group in groups(keys, table))
        write_text(folder / SUMMARY_FILE, csv_text((*others, *COLUMNS), lines), durable=False)
