"""Power spectrum of a self-affine surface with hard cut-offs, and waves of a periodic grid.

Of heights h on N samples, h(x) = Σ h̃(q) exp(i q·x) over all q, with h̃ = rfft2(h)/N on the half
plane of wave vectors that `rfft2` returns, and its complex conjugate at -q on the other half.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.arguments import require_positive
from fem_seal.digits import length_text
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField


@dataclass(frozen=True)
class Spectrum:
    """Isotropic power spectrum C(q) of a self-affine surface.

    C(q) = C0 (q / q_r)^-(2 + 2H) for q_r <= q <= q_s, C0 on the plateau q_l <= q <= q_r and zero
    outside (Jacobs, Junge, Pastewka, Surf. Topogr.: Metrol. Prop. 5, 013001 (2017)), normalised as
    <h^2> = integral of C over the plane of wave vectors = 2π ∫ q C dq.
    """

    hurst: float  #: Hurst exponent H, 0 < H <= 1
    long_wavelength: float  #: cut-off λ_l = 2π/q_l [m]
    short_wavelength: float  #: cut-off λ_s = 2π/q_s [m], 0 < λ_s < λ_l
    #: λ_r = 2π/q_r, between the cut-offs; the long cut-off (no plateau) if left out [m]
    rolloff_wavelength: float | None = None
    plateau: float = 1.0  #: C0, the density at q_r [m^4]

    def __post_init__(self) -> None:
        if not 0 < self.hurst <= 1:
            raise InvalidInput(f"hurst must lie in (0, 1], got {self.hurst}")
        require_positive(plateau=self.plateau)
        long, short = self.long_wavelength, self.short_wavelength
        rolloff = long if self.rolloff_wavelength is None else self.rolloff_wavelength
        object.__setattr__(self, "rolloff_wavelength", rolloff)
        if not 0 < short < long < np.inf:
            raise InvalidInput(
                f"short_wavelength = {short:g} m must be below long_wavelength = {long:g} m"
            )
        if not short < rolloff <= long:
            raise InvalidInput(
                f"rolloff_wavelength = {rolloff:g} m must lie above short_wavelength = {short:g} m "
                f"and not above long_wavelength = {long:g} m"
            )

    def require_room(self, shape: tuple[int, int], size: tuple[float, float]) -> None:
        """Raise InvalidInput unless a grid (nx, ny) of a cell (Lx, Ly) [m] can hold all waves.

        One sample to the short cut-off is allowed, as in the letter, and rounding errors are.
        """
        grid = max(length / n for length, n in zip(size, shape, strict=True))
        if self.short_wavelength < grid * (1 - 1e-9):
            short, apart = (length_text(length, 6) for length in (self.short_wavelength, grid))
            raise InvalidInput(
                f"short_wavelength = {short} is finer than the grid, whose samples are {apart} "
                "apart; raise it or shape"
            )
        if self.long_wavelength > max(size) * (1 + 1e-9):
            long, *cell = (length_text(length, 6) for length in (self.long_wavelength, *size))
            raise InvalidInput(
                f"long_wavelength = {long} does not fit into the cell of size {' by '.join(cell)}"
            )

    @property
    def wavenumbers(self) -> tuple[float, float, float]:
        """(q_l, q_r, q_s) [1/m]."""
        rolloff = self.rolloff_wavelength or self.long_wavelength
        return (
            2 * np.pi / self.long_wavelength,
            2 * np.pi / rolloff,
            2 * np.pi / self.short_wavelength,
        )

    def density(self, q: np.ndarray) -> np.ndarray:
        """C(q) [m^4] at wavenumbers q [1/m], of any shape."""
        q = np.asarray(q, dtype=float)
        q_long, q_rolloff, q_short = self.wavenumbers
        # Rounding of 2π/λ must not exclude a wave at a cut-off, such as λ_l = L/8.
        inside = (q >= q_long * (1 - 1e-12)) & (q <= q_short * (1 + 1e-12))
        power_law = np.maximum(q, q_rolloff) / q_rolloff
        return self.plateau * inside * power_law ** (-2 - 2 * self.hurst)

    def moment(self, order: float) -> float:
        """2π ∫ q^(1 + order) C dq in closed form [m^(2 - order)]: <h^2> = moment(0)."""
        q_long, q_rolloff, q_short = self.wavenumbers
        plateau = (q_rolloff ** (2 + order) - q_long ** (2 + order)) / (2 + order)
        exponent, log_ratio = order - 2 * self.hurst, np.log(q_short / q_rolloff)
        # expm1 avoids cancellation if the exponent is close to 0 (order 2 at H near 1).
        sloped = np.expm1(exponent * log_ratio) / exponent if exponent else log_ratio
        return float(2 * np.pi * self.plateau * (plateau + q_rolloff ** (2 + order) * sloped))

    @property
    def rms_height(self) -> float:
        """Root mean square height of the ensemble [m]."""
        return self.moment(0) ** 0.5

    @property
    def rms_slope(self) -> float:
        """Root mean square gradient h'rms of the ensemble, h'rms^2 = 2π ∫ q^3 C dq."""
        return self.moment(2) ** 0.5


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
