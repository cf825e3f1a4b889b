"""Wave vectors of a periodic grid, in the half plane that a real FFT keeps."""

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField


def wavenumbers(shape: tuple[int, int], spacing: tuple[float, float]) -> np.ndarray:
    """|q| [1/m] of every mode of ``rfft2``, shape (nx, ny // 2 + 1)."""
    (nx, ny), (dx, dy) = shape, spacing
    qx = 2 * np.pi * np.fft.fftfreq(nx, dx)
    qy = 2 * np.pi * np.fft.rfftfreq(ny, dy)
    return np.hypot(qx[:, None], qy[None, :])


def multiplicity(ny: int) -> np.ndarray:
    """How often each column of ``rfft2`` stands in the full transform: (ny // 2 + 1,) of 1 or 2."""
    twice = np.full(ny // 2 + 1, 2.0)
    twice[0] = 1.0
    if ny % 2 == 0:
        twice[-1] = 1.0
    return twice


def mode_powers(field: GridField) -> np.ndarray:
    """|h̃(q)|^2 of the deviation from the mean, so weighted that the sum is <h^2> (Parseval) [m^2].

    Raises
    ------
    InvalidInput
        If the field is not periodic: its jump at the border would pass for roughness.
    """
    from scipy import fft

    if not field.periodic:
        raise InvalidInput(
            "a spectrum needs a periodic surface; detrend and window it, and mark it periodic"
        )
    modes = fft.rfft2(field.values - field.values.mean()) / field.values.size
    return (modes.real**2 + modes.imag**2) * multiplicity(field.shape[1])
