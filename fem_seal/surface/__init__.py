"""Rough surfaces: spectra, random surfaces, statistics, resampling, measured maps.

Heights are those of the rigid counter-face: its highest points touch first.
"""

from fem_seal.surface.cell import cropped, periodic_cell
from fem_seal.surface.detrending import detrended
from fem_seal.surface.missing import fill
from fem_seal.surface.preparation import (
    Preparation,
    PreparedSurface,
    measured_surface,
    prepare,
)
from fem_seal.surface.profiles import (
    IsotropicSpectrum,
    ProfileSpectrum,
    isotropic_spectrum,
    profile_spectrum,
)
from fem_seal.surface.resampling import resample
from fem_seal.surface.spectrum import Spectrum
from fem_seal.surface.spectrum_fit import SpectrumFit, fit_spectrum, map_spectrum
from fem_seal.surface.spikes import outliers, spikes_caution, without_outliers
from fem_seal.surface.statistics import (
    Lay,
    MapStatistics,
    RadialSpectrum,
    radial_spectrum,
    rms_height,
    rms_slope,
)
from fem_seal.surface.synthesis import gaussian_surface, self_affine, twin
from fem_seal.surface.windows import kept_roughness, levelled_map, longest_wavelength
