"""Bounds of a leak rate; those of a tensor are in `tensor_bounds.py`."""

from typing import NamedTuple

import numpy as np

from fem_seal.leak_rate import relative_width


class Bounds(NamedTuple):
    """Two numbers between which the leak rate lies."""

    lower: float = 0.0
    upper: float = np.inf

    @property
    def excess(self) -> float:
        """(upper - lower)/lower; infinite if the lower bound is 0."""
        return self.upper / self.lower - 1 if self.lower > 0 else np.inf

    @property
    def width(self) -> float:
        """Relative width, see `leak_rate.relative_width`."""
        return relative_width(self.lower, self.upper)

    def tightened(self, other: "Bounds") -> "Bounds":
        """The larger lower bound and the smaller upper bound of the two."""
        return Bounds(max(self.lower, other.lower), min(self.upper, other.upper))

    def hardly_better(self, before: "Bounds") -> bool:
        """Whether both bounds are less than 1 % better than `before`."""
        return self.upper > 0.99 * before.upper and self.lower <= 1.01 * before.lower
