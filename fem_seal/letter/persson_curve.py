"""Persson's prediction of the letter's Fig. 3: leak rate against area, from the spectrum alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_seal.letter.surfaces import (
    CONTACT_MODULUS,
    PITCH,
    PRESSURE_DROP,
    SLOPE,
    VISCOSITY,
    RoughCase,
)

# Mean pressures in units of E* h'rms: A/A0 from 0.01 to 0.63.
LOADS = tuple(np.geomspace(0.006, 0.45, 40).tolist())


@dataclass(frozen=True)
class PerssonPoint:
    """A point of Persson's leak rate.

    Attributes
    ----------
    load : float
        Mean pressure over E* h'rms.
    area : float
        A/A0.
    leak_rate : float
        Leak rate [m³/s].
    """

    load: float
    area: float
    leak_rate: float


@dataclass(frozen=True)
class SampledSpectrum:
    """Isotropic power spectrum of the waves of a sampled surface.

    Attributes
    ----------
    case : RoughCase
        Ensemble of surfaces.
    plateau : float
        C0 [m⁴].
    """

    case: RoughCase
    plateau: float = 1.0

    @property
    def wavenumbers(self) -> tuple[float, ...]:
        """Ends of the support of C(q), and its kink between them if there is one [1/m]."""
        long = 2 * np.pi / (self.case.long * self.case.n * PITCH)
        short = 2 * np.pi / (self.case.short * PITCH)
        nyquist = np.pi / PITCH
        if short <= nyquist:
            return long, short
        return long, nyquist, min(short, np.sqrt(2) * nyquist)

    def density(self, q: np.ndarray) -> np.ndarray:
        """C(q) [m^4]."""
        q = np.asarray(q, dtype=float)
        first, last = self.wavenumbers[0], self.wavenumbers[-1]
        outside = np.arccos(np.minimum(np.pi / PITCH / q, 1.0)) * 4 / np.pi
        inside = (q >= first * (1 - 1e-12)) & (q <= last * (1 + 1e-12))
        power_law = (q / first) ** (-2 - 2 * self.case.hurst)
        return self.plateau * inside * power_law * np.maximum(1 - outside, 0)

    @property
    def mean_square_slope(self) -> float:
        """h'rms² = 2π ∫ q³ C dq."""
        from fem_seal.theory.quadrature import log_grid

        grid = log_grid(self.wavenumbers, 12)
        return float(grid.cumulative(lambda q: 2 * np.pi * q**3 * self.density(q)).at_edges[-1])

    def scaled(self, slope: float) -> "SampledSpectrum":
        """Scale to an rms slope."""
        return SampledSpectrum(self.case, self.plateau * slope**2 / self.mean_square_slope)


def persson_curve(
    case: RoughCase, threshold: float, loads: Sequence[float] = LOADS
) -> list[PerssonPoint]:
    """Leak rate of a square cell against contact area by Persson's theory.

    Parameters
    ----------
    case : the ensemble
    threshold : A*/A0 of the modified Bruggeman medium
    loads : mean pressures in units of E* h'rms

    Returns
    -------
    list of PerssonPoint; the leak rate is 0 from the threshold on
    """
    from fem_seal.theory.persson import persson_state
    from fem_seal.theory.seal_estimates import effective_film_conductivity

    spectrum = SampledSpectrum(case).scaled(SLOPE)
    points = []
    for load in loads:
        state = persson_state(
            spectrum, pressure=load * CONTACT_MODULUS * SLOPE, contact_modulus=CONTACT_MODULUS
        )
        K = effective_film_conductivity(state, viscosity=VISCOSITY, threshold=threshold)
        points.append(PerssonPoint(load, float(state.area[-1]), K * PRESSURE_DROP))
    return points
