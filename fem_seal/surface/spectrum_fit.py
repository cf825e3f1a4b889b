"""Hurst exponent and cut-offs fitted to the spectrum of a map, with their statistical errors.

The model is C(q) = C0 for q < q_r and C0 (q/q_r)^-(2 + 2H) for q > q_r, between two cut-offs.
"""

from dataclasses import dataclass, replace

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.surface.cell import HANN_DEPENDENCE, window
from fem_seal.surface.detrending import TREND_ROUNDING
from fem_seal.surface.profiles import DENSITY_ROUNDING
from fem_seal.surface.segments import best_segments, power_law
from fem_seal.surface.statistics import RadialSpectrum, radial_spectrum

# Rings that lie closer than this ratio of wavenumbers are averaged in one bin.
BIN_RATIO = 1.06
# Number of bins before a cut-off into which a window smears it.
SMEARED = 2


@dataclass(frozen=True, eq=False)
class SpectrumFit:
    """The fitted spectrum of a map."""

    hurst: float  #: H
    hurst_error: float  #: standard deviation of H
    #: λ_r = 2π/q_r [m]; None if there is no plateau
    rolloff_wavelength: float | None
    #: standard deviation of λ_r [m]
    rolloff_error: float | None
    #: cut-offs [m], to the width of a bin (6 % or one ring); None if plateau and power law extend
    #: to the last ring, so that the map does not resolve the cut-off
    long_wavelength: float | None
    short_wavelength: float | None
    #: χ² per degree of freedom; if above 1, the errors above include the factor √misfit
    misfit: float
    spectrum: RadialSpectrum  #: the rings that were fitted
    wavenumber: np.ndarray  #: (m,), q [1/m] of the fitted C(q)
    density: np.ndarray  #: (m,), the fitted C(q) [m^4]


def fit_spectrum(field: GridField) -> SpectrumFit:
    """Fit the power law of a self-affine surface.

    The power of one wave of a Gaussian surface is exponentially distributed. The logarithm of a
    mean over n independent waves therefore has the bias ψ(n) - ln n and the variance ψ'(n), with
    the digamma function ψ: weights and errors follow from the number of waves. Knee and cut-offs
    are chosen by the Bayesian information criterion (`segments`). Heights [m] that are not periodic
    are multiplied by a Hann window.
    """
    field, dependence = _windowed(field)
    spectrum = _rings(field)
    # Half of the waves are the complex conjugates of the others.
    independent = np.maximum(spectrum.modes / 2 / dependence, 1.0)
    x, y, variance = _bins(spectrum, independent)
    segments = best_segments(x, y, variance)
    if segments is None:
        raise InvalidInput(
            f"the spectrum of {field.shape[0]} x {field.shape[1]} samples shows no power law"
        )
    edge = segments.stop
    if dependence > 1 and edge < len(x):
        # The window smears the cut-off into the bins before it: leave them out of the fit.
        segments = replace(segments, stop=max(edge - SMEARED, segments.knee + 2))
    first = power_law(x, y, variance, segments)
    # The spectrum falls inside each ring; repeat the fit with ring means that allow for its slope.
    spectrum = _sloped(spectrum, _rings(field, -first.slope), first.knee)
    x, y, variance = _bins(spectrum, independent)
    fit = power_law(x, y, variance, segments)
    wavelength = 2 * np.pi / np.exp(x)
    rolloff = None if fit.knee is None else 2 * np.pi / np.exp(fit.knee)
    fitted = x[segments.start : segments.stop]
    return SpectrumFit(
        hurst=-fit.slope / 2 - 1,
        hurst_error=fit.slope_error / 2,
        rolloff_wavelength=rolloff,
        rolloff_error=None if rolloff is None else rolloff * fit.knee_error,
        long_wavelength=float(wavelength[segments.start - 1]) if segments.start > 0 else None,
        short_wavelength=float(wavelength[edge]) if edge < len(x) else None,
        misfit=fit.misfit,
        spectrum=spectrum,
        wavenumber=np.exp(fitted),
        density=np.exp(fit.at(fitted)),
    )


def map_spectrum(field: GridField) -> RadialSpectrum:
    """C(q) of a map, averaged over rings up to the Nyquist wavenumber.

    Heights [m] that are not periodic are multiplied by a Hann window and scaled back to its power.
    """
    return _rings(_windowed(field)[0])


def _windowed(field: GridField) -> tuple[GridField, float]:
    """Map times a Hann window unless it is periodic, and the factor of the variance of means."""
    if np.ptp(field.values) <= TREND_ROUNDING * np.abs(field.values).max():
        raise InvalidInput("a flat surface has no spectrum")
    if field.periodic:
        return field, 1.0
    weights = window("hann", field.shape)
    mean = np.average(field.values, weights=weights**2)
    values = (field.values - mean) * weights / np.sqrt(np.mean(weights**2))
    return GridField(values, field.spacing, periodic=True), HANN_DEPENDENCE**2


def _rings(field: GridField, exponent: float = 0.0) -> RadialSpectrum:
    """Rings up to the Nyquist wavenumber; those beyond, in the corners, are incomplete."""
    rings = radial_spectrum(field, exponent)
    complete = rings.wavenumber <= np.pi / max(field.spacing)
    if not rings.density[complete].any():
        raise InvalidInput("a map of {} x {} samples has no spectrum".format(*field.shape))
    return RadialSpectrum(
        rings.wavenumber[complete], rings.density[complete], rings.modes[complete]
    )


def _sloped(flat: RadialSpectrum, falling: RadialSpectrum, knee: float | None) -> RadialSpectrum:
    """Rings with the density of `flat` below the knee (ln q) and of `falling` above it."""
    above = np.log(flat.wavenumber) > (-np.inf if knee is None else knee)
    density = np.where(above, falling.density, flat.density)
    return RadialSpectrum(flat.wavenumber, density, flat.modes)


def _bins(
    spectrum: RadialSpectrum, independent: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bins of rings: ln q, ln C without bias, and the variance of ln C."""
    from scipy.special import digamma, polygamma

    log_q = np.log(spectrum.wavenumber)
    lowest = DENSITY_ROUNDING * spectrum.density.max()
    log_C = np.log(np.maximum(spectrum.density, lowest))
    log_C -= digamma(independent) - np.log(independent)
    weight = 1 / polygamma(1, independent)
    number = np.rint((log_q - log_q[0]) / np.log(BIN_RATIO)).astype(int)
    _, number = np.unique(number, return_inverse=True)
    total = np.bincount(number, weight)
    x, y = (np.bincount(number, weight * values) / total for values in (log_q, log_C))
    return x, y, 1 / total
