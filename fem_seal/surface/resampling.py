"""Resampling of a periodic surface on a finer or coarser grid."""

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField


def resample(field: GridField, shape: tuple[int, int]) -> GridField:
    """Trigonometric interpolation onto another grid (nx, ny) of the same periods.

    On a finer grid it passes through the samples of `field`; modes at the old Nyquist wavenumber
    are divided equally between ±q, so that the result is real and of least slope. On a coarser grid
    modes at and above its Nyquist wavenumber are omitted.
    """
    from scipy.signal import resample as fourier

    if not field.periodic:
        raise InvalidInput("only a periodic surface can be resampled by its Fourier series")
    if len(shape) != 2 or not all(n == int(n) and n >= 1 for n in shape):
        raise InvalidInput(f"shape must be two positive numbers of samples, got {shape}")
    values = field.values
    for axis, (old, new) in enumerate(zip(field.shape, shape, strict=True)):
        values = fourier(values, new, axis=axis)
        if new < old and new % 2 == 0:
            # SciPy keeps the cosine of the new Nyquist wavenumber.
            sign = np.expand_dims((-1.0) ** np.arange(new), 1 - axis)
            values = values - sign * np.mean(sign * values, axis=axis, keepdims=True)
    spacing = field.size[0] / shape[0], field.size[1] / shape[1]
    return GridField(values, spacing, periodic=True)
