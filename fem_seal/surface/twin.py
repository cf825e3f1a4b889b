"""Twin of a surface: a random surface with the same power spectrum."""

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField


def twin(field: GridField, seed: int) -> GridField:
    """Random surface with the power of every wave of another surface, and random phases.

    Anisotropy is kept. Features that the phases encode are lost: grooves, plateaus and pits become
    Gaussian roughness. Comparing the leak rates of a surface and its twins shows whether more than
    the spectrum matters.

    Parameters
    ----------
    field : heights [m], periodic
    seed : non-negative

    Returns
    -------
    GridField, periodic, of the same mean.
    """
    from scipy import fft

    if not field.periodic:
        raise InvalidInput("a twin needs a periodic surface; set make_periodic")
    if not isinstance(seed, int | np.integer) or seed < 0:
        raise InvalidInput(f"seed must be a non-negative integer, got {seed!r}")
    nx, ny = field.shape
    modes = fft.rfft2(field.values)
    # Take the phases of white noise: they are independent and uniform, and opposite for ±q. NumPy
    # guarantees the raw stream of a bit generator for ever, but not its distributions.
    raw = np.random.Philox(seed).random_raw(nx * ny).reshape(nx, ny)
    noise = fft.rfft2((raw >> np.uint64(11)) * 2.0**-53 - 0.5)
    phases = noise / np.abs(noise)
    phases[0, 0] = np.sign(modes[0, 0].real)
    values = fft.irfft2(np.abs(modes) * phases, s=field.shape)
    return GridField(values, field.spacing, periodic=True)
