"""Persson's prediction of the letter's Fig. 3: leak rate against area, from the spectrum alone."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from demos.letter.contacts import (
    CONTACT_MODULUS,
    PITCH,
    PRESSURE_DROP,
    SLOPE,
    VISCOSITY,
    RoughCase,
)
from demos.letter.currents import Current
from fem_seal.grid import GridField
from fem_seal.surface.spectrum import mode_powers, wavenumbers
from fem_seal.theory.persson import cumulative, effective_film_conductivity, ladder, persson_state

# Mean pressures over E* h'rms: A/A0 from 0.01 to 0.45 in Persson's theory. From 0.16 on they are
# close together: the leak rate there falls by decades within a few per cent of the load.
LOADS = (*np.geomspace(0.006, 0.16, 24).tolist(), *np.arange(0.164, 0.302, 0.004).tolist())
# A/A0 at which contact percolates in the continuum; the theory's area is that of the continuum. It
# is 0.40 to 0.41 here (docs/theory/letter.md) and 0.415 according to Wang and Müser, Tribol. Lett.
# 69, 1 (2021).
CONTINUUM_THRESHOLD = 0.40
RINGS_PER_OCTAVE = 3  # rings of wave vectors between a wavenumber and its double
STEPS_PER_OCTAVE = 200  # of integrals over wavenumbers


@dataclass(frozen=True)
class SampledSpectrum:
    """Isotropic power spectrum of the waves of a sampled surface; an `IsotropicSpectrum`."""

    case: RoughCase
    plateau: float = 1.0  #: C0 [m⁴]
    edges: tuple[float, ...] = ()  #: ends of rings of wave vectors [1/m]; none for the ensemble
    factors: tuple[float, ...] = ()  #: power of one surface in each ring over the ensemble's

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
        """C(q) [m⁴]; beyond the Nyquist wavenumber, of the waves in the square of the grid."""
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

    def moment(self, power: int, *ends: float) -> float:
        """2π ∫ q^(power + 1) C dq, all or between two ends; power 2 is the mean square slope."""
        low, high = ends or (self.wavenumbers[0], self.wavenumbers[-1])
        marks = (low, *(q for q in self.wavenumbers if low < q < high), high)
        steps = ladder(marks, STEPS_PER_OCTAVE)
        return cumulative(lambda q: 2 * np.pi * q ** (power + 1) * self.density(q), steps)[-1]

    def scaled(self, slope: float) -> "SampledSpectrum":
        """Scale to an rms slope."""
        return replace(self, plateau=self.plateau * slope**2 / self.moment(2))

    @classmethod
    def of(cls, case: RoughCase, surface: GridField) -> "SampledSpectrum":
        """Spectrum of one surface: in each ring of wave vectors its own mean square height.

        The longest waves are few, and scatter by 5 % in rms height from surface to surface at
        λ_l = L/8.
        """
        ensemble = cls(case)
        first, last = ensemble.wavenumbers[0], ensemble.wavenumbers[-1]
        rings = max(1, round(np.log2(last / first) * RINGS_PER_OCTAVE))
        edges = np.geomspace(first, last, rings + 1)
        q = wavenumbers(surface.shape, surface.spacing)
        ring = np.clip(np.searchsorted(edges * (1 - 1e-9), q) - 1, 0, rings - 1)
        power = np.bincount(ring.ravel(), mode_powers(surface).ravel(), rings)
        expected = [ensemble.moment(0, *ends) for ends in pairwise(edges)]
        factors = np.divide(power, expected, out=np.zeros(rings), where=np.array(expected) > 0)
        return cls(case, 1.0, tuple(edges.tolist()), tuple(factors.tolist()))


@dataclass(frozen=True)
class Prediction:
    """Persson's leak rate for the spectrum of one surface."""

    law: str  #: law of the contact area, a name in `theory.persson.AREA_LAWS`
    seed: int
    load: float  #: p/(E* h'rms)
    area: float  #: A/A0 of the continuum, to be compared with the corrected area
    current: float  #: leak rate over the certified one of the same surface at first contact


def predictions(
    spectrum: SampledSpectrum,
    law: str,
    seed: int,
    first: float,
    loads: Sequence[float] = LOADS,
) -> list[Prediction]:
    """Leak rate of a square cell under rising loads; 0 from the threshold on."""
    scaled, found = spectrum.scaled(SLOPE), []
    for load in loads:
        pressure = load * CONTACT_MODULUS * SLOPE
        state = persson_state(scaled, pressure=pressure, contact_modulus=CONTACT_MODULUS, area=law)
        K = effective_film_conductivity(state, viscosity=VISCOSITY, threshold=CONTINUUM_THRESHOLD)
        found.append(Prediction(law, seed, load, float(state.area[-1]), K * PRESSURE_DROP / first))
    return found


@dataclass(frozen=True)
class Comparison:
    """An elastic contact beside Persson's theory for the spectrum of its surface."""

    law: str
    seed: int
    load: float  #: p/(E* h'rms)
    area: float  #: A/A0, counted in samples
    corrected: float
    kappa: float  #: κ = (A/A0) / load of the counted area
    kappa_corrected: float
    theory_area: float  #: A/A0 of the theory under the same load
    at_area: float  #: its leak rate over the certified one at the corrected area; 0 if sealed
    at_load: float  #: the same under the same load


def comparisons(points: Sequence[Current], curves: Sequence[Prediction]) -> list[Comparison]:
    """Compare the elastic contacts that leak with the curve of their surface, for each law."""
    rows = []
    for law in dict.fromkeys(row.law for row in curves):
        for point in points:
            curve = [row for row in curves if (row.law, row.seed) == (law, point.seed)]
            if point.load is None or point.value == 0 or not curve:
                continue
            areas, loads, currents = zip(
                *((row.area, row.load, row.current) for row in curve), strict=True
            )
            rows.append(
                Comparison(
                    *(law, point.seed, point.load, point.area, point.corrected),
                    kappa=point.area / point.load,
                    kappa_corrected=point.corrected / point.load,
                    theory_area=float(np.interp(point.load, loads, areas)),
                    at_area=_between(point.corrected, areas, currents) / point.value,
                    at_load=_between(point.load, loads, currents) / point.value,
                )
            )
    return rows


def _between(x: float, xs: Sequence[float], currents: Sequence[float]) -> float:
    """Current at x, interpolated in its logarithm; 0 from the first sealed point on."""
    k = int(np.searchsorted(xs, x))
    if k >= len(xs) or currents[k] == 0:
        return 0.0
    leaking = [current for current in currents if current > 0]
    return float(np.exp(np.interp(x, xs[: len(leaking)], np.log(leaking))))
