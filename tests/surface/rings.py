"""The Hurst exponent by a straight line through the rings of a spectrum."""

import numpy as np

from fem_seal.surface import radial_spectrum


def fitted_hurst(field, long_wavelength, short_wavelength):
    """Hurst exponent H of the line ln C = -(2 + 2H) ln q + const between two wavelengths [m].

    Least squares over the rings, weighted by their number of modes, since the variance of ln C of
    a ring is inversely proportional to it.
    """
    rings = radial_spectrum(field)
    inside = (rings.wavenumber >= 2 * np.pi / long_wavelength) & (
        rings.wavenumber <= 2 * np.pi / short_wavelength
    )
    inside &= rings.density > 0
    log_q, log_C = np.log(rings.wavenumber[inside]), np.log(rings.density[inside])
    slope = np.polyfit(log_q, log_C, 1, w=np.sqrt(rings.modes[inside]))[0]
    return float(-slope / 2 - 1)
