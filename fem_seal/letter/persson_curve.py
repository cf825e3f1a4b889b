"""Persson's prediction of the letter's Fig. 3: leak rate against area, from the spectrum alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_seal.grid import GridField
from fem_seal.letter.surfaces import (
    CONTACT_MODULUS,
    PITCH,
    PRESSURE_DROP,
    SLOPE,
    VISCOSITY,
    RoughCase,
)

# Mean pressures in units of E* h'rms: A/A0 from 0.01 to 0.45 in Persson's theory. From 0.16 on they
# are close together: the leak rate there falls by decades within a few per cent of the load.
LOADS = (*np.geomspace(0.006, 0.16, 24).tolist(), *np.arange(0.164, 0.302, 0.004).tolist())
# A/A0 at which contact percolates in the continuum; the theory's area is that of the continuum. It
# is 0.40 to 0.41 here (docs/theory/letter.md) and 0.415 according to Wang and Müser, Tribol. Lett.
# 69, 1 (2021).
CONTINUUM_THRESHOLD = 0.40
# Number of rings of wave vectors between a wavenumber and its double.
RINGS_PER_OCTAVE = 3


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
    edges, factors : tuple of float
        Ends of rings of wave vectors [1/m], and the power of one surface in each over that of the
        ensemble; empty for the ensemble.
    """

    case: RoughCase
    plateau: float = 1.0
    edges: tuple[float, ...] = ()
    factors: tuple[float, ...] = ()

    @property
    def wavenumbers(self) -> tuple[float, ...]:
        """Ends of the support of C(q), and its kinks between them [1/m]."""
        return tuple(sorted({*self._corners, *self.edges[1:-1]}))

    @property
    def _corners(self) -> tuple[float, ...]:
        long = 2 * np.pi / (self.case.long * self.case.n * PITCH)
        short = 2 * np.pi / (self.case.short * PITCH)
        nyquist = np.pi / PITCH
        if short <= nyquist:
            return long, short
        return long, nyquist, min(short, np.sqrt(2) * nyquist)

    def density(self, q: np.ndarray) -> np.ndarray:
        """C(q) [m^4]."""
        q = np.asarray(q, dtype=float)
        first, last = self._corners[0], self._corners[-1]
        outside = np.arccos(np.minimum(np.pi / PITCH / q, 1.0)) * 4 / np.pi
        inside = (q >= first * (1 - 1e-12)) & (q <= last * (1 + 1e-12))
        power_law = (q / first) ** (-2 - 2 * self.case.hurst)
        density = self.plateau * inside * power_law * np.maximum(1 - outside, 0)
        if not self.factors:
            return density
        ring = np.clip(np.searchsorted(self.edges, q) - 1, 0, len(self.factors) - 1)
        return density * np.array(self.factors)[ring]

    @property
    def mean_square_slope(self) -> float:
        """h'rms² = 2π ∫ q³ C dq."""
        from fem_seal.theory.quadrature import log_grid

        grid = log_grid(self.wavenumbers, 12)
        return float(grid.cumulative(lambda q: 2 * np.pi * q**3 * self.density(q)).at_edges[-1])

    def scaled(self, slope: float) -> "SampledSpectrum":
        """Scale to an rms slope."""
        plateau = self.plateau * slope**2 / self.mean_square_slope
        return SampledSpectrum(self.case, plateau, self.edges, self.factors)

    @classmethod
    def of(cls, case: RoughCase, surface: GridField) -> "SampledSpectrum":
        """Spectrum of one surface: in each ring of wave vectors its own mean square height.

        The longest waves are few, and scatter by 5 % in rms height from surface to surface at
        λ_l = L/8.
        """
        from fem_seal.surface.waves import mode_powers, wavenumbers
        from fem_seal.theory.quadrature import log_grid

        ensemble = cls(case)
        first, last = ensemble.wavenumbers[0], ensemble.wavenumbers[-1]
        rings = max(1, round(np.log2(last / first) * RINGS_PER_OCTAVE))
        edges = np.geomspace(first, last, rings + 1)
        q = wavenumbers(surface.shape, surface.spacing)
        ring = np.clip(np.searchsorted(edges * (1 - 1e-9), q) - 1, 0, rings - 1)
        power = np.bincount(ring.ravel(), mode_powers(surface).ravel(), rings)
        grid = log_grid(tuple(sorted({*edges.tolist(), *ensemble.wavenumbers})), 12)
        heights = grid.cumulative(lambda x: 2 * np.pi * x * ensemble.density(x)).at_edges
        expected = np.diff(np.interp(edges, grid.edges, heights))
        factors = np.divide(power, expected, out=np.zeros(rings), where=expected > 0)
        return cls(case, 1.0, tuple(edges.tolist()), tuple(factors.tolist()))


def persson_curve(
    spectrum: SampledSpectrum,
    threshold: float = CONTINUUM_THRESHOLD,
    loads: Sequence[float] = LOADS,
    *,
    area: str = "persson",
) -> list[PerssonPoint]:
    """Leak rate of a square cell against contact area by Persson's theory.

    Parameters
    ----------
    spectrum : spectrum of the ensemble or of one surface
    threshold : A*/A0 of the modified Bruggeman medium
    loads : mean pressures in units of E* h'rms
    area : law of the contact area, a name in `theory.persson.AREA_LAWS`

    Returns
    -------
    list of PerssonPoint; the leak rate is 0 from the threshold on
    """
    from fem_seal.theory.persson import persson_state
    from fem_seal.theory.seal_estimates import effective_film_conductivity

    scaled = spectrum.scaled(SLOPE)
    points = []
    for load in loads:
        state = persson_state(
            scaled,
            pressure=load * CONTACT_MODULUS * SLOPE,
            contact_modulus=CONTACT_MODULUS,
            area=area,
        )
        K = effective_film_conductivity(state, viscosity=VISCOSITY, threshold=threshold)
        points.append(PerssonPoint(load, float(state.area[-1]), K * PRESSURE_DROP))
    return points
