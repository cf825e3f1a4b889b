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
    from scipy import fft

    if not field.periodic:
        raise InvalidInput("only a periodic surface can be resampled by its Fourier series")
    if len(shape) != 2 or not all(n == int(n) and n >= 1 for n in shape):
        raise InvalidInput(f"shape must be two positive numbers of samples, got {shape}")
    values = field.values
    for axis, n in enumerate(shape):
        modes = _padded(fft.rfft(values, axis=axis, norm="forward"), values.shape[axis], n, axis)
        values = fft.irfft(modes, n=n, axis=axis, norm="forward")
    spacing = field.size[0] / shape[0], field.size[1] / shape[1]
    return GridField(values, spacing, periodic=True)


def _padded(modes: np.ndarray, old: int, new: int, axis: int) -> np.ndarray:
    """Modes of `rfft` for `new` samples from those for `old` samples along an axis."""
    modes = np.moveaxis(modes, axis, 0)
    if new == old:
        return np.moveaxis(modes, 0, axis)
    out = np.zeros((new // 2 + 1, *modes.shape[1:]), dtype=complex)
    kept = min((old - 1) // 2, (new - 1) // 2) + 1
    out[:kept] = modes[:kept]
    if old % 2 == 0 and new > old:
        out[old // 2] = modes[old // 2] / 2
    return np.moveaxis(out, 0, axis)
