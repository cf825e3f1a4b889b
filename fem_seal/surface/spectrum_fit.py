"""Hurst exponent and cut-offs fitted to the spectrum of a map, with their statistical errors."""

from dataclasses import dataclass, replace

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.surface.cell import window
from fem_seal.surface.segments import best_segments, power_law
from fem_seal.surface.statistics import RadialSpectrum, radial_spectrum

# Rings are gathered into bins of this ratio of wavenumbers, where they are finer.
BIN_RATIO = 1.06
# A Hann window makes neighbouring waves dependent: the variance of a mean over many grows by
# mean w⁴ / (mean w²)² along each axis (Welch, IEEE Trans. Audio Electroacoust. 15, 70 (1967)).
HANN_DEPENDENCE = (35 / 18) ** 2
# Bins before a cut-off that a window reaches.
SMEARED = 2
# Powers this far below the largest are roundings of a spectrum that is cut off.
ROUNDING = 1e-28


@dataclass(frozen=True, eq=False)
class SpectrumFit:
    """C(q) = C0 below q_r, C0 (q / q_r)^-(2 + 2H) above, between two cut-offs.

    hurst, hurst_error : H and its standard deviation
    rolloff_wavelength : λ_r = 2π/q_r [m]; None if no plateau is seen
    rolloff_error : standard deviation of λ_r [m]
    long_wavelength, short_wavelength : [m] where the power law with its plateau ends; None if it
        goes on to the last ring, so that the cut-off lies beyond what the map shows; known to
        the width of a bin, 6 % or one ring
    misfit : χ² per degree of freedom; the errors have been widened by its root where above 1
    spectrum : rings that were fitted
    wavenumber, density : the fitted C(q) [1/m], [m^4]
    """

    hurst: float
    hurst_error: float
    rolloff_wavelength: float | None
    rolloff_error: float | None
    long_wavelength: float | None
    short_wavelength: float | None
    misfit: float
    spectrum: RadialSpectrum
    wavenumber: np.ndarray
    density: np.ndarray


def fit_spectrum(field: GridField) -> SpectrumFit:
    """Fit the power law of a self-affine surface.

    The power of one wave of a Gaussian surface is exponentially distributed, so the logarithm of
    a mean over n independent ones has the bias ψ(n) - ln n and the variance ψ'(n): weights and
    errors follow from counting waves. Where plateau, power law and what lies beyond the
    cut-offs end is chosen by the Bayesian information criterion.

    Parameters
    ----------
    field : heights; weighted with a Hann window if they do not repeat

    Raises
    ------
    InvalidInput
        If the map is too small, flat, or shows no power law.
    """
    field, dependence = _repeating(field)
    spectrum = _rings(field)
    # Half of the waves are the conjugates of the others.
    independent = np.maximum(spectrum.modes / 2 / dependence, 1.0)
    x, y, variance = _bins(spectrum, independent)
    found = best_segments(x, y, variance)
    if found is None:
        raise InvalidInput(
            f"the spectrum of {field.shape[0]} x {field.shape[1]} samples shows no power law"
        )
    if dependence > 1 and found.stop < len(x):
        # The window smears the cut-off into the bin before it.
        stop = max(found.stop - SMEARED, found.knee + 2)
        edge, found = found.stop, replace(found, stop=stop)
    else:
        edge = found.stop
    first = power_law(x, y, variance, found)
    # Once more, with means over rings that know how steeply the spectrum falls inside them.
    spectrum = _sloped(spectrum, _rings(field, -first.slope), first.knee)
    x, y, variance = _bins(spectrum, independent)
    fit = power_law(x, y, variance, found)
    q = np.exp(x[found.start : found.stop])
    return SpectrumFit(
        hurst=-fit.slope / 2 - 1,
        hurst_error=fit.slope_error / 2,
        rolloff_wavelength=None if fit.knee is None else 2 * np.pi / np.exp(fit.knee),
        rolloff_error=None if fit.knee is None else 2 * np.pi / np.exp(fit.knee) * fit.knee_error,
        long_wavelength=_edge(x, found.start - 1, found.start > 0),
        short_wavelength=_edge(x, edge, edge < len(x)),
        misfit=fit.misfit,
        spectrum=spectrum,
        wavenumber=q,
        density=np.exp(fit.at(np.log(q))),
    )


def _edge(x: np.ndarray, index: int, seen: bool) -> float | None:
    """Wavelength of the bin between two segments."""
    return float(2 * np.pi / np.exp(x[index])) if seen else None


def _repeating(field: GridField) -> tuple[GridField, float]:
    """Weight a map that does not repeat with a window; and how much that ties waves together."""
    if field.periodic:
        return field, 1.0
    weights = window("hann", field.shape)
    mean = np.average(field.values, weights=weights**2)
    values = (field.values - mean) * weights / np.sqrt(np.mean(weights**2))
    return GridField(values, field.spacing, periodic=True), HANN_DEPENDENCE


def _rings(field: GridField, exponent: float = 0.0) -> RadialSpectrum:
    """Rings up to the Nyquist wavenumber; the corners beyond are not whole rings."""
    rings = radial_spectrum(field, exponent)
    whole = rings.wavenumber <= np.pi / max(field.spacing)
    if not rings.density[whole].any():
        raise InvalidInput("a flat surface has no spectrum")
    return RadialSpectrum(rings.wavenumber[whole], rings.density[whole], rings.modes[whole])


def _sloped(level: RadialSpectrum, falling: RadialSpectrum, knee: float | None) -> RadialSpectrum:
    """Rings of a plateau up to the knee, and of a power law beyond."""
    steep = np.log(level.wavenumber) > (-np.inf if knee is None else knee)
    density = np.where(steep, falling.density, level.density)
    return RadialSpectrum(level.wavenumber, density, level.modes)


def _bins(
    spectrum: RadialSpectrum, independent: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give ln q, ln C without bias and its variance, over bins of rings."""
    from scipy.special import digamma, polygamma

    log_q = np.log(spectrum.wavenumber)
    lowest = ROUNDING * spectrum.density.max()
    log_C = np.log(np.maximum(spectrum.density, lowest))
    log_C -= digamma(independent) - np.log(independent)
    weight = 1 / polygamma(1, independent)
    number = np.rint((log_q - log_q[0]) / np.log(BIN_RATIO)).astype(int)
    _, number = np.unique(number, return_inverse=True)
    total = np.bincount(number, weight)
    x, y = (np.bincount(number, weight * values) / total for values in (log_q, log_C))
    return x, y, 1 / total
