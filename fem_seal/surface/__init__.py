"""Rough surfaces: spectra, random surfaces, statistics, resampling and height files.

Heights are those of the rigid counter-face: its highest points touch first.
"""

from fem_seal.surface.measured import load_heights
from fem_seal.surface.resampling import resample
from fem_seal.surface.spectrum import Spectrum
from fem_seal.surface.statistics import (
    RadialSpectrum,
    fitted_hurst,
    radial_spectrum,
    rms_height,
    rms_slope,
)
from fem_seal.surface.synthesis import self_affine

__all__ = [
    "RadialSpectrum",
    "Spectrum",
    "fitted_hurst",
    "load_heights",
    "radial_spectrum",
    "resample",
    "rms_height",
    "rms_slope",
    "self_affine",
]
