"""Statistics of any map, and of periodic surfaces: power spectrum and Hurst exponent."""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.recorded import FieldMap
from fem_seal.grid import GridField
from fem_seal.surface.waves import mode_powers, multiplicity, wavenumbers


@dataclass(frozen=True, eq=False)
class RadialSpectrum:
    """Power spectrum averaged over rings of wave vectors.

    wavenumber : (m,) [1/m], mean |q| of the ring
    density : (m,) [m^4], mean of C
    modes : (m,), number of wave vectors in the ring (both half planes)
    """

    wavenumber: np.ndarray
    density: np.ndarray
    modes: np.ndarray


@dataclass(frozen=True)
class MapStatistics:
    """Numbers that show what a step did to a map; missing points do not count.

    shape : samples
    missing : number of missing points
    rms_height : [m]
    rms_slope : root mean square of the differences of neighbours over their distance, without the
        seam, so that it means the same before and after a map is made periodic
    seam : the root mean square jump from the last line of samples to the first, over that of
        neighbours inside: about 1 where the map repeats smoothly
    """

    shape: tuple[int, int]
    missing: int
    rms_height: float
    rms_slope: float
    seam: float

    @classmethod
    def of(cls, found: FieldMap | GridField) -> "MapStatistics":
        """Measure a map."""
        values = found.values
        known = values[~np.isnan(values)]
        inside = [_mean_square(np.diff(values, axis=axis)) for axis in (0, 1)]
        across = [_mean_square(values[0] - values[-1]), _mean_square(values[:, 0] - values[:, -1])]
        slope = sum(square / d**2 for square, d in zip(inside, found.spacing, strict=True))
        seam = max((a / i) ** 0.5 if i > 0 else 0.0 for a, i in zip(across, inside, strict=True))
        return cls(
            values.shape,
            values.size - known.size,
            float(known.std()) if known.size else 0.0,
            float(slope**0.5),
            float(seam),
        )


def _mean_square(differences: np.ndarray) -> float:
    known = differences[~np.isnan(differences)]
    return float(np.mean(known**2)) if known.size else 0.0


def rms_height(field: GridField) -> float:
    """Root mean square deviation from the mean [m]."""
    return float(field.values.std())


def rms_slope(field: GridField) -> float:
    """Root mean square gradient of the trigonometric interpolant, (Σ q^2 |h̃|^2)^(1/2).

    Raises
    ------
    InvalidInput
        If the field is not periodic.
    """
    q = wavenumbers(field.shape, field.spacing)
    return float(np.sum(q**2 * mode_powers(field)) ** 0.5)


def radial_spectrum(field: GridField, exponent: float = 0.0) -> RadialSpectrum:
    """C(q) averaged over rings as wide as the grid's largest step of wavenumber.

    Normalised as <h^2> = ∫ C d^2q, that is C = |h̃|^2 Lx Ly / (2π)^2.

    Parameters
    ----------
    field : periodic heights
    exponent : the mean of C (q / q_ring)^exponent is taken: with that of a power law
        C ~ q^-exponent, the mean over a ring is C at its wavenumber, whereas the plain mean of a
        steep one lies above

    Raises
    ------
    InvalidInput
        If the field is not periodic.
    """
    area = field.size[0] * field.size[1]
    q = wavenumbers(field.shape, field.spacing)
    powers = mode_powers(field) * area / (2 * np.pi) ** 2
    counts = np.broadcast_to(multiplicity(field.shape[1]), q.shape)
    ring = np.rint(q / (2 * np.pi / min(field.size))).astype(int).ravel()
    # The long waves of an oblong cell belong to the first ring; ring 0 is the mean alone.
    ring[1:] = np.maximum(ring[1:], 1)
    modes = np.bincount(ring, counts.ravel())
    filled = (modes > 0) & (np.arange(len(modes)) > 0)
    wavenumber = np.bincount(ring, (q * counts).ravel())[filled] / modes[filled]
    powers = powers.ravel()
    if exponent:
        mean = np.ones(len(modes))
        mean[filled] = wavenumber
        powers = powers * (q.ravel() / mean[ring]) ** exponent
    density = np.bincount(ring, powers)[filled] / modes[filled]
    return RadialSpectrum(wavenumber, density, modes[filled])


def fitted_hurst(field: GridField, long_wavelength: float, short_wavelength: float) -> float:
    """Hurst exponent of the straight line log C = -(2 + 2H) log q + const between two wavelengths.

    Least squares over the rings, weighted by their number of modes (the variance of log C of a
    ring falls as its inverse).

    Raises
    ------
    InvalidInput
        If fewer than three rings lie between the wavelengths or the field is not periodic.
    """
    rings = radial_spectrum(field)
    inside = (rings.wavenumber >= 2 * np.pi / long_wavelength) & (
        rings.wavenumber <= 2 * np.pi / short_wavelength
    )
    inside &= rings.density > 0
    if inside.sum() < 3:
        raise InvalidInput(
            f"only {inside.sum()} rings of wave vectors lie between {long_wavelength} and "
            f"{short_wavelength} m; a slope needs three"
        )
    log_q, log_C = np.log(rings.wavenumber[inside]), np.log(rings.density[inside])
    slope = np.polyfit(log_q, log_C, 1, w=np.sqrt(rings.modes[inside]))[0]
    return float(-slope / 2 - 1)
