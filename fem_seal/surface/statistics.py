"""Statistics of height maps; power spectrum of periodic surfaces."""

from dataclasses import dataclass

import numpy as np

from fem_seal.field_file.recorded import FieldMap
from fem_seal.grid import GridField, require_grid_field
from fem_seal.surface.spectrum import mode_powers, multiplicity, wavenumbers

SLOPE_ROUNDING = 1e-12  # mean square slope along a perfect lay over that across it, by rounding


@dataclass(frozen=True, eq=False)
class RadialSpectrum:
    """Power spectrum averaged over m rings of wave vectors."""

    wavenumber: np.ndarray  #: (m,), mean ``|q|`` of each ring [1/m]
    density: np.ndarray  #: (m,), mean of C(q) [m^4]
    modes: np.ndarray  #: (m,), number of wave vectors in each ring, in both half planes


@dataclass(frozen=True)
class MapStatistics:
    """Statistics of a map before or after a step of its preparation; missing points are ignored."""

    name: str  #: step after which these are
    samples: tuple[int, int]
    missing: int  #: number of missing points
    rms_height: float  #: root mean square deviation from the mean [m]
    #: root mean square of the differences of neighbours over their distance. The seam is left out,
    #: so that the slopes before and after the map is made periodic can be compared.
    rms_slope: float
    #: root mean square jump from the last row (or column) to the first one over that between
    #: neighbouring rows: about 1 if the map is smooth across its seam
    seam: float
    #: mean cube of the deviation from the mean over the cube of `rms_height`: 0 for Gaussian
    #: roughness, negative for plateaus with pits. 0 for a smooth face.
    skewness: float | None = None  # None in results of earlier versions

    @classmethod
    def of(cls, field: FieldMap | GridField, name: str = "") -> "MapStatistics":
        """Statistics of a map of heights [m] after a step."""
        values = field.values
        known = values[~np.isnan(values)]
        inside = [_mean_square(np.diff(values, axis=axis)) for axis in (0, 1)]
        across = [_mean_square(values[0] - values[-1]), _mean_square(values[:, 0] - values[:, -1])]
        slope = sum(square / d**2 for square, d in zip(inside, field.spacing, strict=True))
        seam = max((a / i) ** 0.5 if i > 0 else 0.0 for a, i in zip(across, inside, strict=True))
        nx, ny = values.shape
        rms = float(known.std()) if known.size else 0.0
        return cls(
            name,
            (nx, ny),
            values.size - known.size,
            rms,
            float(slope**0.5),
            float(seam),
            # Divide first: the cube of small heights is below the smallest double.
            float(np.mean(((known - known.mean()) / rms) ** 3)) if rms else 0.0,
        )


@dataclass(frozen=True)
class Lay:
    """Direction in which a surface is smoothest, as along the grooves of a ground face."""

    slopes: tuple[float, float]  #: rms slope along x and along y
    ratio: float  #: rms slope across the lay over that along it; 1 if isotropic, inf if perfect
    angle: float  #: of the lay, from x towards y, from 0 to 180 [degrees]
    #: samples along x and along y over which the differences for `ratio` and `angle` reach
    lags: tuple[int, int]

    @classmethod
    def of(cls, heights: FieldMap | GridField) -> "Lay":
        """Principal axes of the covariance of ∇h over the cells between samples.

        A tilt is no lay: it is the mean of ∇h. Cells with missing points do not count. The cells
        are as square as the samples allow, since the longer differences of a coarser axis miss
        short waves, which would look like a lay.
        """
        values, spacing = heights.values, heights.spacing
        lx, ly = (
            min(max(round(max(spacing) / d), 1), n - 1)
            for d, n in zip(spacing, values.shape, strict=True)
        )
        along = (values[lx:] - values[:-lx]) / (lx * spacing[0])
        across = (values[:, ly:] - values[:, :-ly]) / (ly * spacing[1])
        along, across = along[:, ly:] + along[:, :-ly], across[lx:] + across[:-lx]
        known = ~np.isnan(along + across)
        covariance = np.cov(along[known], across[known], bias=True) if known.any() else np.eye(2)
        (least, most), directions = np.linalg.eigh(covariance)
        angle = np.degrees(np.arctan2(directions[1, 0], directions[0, 0])) % 180
        ratio = np.inf if most else 1.0
        if least > SLOPE_ROUNDING * most:
            ratio = np.sqrt(most / least)
        slopes = [_mean_square(np.diff(values, axis=k) / d) ** 0.5 for k, d in enumerate(spacing)]
        return cls((slopes[0], slopes[1]), float(ratio), float(angle), (lx, ly))


def _mean_square(differences: np.ndarray) -> float:
    """Mean square of the differences between points that are not missing."""
    known = differences[~np.isnan(differences)]
    return float(np.mean(known**2)) if known.size else 0.0


def rms_height(field: GridField) -> float:
    """Root mean square deviation from the mean [m]."""
    require_grid_field(field, "surface")
    return float(field.values.std())


def rms_slope(field: GridField) -> float:
    """Root mean square gradient of the trigonometric interpolant, ``(Σ q² |h̃|²)^(1/2)``."""
    require_grid_field(field, "surface")
    q = wavenumbers(field.shape, field.spacing)
    return float(np.sum(q**2 * mode_powers(field)) ** 0.5)


def radial_spectrum(field: GridField, exponent: float = 0.0) -> RadialSpectrum:
    """C(q) of periodic heights averaged over rings of width 2π/min(Lx, Ly).

    Normalised as <h²> = ∫ C d²q, that is ``C = |h̃|² Lx Ly / (2π)²``. Each ring has the mean of
    C (q/q_ring)^exponent. For a power law C ∝ q^-exponent this is C at the wavenumber of the ring;
    the plain mean of a steep power law is larger.
    """
    area = field.size[0] * field.size[1]
    q = wavenumbers(field.shape, field.spacing)
    powers = mode_powers(field) * area / (2 * np.pi) ** 2
    counts = np.broadcast_to(multiplicity(field.shape[1]), q.shape)
    ring = np.rint(q / (2 * np.pi / min(field.size))).astype(int).ravel()
    # Ring 0 is the mean alone; waves along the longer side of an oblong cell belong to ring 1.
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
