"""Wave vectors of a periodic grid, in the half plane that `rfft2` returns.

Of heights h on N samples, h(x) = Σ h̃(q) exp(i q·x) over all q, with h̃ = rfft2(h)/N on the half
plane, and its complex conjugate at -q on the other half.
"""

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField


def wavenumbers(shape: tuple[int, int], spacing: tuple[float, float]) -> np.ndarray:
    """|q| [1/m] of every mode of `rfft2`, (nx, ny // 2 + 1)."""
    (nx, ny), (dx, dy) = shape, spacing
    qx = 2 * np.pi * np.fft.fftfreq(nx, dx)
    qy = 2 * np.pi * np.fft.rfftfreq(ny, dy)
    return np.hypot(qx[:, None], qy[None, :])


def multiplicity(ny: int) -> np.ndarray:
    """Number (ny // 2 + 1,) of columns of the full transform that each of `rfft2` represents."""
    count = np.full(ny // 2 + 1, 2.0)
    count[0] = 1.0
    if ny % 2 == 0:
        count[-1] = 1.0
    return count


def mode_powers(field: GridField) -> np.ndarray:
    """|h̃(q)|² [m²] of the deviation from the mean, times `multiplicity`.

    The sum over the half plane is <h²> (Parseval).
    """
    from scipy import fft

    if not field.periodic:
        raise InvalidInput(
            "a spectrum needs a periodic surface; detrend and window it, and mark it periodic"
        )
    modes = fft.rfft2(field.values - field.values.mean()) / field.values.size
    return (modes.real**2 + modes.imag**2) * multiplicity(field.shape[1])
