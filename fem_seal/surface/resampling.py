"""Resampling of a periodic surface on a finer or coarser grid."""

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField, require_grid_field


def resample(field: GridField, shape: tuple[int, int]) -> GridField:
    """Trigonometric interpolation onto another grid (nx, ny) of the same periods.

    On a finer grid it passes through the samples of `field`; modes at the old Nyquist wavenumber
    are divided equally between ±q, so that the result is real and of least slope. On a coarser grid
    modes at and above its Nyquist wavenumber are omitted.
    """
    from scipy.fft import irfft, rfft

    require_grid_field(field, "surface")
    if not field.periodic:
        raise InvalidInput(
            "the surface is not periodic, and resample needs its Fourier series; periodic_cell "
            "makes a periodic one of it"
        )
    if len(shape) != 2 or not all(n == int(n) and n >= 1 for n in shape):
        raise InvalidInput(f"shape must be two positive numbers of samples, got {shape}")
    values = field.values
    for axis, (old, new) in enumerate(zip(field.shape, shape, strict=True)):
        modes = np.moveaxis(rfft(values, axis=axis), axis, 0)[: min(old, new) // 2 + 1]
        if new < old and new % 2 == 0:
            modes[-1] = 0.0
        elif old < new and old % 2 == 0:
            modes[-1] *= 0.5
        values = irfft(np.moveaxis(modes, 0, axis), new, axis=axis) * (new / old)
    spacing = field.size[0] / shape[0], field.size[1] / shape[1]
    return GridField(values, spacing, periodic=True)
