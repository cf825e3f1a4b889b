"""Moments of the spectrum in closed form, and invalid arguments."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from fem_seal.surface import Spectrum

BANDS = [(1.0, 0.01, None), (1.0, 0.01, 0.2), (3e-4, 2e-6, 5e-5)]


@pytest.mark.parametrize("hurst", [0.1, 0.4, 0.8, 1.0])
@pytest.mark.parametrize("band", BANDS)
@pytest.mark.parametrize("order", [0, 2, 4])
def test_moments_against_quadrature(hurst, band, order):
    long, short, rolloff = band
    spectrum = Spectrum(hurst, long, short, rolloff, plateau=3.0)
    q_long, q_rolloff, q_short = spectrum.wavenumbers

    def integrand(log_q):
        q = np.exp(log_q)
        return 2 * np.pi * q ** (2 + order) * float(spectrum.density(q))

    limits = np.log([q_long, q_rolloff, q_short])
    parts = [quad(integrand, a, b, epsrel=1e-11)[0] for a, b in pairwise(limits)]
    # The density's band is 1e-12 wider than the cut-offs: far below quad's 1e-11.
    assert spectrum.moment(order) == pytest.approx(sum(parts), rel=1e-9)


def test_power_law_plateau_and_cut_offs():
    spectrum = Spectrum(0.8, 1.0, 0.01, 0.1, plateau=5.0)
    q_long, q_rolloff, q_short = spectrum.wavenumbers
    q = np.array([0.99 * q_long, q_long, q_rolloff, 3 * q_rolloff, q_short, 1.01 * q_short])
    expected = np.array([0, 5, 5, 5 * 3**-3.6, 5 * (q_short / q_rolloff) ** -3.6, 0])
    assert spectrum.density(q) == pytest.approx(expected, rel=1e-9)
