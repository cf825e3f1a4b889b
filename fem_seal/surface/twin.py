"""A random surface with the spectrum of a given one."""

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField


def twin(field: GridField, seed: int) -> GridField:
    """Same power in every wave, anisotropy included, but random phases.

    What the phases held is lost: grooves, plateaus and pits become Gaussian roughness, so that
    the leak rates of a surface and its twins tell whether more than the spectrum matters.

    Parameters
    ----------
    field : periodic heights
    seed : non-negative

    Returns
    -------
    GridField, periodic, of the same mean.

    Raises
    ------
    InvalidInput
        If the field is not periodic or the seed negative.
    """
    from scipy import fft

    if not field.periodic:
        raise InvalidInput("a twin needs a periodic surface; set make_periodic")
    if not isinstance(seed, int | np.integer) or seed < 0:
        raise InvalidInput(f"seed must be a non-negative integer, got {seed!r}")
    nx, ny = field.shape
    modes = fft.rfft2(field.values)
    # White noise has independent, uniform phases, and those of ±q belong together already. Raw
    # bits are part of numpy's promise of reproducibility.
    raw = np.random.Philox(seed).random_raw(nx * ny).reshape(nx, ny)
    noise = fft.rfft2((raw >> np.uint64(11)) * 2.0**-53 - 0.5)
    phases = noise / np.abs(noise)
    phases[0, 0] = np.sign(modes[0, 0].real)
    values = fft.irfft2(np.abs(modes) * phases, s=field.shape)
    return GridField(values, field.spacing, periodic=True)
