"""Error of the contact grid: what a finer grid may change."""

from dataclasses import dataclass

import numpy as np


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
