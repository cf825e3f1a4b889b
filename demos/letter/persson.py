"""Persson's prediction of the letter's Fig. 3: leak rate against area, from the spectrum alone."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from demos.letter.contacts import CONTACT_MODULUS, PITCH, PRESSURE_DROP, SLOPE, VISCOSITY, RoughCase
from demos.letter.currents import Current
from fem_seal.grid import GridField
from fem_seal.surface import IsotropicSpectrum
from fem_seal.surface.spectrum import mode_powers, wavenumbers
from fem_seal.theory.persson import effective_film_conductivity, persson_state

# Mean pressures over E* h'rms: A/A0 from 0.01 to 0.45 in Persson's theory. From 0.16 on they are
# close together: the leak rate there falls by decades within a few per cent of the load.
LOADS = (*np.geomspace(0.006, 0.16, 24).tolist(), *np.arange(0.164, 0.302, 0.004).tolist())
# A/A0 at which contact percolates in the continuum; the theory's area is that of the continuum. It
# is 0.39 to 0.41 here (docs/theory/letter.md) and 0.415 according to Wang and Müser, Tribol. Lett.
# 69, 1 (2021).
CONTINUUM_THRESHOLD = 0.40
RINGS_PER_OCTAVE = 12  # rings of wave vectors between a wavenumber and its double


def ring_spectrum(case: RoughCase, surface: GridField) -> IsotropicSpectrum:
    """Spectrum of one surface: in each ring of wave vectors its own mean square height.

    The longest waves are few, and scatter by 5 % in rms height from surface to surface at
    λ_l = L/8. Beyond the Nyquist wavenumber the waves are those in the square of the grid.
    """
    first = 2 * np.pi / (case.long * case.n * PITCH)
    last = np.pi / PITCH * min(2 / case.short, np.sqrt(2))
    rings = max(1, round(np.log2(last / first) * RINGS_PER_OCTAVE))
    # Rounding must not leave out the waves at both ends.
    edges = np.geomspace(first * (1 - 1e-9), last * (1 + 1e-9), rings + 1)
    q = wavenumbers(surface.shape, surface.spacing)
    power, _ = np.histogram(q, edges, weights=mode_powers(surface))
    # A ring without waves belongs to the one before.
    edges, power = np.append(edges[:-1][power > 0], edges[-1]), power[power > 0]
    values = power / (np.pi * np.diff(edges**2))
    spectrum = IsotropicSpectrum(edges, values, np.zeros(len(values)))
    # A constant C moves the power in a ring outwards, which makes the slope 0.2 % too large.
    return replace(spectrum, values=values * (SLOPE / spectrum.rms_slope) ** 2)


@dataclass(frozen=True)
class Prediction:
    """Persson's leak rate for the spectrum of one surface."""

    law: str  #: law of the contact area, a name in `theory.persson.AREA_LAWS`
    seed: int
    load: float  #: p/(E* h'rms)
    area: float  #: A/A0 of the continuum, to be compared with the corrected area
    current: float  #: leak rate over the certified one of the same surface at first contact


def predictions(
    spectrum: IsotropicSpectrum,
    law: str,
    seed: int,
    first: float,
    loads: Sequence[float] = LOADS,
) -> list[Prediction]:
    """Leak rate of a square cell under rising loads; 0 from the threshold on."""
    found = []
    for load in loads:
        pressure = load * CONTACT_MODULUS * SLOPE
        state = persson_state(
            spectrum, pressure=pressure, contact_modulus=CONTACT_MODULUS, area=law
        )
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
                    law,
                    point.seed,
                    point.load,
                    point.area,
                    point.corrected,
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
