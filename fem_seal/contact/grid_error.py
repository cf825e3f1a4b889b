"""Error of the contact grid: what a finer grid may change, and the limit of a series of grids."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput


@dataclass(frozen=True)
class GridError:
    """Estimate of what a finer grid of the contact may change."""

    lower: float | None  #: least true over computed leak rate; None if it is not known
    upper: float | None  #: largest true over computed leak rate; None if it is not known
    sentence: str  #: where the estimate comes from

    @property
    def part(self) -> float:
        """Largest |ln| of true over computed leak rate; infinite if a side is open."""
        if self.lower is None or self.upper is None:
            return np.inf
        return max(-np.log(self.lower), np.log(self.upper))


@dataclass(frozen=True)
class Extrapolation:
    """Limit of a sequence on finer and finer grids."""

    limit: float
    error: float  #: distance of the finest value from the limit
    order: float  #: observed order in the spacing; nan where the sequence is not monotone


def extrapolate(values: Sequence[float]) -> Extrapolation:
    """Richardson's extrapolation of the last three values with their observed order.

    The values are those on grids each of half the spacing of the one before. If they do not
    converge monotonically, no order can be observed: the limit is then the last value, and the
    error the larger of the two changes.
    """
    if len(values) < 3:
        raise InvalidInput(f"an extrapolation needs three grids, got {len(values)}")
    coarse, middle, fine = (float(value) for value in values[-3:])
    first, second = middle - coarse, fine - middle
    if second == 0:
        return Extrapolation(fine, 0.0, np.inf)
    if first / second <= 1:
        return Extrapolation(fine, max(abs(first), abs(second)), np.nan)
    limit = fine + second**2 / (first - second)
    return Extrapolation(limit, abs(limit - fine), float(np.log2(first / second)))
