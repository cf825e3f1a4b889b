"""From profiles, as a stylus writes them, to the spectrum of an isotropic surface.

A profile along x of a surface with the spectrum C(q) has the spectrum

    C1(qx) = ∫ C(√(qx² + qy²)) dqy = 2 ∫ C(q) q dq / √(q² - qx²),    q from qx to infinity

(P. R. Nayak, J. Lubr. Technol. 93, 398 (1971); T. D. B. Jacobs, T. Junge, L. Pastewka, Surf.
Topogr.: Metrol. Prop. 5, 013001 (2017)), Abel's transform of C. It is inverted here for a C that is
constant between the edges of bins, for which it is a sum of square roots. The profiles of an
anisotropic surface, such as a turned or ground one, do not determine its spectrum.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fem_seal.arguments import choose, require_positive
from fem_seal.errors import InvalidInput
from fem_seal.surface.cell import HANN_DEPENDENCE
from fem_seal.surface.detrending import TREND_ROUNDING

# Ratio of the wavenumbers at the ends of a bin. The constant then differs from the mean of a power
# law with H = 0.8 by 2 %, and by 6 % in the bins next to its cut-offs.
LINE_BIN_RATIO = 1.25
FEWEST_SAMPLES = 16  # fewest samples of a profile
# Densities below this part of the largest are rounding errors beyond a cut-off.
DENSITY_ROUNDING = 1e-28
LINE_DEGREES = {"mean": 0, "line": 1, "quadratic": 2}


@dataclass(frozen=True, eq=False)
class ProfileSpectrum:
    """Mean spectrum of profiles in m bins of wavenumbers."""

    #: (m + 1,), edges of the bins [1/m]; the first is half of the lowest wavenumber
    edges: np.ndarray
    waves: tuple[np.ndarray, ...]  #: wavenumbers of the waves in each bin [1/m]
    #: (m,), mean of C1 [m³] over the waves of a bin, <h²> = ∫ C1 dq from -∞ to ∞
    density: np.ndarray
    #: (m,), its standard deviation, for Gaussian heights: density over the square root of the
    #: number of independent waves
    error: np.ndarray


@dataclass(frozen=True, eq=False)
class IsotropicSpectrum:
    """A spectrum that is constant in each of m rings."""

    edges: np.ndarray  #: (m + 1,), edges of the rings [1/m]
    values: np.ndarray  #: (m,), C(q) [m⁴] >= 0
    error: np.ndarray  #: (m,), its standard deviation; those of neighbours are correlated

    def __post_init__(self) -> None:
        ascending = self.edges[0] >= 0 and (np.diff(self.edges) > 0).all()
        if not (ascending and self.values.shape == (len(self.edges) - 1,)):
            raise InvalidInput("the edges of m rings are m + 1 ascending wavenumbers >= 0")
        if not self.values.min() >= 0:
            raise InvalidInput(f"a spectrum is not negative, got {self.values.min():g} m^4")

    def density(self, q: np.ndarray) -> np.ndarray:
        """C(q) [m⁴] at wavenumbers [1/m]; 0 below the first edge and above the last."""
        return np.pad(self.values, 1)[np.searchsorted(self.edges, q, side="right")]

    @property
    def wavenumbers(self) -> tuple[float, ...]:
        """Ends of the support, and the steps of C between them [1/m]."""
        return tuple(self.edges.tolist())

    @property
    def rms_height(self) -> float:
        """Root mean square height [m], 2π ∫ q C dq = <h²>."""
        return float((np.pi * np.sum(self.values * np.diff(self.edges**2))) ** 0.5)

    @property
    def rms_slope(self) -> float:
        """Root mean square gradient, 2π ∫ q³ C dq ``= <|∇h|²>``."""
        return float((np.pi / 2 * np.sum(self.values * np.diff(self.edges**4))) ** 0.5)


def profile_spectrum(
    profiles: np.ndarray, step: float, *, detrend: str = "line"
) -> ProfileSpectrum:
    """Mean spectrum of profiles under a Hann window.

    The two lowest wavenumbers, which the window mixes with the trend, are left out.

    Parameters
    ----------
    profiles : (k, n)
        Heights [m] of k profiles, so far apart that they are independent.
    step
        Distance of neighbouring samples [m].
    detrend
        "mean", "line" or "quadratic": trend that is subtracted from each profile.
    """
    from scipy.signal import get_window

    heights = np.atleast_2d(np.asarray(profiles, dtype=float))
    k, n = heights.shape
    if n < FEWEST_SAMPLES:
        raise InvalidInput(f"a profile needs at least {FEWEST_SAMPLES} samples, got {n}")
    if not np.isfinite(heights).all():
        missing = np.count_nonzero(~np.isfinite(heights))
        raise InvalidInput(f"{missing} samples of the profiles are missing; leave their ends out")
    require_positive(step=step)
    degree, x = choose(LINE_DEGREES, detrend, "detrend"), np.linspace(-1, 1, n)
    basis = np.polynomial.legendre.legvander(x, degree)
    trend = (basis @ np.linalg.lstsq(basis, heights.T, rcond=None)[0]).T
    if np.ptp(heights - trend) <= TREND_ROUNDING * np.abs(heights).max():
        raise InvalidInput("flat profiles have no spectrum")
    window = get_window("hann", n)
    window /= np.mean(window**2) ** 0.5
    powers = np.abs(np.fft.rfft((heights - trend) * window)) ** 2 / n**2
    C1 = np.mean(powers, axis=0) * n * step / (2 * np.pi)
    bounds = _bounds(3, (n + 1) // 2)  # without the Nyquist wave, which has only a cosine
    unit = 2 * np.pi / (n * step)
    waves = tuple(np.arange(a, b) * unit for a, b in pairwise(bounds))
    density = np.array([C1[a:b].mean() for a, b in pairwise(bounds)])
    independent = np.maximum(k * np.diff(bounds) / HANN_DEPENDENCE, k)
    edges = (np.array(bounds) - 0.5) * unit
    return ProfileSpectrum(edges, waves, density, density / independent**0.5)


def _bounds(first: int, end: int) -> list[int]:
    """Indices of the first wave of each bin, and `end`."""
    bounds = [first]
    while (following := max(bounds[-1] + 1, round(bounds[-1] * LINE_BIN_RATIO))) < end:
        bounds.append(following)
    # A last bin of less than half of its width joins the one before.
    if len(bounds) > 1 and end - bounds[-1] < (bounds[-1] - bounds[-2]) / 2:
        bounds.pop()
    return [*bounds, end]


def isotropic_spectrum(profiles: ProfileSpectrum) -> IsotropicSpectrum:
    """Spectrum of the isotropic surface whose profiles have a spectrum.

    It is a weighted least-squares fit with C >= 0. Beyond the last wavenumber the surface is
    assumed to have no power.
    """
    from scipy.optimize import nnls

    transform = np.array([_transform(waves, profiles.edges) for waves in profiles.waves])
    lowest = DENSITY_ROUNDING * profiles.density.max()
    weight = 1 / np.maximum(profiles.error, lowest)
    # Scale the columns to one size: C falls over many decades.
    scale = np.maximum(profiles.density, lowest) / transform.diagonal()
    scaled = transform * scale * weight[:, None]
    values = nnls(scaled, profiles.density * weight)[0] * scale
    inverse = np.linalg.inv(scaled)
    error = np.sqrt(np.sum(inverse**2, axis=1)) * scale
    return IsotropicSpectrum(profiles.edges, values, error)


def _transform(waves: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Mean over waves qx of 2 ∫ q dq / √(q² - qx²) over each ring, from qx on."""
    root = np.sqrt(np.maximum(edges**2 - waves[:, None] ** 2, 0))
    return 2 * np.diff(root, axis=1).mean(axis=0)
