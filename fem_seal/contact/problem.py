"""The contact problem without units, and the measure of how well a pressure solves it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fem_seal.contact.halfspace import HalfSpace


@dataclass(frozen=True, eq=False)
class Problem:
    """Find p >= 0 and gap = S p - h + offset >= 0 with p gap = 0, at one load.

    heights : (nx, ny) float64, zero mean, unit rms
    half_space : HalfSpace, S
    mean_pressure, mean_gap : exactly one of them is not None; > 0, in the units of HalfSpace
    """

    heights: np.ndarray
    half_space: HalfSpace
    mean_pressure: float | None = None
    mean_gap: float | None = None

    def gap(self, pressure: np.ndarray) -> np.ndarray:
        """S p - h + mean gap; under pressure control the offset is yet free (new array)."""
        uniform = pressure.flat[0] == pressure.flat[-1] and np.ptp(pressure) == 0
        # A uniform pressure displaces uniformly: the cold start costs no transform.
        displacement = 0.0 if uniform else self.half_space.displacement(pressure)
        gap = displacement - self.heights
        if self.mean_gap is not None:
            gap += self.mean_gap
        return gap

    def error(self, pressure: np.ndarray, gap: np.ndarray) -> float:
        """`error_from` of arrays."""
        return self.error_from(
            float(pressure.sum()), float(np.vdot(pressure, gap)), float(gap.min())
        )

    def error_from(self, total: float, work: float, lowest: float) -> float:
        """Duality gap in units of the rms height, from Σp, Σ p gap and min gap.

        With the offset taken from the lowest point, F(p) - F* <= error × Σp for the energy
        F = p·Sp/2 - p·h: the certificate of every method. Under mean-gap control the offset is
        given, and a gap that is closed or opened as a whole counts too.
        """
        if total == 0:
            return max(-lowest, 0.0)
        error = work / total - lowest
        return error if self.mean_gap is None else max(error, abs(work / total))

    def admissible(self, pressure: np.ndarray) -> None:
        """Clip tension away and restore the mean pressure, in place."""
        np.maximum(pressure, 0, out=pressure)
        if self.mean_pressure is not None:
            pressure *= self.mean_pressure / pressure.mean()

    def rested(self, displacement: np.ndarray) -> np.ndarray:
        """Nearest displacement (least squares) outside the counter-face, at the mean gap if given.

        Under pressure control that is max(u, h), the letter's hard wall. Under mean-gap control
        it is max(u + s, h) with the shift s that gives the mean: a piecewise linear equation,
        solved by Newton's method in finitely many steps.
        """
        if self.mean_gap is None:
            return np.maximum(displacement, self.heights)
        shift = self.mean_gap - displacement.mean()
        while True:
            rested = np.maximum(displacement + shift, self.heights)
            excess = rested.mean() - self.mean_gap
            if excess < 1e-14 * (self.mean_gap + 1):
                return rested
            shift -= excess / np.mean(rested > self.heights)


@dataclass(frozen=True, eq=False)
class Iterate:
    """What a method hands out: its step number, its pressure and the certificate's value.

    gap : S p - h up to a constant, in double, of this very pressure and from nothing else; None
        where the method has none. Whoever takes it may overwrite it.
    """

    iteration: int
    pressure: np.ndarray
    error: float
    gap: np.ndarray | None = None


Iterates = Iterator[Iterate]
