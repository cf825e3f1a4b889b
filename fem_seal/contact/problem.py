"""The contact problem without units, and the residuals of a pressure in it."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem_seal.contact.halfspace import HalfSpace
from fem_seal.contact.plane_cut import plane_at_mean_gap
from fem_seal.errors import Inconsistent

DOUBLE = np.dtype(float)


@dataclass(frozen=True, eq=False)
class Problem:
    """Find p >= 0 and gap = S p - h - δ >= 0 with p gap = 0, at one load; δ is the offset."""

    heights: np.ndarray  #: (nx, ny) float64, heights h of the counter-face, zero mean, unit rms
    half_space: HalfSpace  #: the operator S from pressure to displacement
    #: prescribed load or mean gap > 0, in the units of HalfSpace; exactly one of them is not None
    mean_pressure: float | None = None
    mean_gap: float | None = None
    #: certificate at which the solve stops: iterates above it may be computed less exactly
    tolerance: float = 0.0

    def __post_init__(self) -> None:
        given = [value for value in (self.mean_pressure, self.mean_gap) if value is not None]
        if not (len(given) == 1 and given[0] > 0):
            raise Inconsistent(
                "a contact problem needs a mean pressure or a mean gap > 0; got mean pressure "
                f"{self.mean_pressure}, mean gap {self.mean_gap}"
            )

    def gap(self, pressure: np.ndarray) -> np.ndarray:
        """S p - h, plus a prescribed mean gap; under a load the offset is not yet taken off."""
        uniform = pressure.flat[0] == pressure.flat[-1] and np.ptp(pressure) == 0
        # A uniform pressure causes a uniform displacement: no transform is needed.
        displacement = 0.0 if uniform else self.half_space.displacement(pressure)
        gap = displacement - self.heights
        if self.mean_gap is not None:
            gap += self.mean_gap
        return gap

    def certificate(self, pressure: np.ndarray, gap: np.ndarray) -> float:
        """`certificate_from` for arrays of pressure and gap."""
        return self.certificate_from(
            float(pressure.sum()), float(np.vdot(pressure, gap)), float(gap.min())
        )

    def certificate_from(self, total: float, work: float, lowest: float) -> float:
        """Certificate from Σp, Σ p gap and min gap: the duality gap over Σp, in rms heights.

        It is the same for every method: for the energy F = p·Sp/2 - p·h, with the offset at the
        lowest point, F(p) - F* <= certificate × Σp. A prescribed mean gap fixes the offset; then a
        gap that is too small or too large as a whole counts as well, and the inequality holds up to
        the factor 2 r - 1, r >= 1 the ratio of the exact Σp to this one
        (docs/theory/mathematics.md, theorem 9).
        """
        if total == 0:
            return max(-lowest, 0.0)
        certificate = work / total - lowest
        return certificate if self.mean_gap is None else max(certificate, abs(work / total))

    def offset(self, pressure: np.ndarray, gap: np.ndarray) -> float:
        """Offset δ that `gap` has where the surfaces touch.

        Under pressure control it is the mean weighted with the pressure, Σ p g / Σ p: the energy's
        multiplier of the load. A mean gap that is prescribed fixes the offset, which is then 0.
        """
        if self.mean_gap is not None:
            return 0.0
        return float(np.vdot(pressure, gap) / pressure.sum())

    def measures(self, pressure: np.ndarray, gap: np.ndarray) -> "Measures":
        """Residuals of a pressure and the gap that it causes."""
        offset, total = self.offset(pressure, gap), float(pressure.sum()) or 1.0

        def distances(rows: slice) -> tuple[float, float, float]:
            p, g = pressure[rows], gap[rows]
            pressed = float(np.abs(g - offset).max(initial=0.0, where=p > 0))
            return float(np.vdot(p, g)), pressed, float(g.min())

        works, pressed, lows = zip(*self.half_space.passes.over(gap.shape, distances), strict=True)
        mean_gap_error = 0.0
        if self.mean_gap is not None:
            # The state's gap is 0 on pressed samples and where the surfaces overlap.
            reached = float(gap.sum(where=(pressure == 0) & (gap > 0))) / gap.size
            mean_gap_error = abs(reached / self.mean_gap - 1)
        return Measures(
            certificate=max(0.0, self.certificate_from(total, sum(works), min(lows))),
            pressed_gap=max(pressed),
            penetration=max(0.0, offset - min(lows)),
            mean_gap_error=mean_gap_error,
        )

    def rounding(self, pressure: np.ndarray, precision: np.dtype = DOUBLE) -> float:
        """Estimated upper bound of the rounding error of the gap that a pressure causes.

        An FFT of N samples with the rounding unit ε adds noise to the modes of at most ε log2 N
        times the rms of the samples (N. J. Higham, Accuracy and Stability of Numerical Algorithms
        (2002), theorem 24.2, with room for its constants). The compliances turn the noise into a
        displacement. We allow four times its rms, an estimate and no bound: the largest of N
        Gaussian samples is about √(2 ln N) times it, 5.8 at 4096², but the noise of an FFT usually
        grows with √(log2 N), a fifth of log2 N there. In float64 it reaches 1e-4 of
        the rms height only under a pressure 1e9 times the one that flattens the surface. The
        heights are rounded as well.
        """
        rms = (self.half_space.passes.product(pressure, pressure) / pressure.size) ** 0.5
        noise = np.log2(2 * pressure.size) * rms * self.half_space.rms_compliance
        return float(np.finfo(precision).eps * (4 * noise + self._highest))

    @cached_property
    def _highest(self) -> float:
        """Largest height above or below the mean."""
        return float(max(self.heights.max(), -self.heights.min()))

    def make_admissible(self, pressure: np.ndarray) -> None:
        """Set tensile pressures to zero and restore the mean pressure, in place."""
        np.maximum(pressure, 0, out=pressure)
        if self.mean_pressure is not None:
            pressure *= self.mean_pressure / pressure.mean()

    def projected(self, displacement: np.ndarray) -> np.ndarray:
        """Project a displacement: the nearest one (least squares) outside the counter-face.

        Under pressure control that is max(u, h), the letter's hard wall. Under mean-gap control
        it is max(u + s, h) with the shift s at which the mean of max(u + s, h) - h is the mean gap.
        """
        if self.mean_gap is None:
            return np.maximum(displacement, self.heights)
        shift = plane_at_mean_gap(self.heights - displacement, self.mean_gap)
        return np.maximum(displacement + shift, self.heights)


@dataclass(frozen=True)
class Measures:
    """Residuals of a pressure in a `Problem`; lengths in units of the rms height."""

    certificate: float  #: duality gap, as of `Problem.certificate_from`
    pressed_gap: float  #: largest ``|g|`` on the samples that carry pressure
    penetration: float  #: deepest overlap, the largest -g of all samples
    mean_gap_error: float  #: relative error of the mean gap where it is prescribed, else 0


@dataclass(frozen=True, eq=False)
class Iterate:
    """One step of a method."""

    iteration: int  #: number of the step
    pressure: np.ndarray  #: (nx, ny), admissible pressure
    certificate: float  #: that of this pressure
    #: (nx, ny), S p - h up to a constant, computed from this pressure alone; in float32 at first if
    #: the transforms are. None only where the certificate is infinite. Until the next step only:
    #: the method reads it again, and may overwrite it
    gap: np.ndarray | None = None


Iterates = Iterator[Iterate]
