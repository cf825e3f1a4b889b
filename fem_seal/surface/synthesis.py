"""Self-affine random surfaces; a seed gives the same surface on every grid and machine."""

import numpy as np

from fem_seal.arguments import require_known, require_positive
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField, require_grid_field
from fem_seal.memory import refuse_too_large
from fem_seal.surface.profiles import IsotropicSpectrum
from fem_seal.surface.spectrum import Spectrum, multiplicity, wavenumbers

# Peak memory [bytes a sample] beside the random numbers, measured at 1024 x 1024 samples.
SURFACE_BYTES = 56
SCALINGS = ("exact", "ensemble")
ORDER_OF_MOMENT = {"rms_height": 0, "rms_slope": 2}


def self_affine(
    spectrum: Spectrum,
    shape: tuple[int, int],
    size: tuple[float, float],
    *,
    rms_height: float | None = None,
    rms_slope: float | None = None,
    scaling: str = "exact",
    seed: int,
) -> GridField:
    """Gaussian random heights [m] of zero mean with ``<|h̃(q)|²> ∝ C(q)``.

    Every wave vector has its own index in the stream of random numbers, so that a finer grid
    samples the same surface: heights at common points agree to rounding if the coarser grid
    resolves the short cut-off (λ_s > 2 samples). Modes at the Nyquist wavenumber are set to 0,
    because a grid represents only their cosines. The highest points touch first.

    Parameters
    ----------
    spectrum
        Only its shape is used; the amplitude comes from `rms_height` or `rms_slope`.
        `short_wavelength` may be as short as one sample (as in Dapp et al., Phys. Rev. Lett. 108,
        244301 (2012)); below two samples the square of the grid's wave vectors cuts the disc off.
    size
        Periods (Lx, Ly) [m].
    rms_height, rms_slope
        Amplitude [m] or gradient; exactly one of them.
    scaling
        "exact" or "ensemble": whether this surface, or the mean square over all seeds, has that
        amplitude.
    """
    given = {"rms_height": rms_height, "rms_slope": rms_slope}
    amplitudes = {name: value for name, value in given.items() if value is not None}
    if len(amplitudes) != 1:
        raise InvalidInput(f"give either rms_height or rms_slope, got {amplitudes or 'neither'}")
    require_positive(**amplitudes)
    ((kind, amplitude),) = amplitudes.items()
    require_known(SCALINGS, scaling, "scaling")
    if len(shape) != 2 or not all(n == int(n) and n >= 1 for n in shape):
        raise InvalidInput(f"shape must be two positive numbers of samples, got {shape}")
    if len(size) != 2 or not all(np.isfinite(length) and length > 0 for length in size):
        raise InvalidInput(f"size must be two positive lengths in metres, got {size}")
    spectrum.require_room(shape, size)
    _require_memory(shape)
    q = wavenumbers(shape, (size[0] / shape[0], size[1] / shape[1]))
    ends = f"{spectrum.long_wavelength} and {spectrum.short_wavelength}"
    density = _of_grid(
        spectrum.density(q), shape, f"lies between the cut-offs {ends} m; widen them"
    )
    modes = np.sqrt(density) * _gaussian_modes(shape, seed)
    power = density if scaling == "ensemble" else modes.real**2 + modes.imag**2
    moment = np.sum(q ** ORDER_OF_MOMENT[kind] * power * multiplicity(shape[1]))
    return _heights(modes, shape, size, amplitude / moment**0.5)


def gaussian_surface(
    spectrum: IsotropicSpectrum, shape: tuple[int, int], size: tuple[float, float], *, seed: int
) -> GridField:
    """Gaussian random heights [m] of zero mean with a spectrum in the ensemble mean.

    Waves longer than the periods (Lx, Ly) [m], or shorter than two samples, are left out. The same
    seed on a finer grid gives the same surface with shorter waves.
    """
    _require_memory(shape)
    q = wavenumbers(shape, (size[0] / shape[0], size[1] / shape[1]))
    remedy = "has power in the spectrum of the profiles; take a larger size, or more samples"
    density = _of_grid(spectrum.density(q), shape, remedy)
    modes = np.sqrt(density * (2 * np.pi) ** 2 / (size[0] * size[1])) * _gaussian_modes(shape, seed)
    return _heights(modes, shape, size, 1.0)


def twin(field: GridField, seed: int) -> GridField:
    """Random surface with the power of every wave of another surface, and random phases.

    Anisotropy is kept. Features that the phases encode are lost: grooves, plateaus and pits become
    Gaussian roughness. Comparing the leak rates of a surface and its twins shows whether more than
    the spectrum matters.

    The heights [m] are periodic, and so is the twin, whose mean is the same.
    """
    from scipy import fft

    require_grid_field(field, "surface")
    if not field.periodic:
        raise InvalidInput("a twin needs a periodic surface; set make_periodic")
    modes = fft.rfft2(field.values)
    # Take the phases of white noise: they are independent and uniform, and opposite for ±q.
    raw = _stream(seed, field.values.size).reshape(field.shape)
    noise = fft.rfft2((raw >> np.uint64(11)) * 2.0**-53 - 0.5)
    phases = noise / np.abs(noise)
    phases[0, 0] = np.sign(modes[0, 0].real)
    values = fft.irfft2(np.abs(modes) * phases, s=field.shape)
    return GridField(values, field.spacing, periodic=True)


def _require_memory(shape: tuple[int, int]) -> None:
    nx, ny = shape
    size = SURFACE_BYTES * nx * ny + np.dtype(np.uint64).itemsize * _numbers_drawn(shape)
    refuse_too_large(size, f"a surface of {nx} x {ny} samples")


def _numbers_drawn(shape: tuple[int, int]) -> int:
    """Random numbers in all shells of a grid; a long one has many more than samples."""
    shells = max(shape) // 2
    return 2 * shells * (shells + 1) + 1


def _stream(seed: int, count: int) -> np.ndarray:
    """Random whole numbers; NumPy guarantees a raw stream for ever, but not its distributions."""
    if not isinstance(seed, int | np.integer) or seed < 0:
        raise InvalidInput(f"seed must be a non-negative integer, got {seed!r}")
    return np.random.Philox(seed).random_raw(count)


def _of_grid(density: np.ndarray, shape: tuple[int, int], otherwise: str) -> np.ndarray:
    """Density with the mean and the Nyquist modes of a grid set to 0; refused if no wave is left.

    The message says that no wave of the grid does what `otherwise` names.
    """
    nx, ny = shape
    density[0, 0] = 0.0
    if nx % 2 == 0:
        density[nx // 2] = 0.0
    if ny % 2 == 0:
        density[:, ny // 2] = 0.0
    if not density.any():
        raise InvalidInput(f"no wave of a {nx} x {ny} grid {otherwise}")
    return density


def _heights(
    modes: np.ndarray, shape: tuple[int, int], size: tuple[float, float], factor: float
) -> GridField:
    """Periodic heights with given modes of `rfft2`, times a factor."""
    from scipy import fft

    values = fft.irfft2(modes, s=shape, norm="forward", overwrite_x=True)
    return GridField(values * factor, (size[0] / shape[0], size[1] / shape[1]), periodic=True)


def _gaussian_modes(shape: tuple[int, int], seed: int) -> np.ndarray:
    """Complex normal modes (nx, ny // 2 + 1) of unit mean square of a real field."""
    nx, ny = shape
    kx = np.rint(np.fft.fftfreq(nx, 1.0) * nx).astype(np.int64)
    ky = np.arange(ny // 2 + 1)
    raw = _stream(seed, _numbers_drawn(shape))
    modes = np.empty((nx, len(ky)), dtype=complex)
    for row, k in enumerate(kx):
        draw = raw[_index_in_stream(k, ky)]
        radius = np.sqrt(-np.log(((draw >> np.uint64(32)) + 0.5) / 2**32))
        phase = (draw & np.uint64(2**32 - 1)) * (2 * np.pi / 2**32)
        modes[row] = radius * np.exp(1j * phase)
        if k < 0:
            modes[row, 0] = modes[row, 0].conj()
    return modes


def _index_in_stream(kx: int, ky: np.ndarray) -> np.ndarray:
    """Index of each wave vector (kx, ky >= 0), counted in square shells around the origin.

    Shell m = max(|kx|, ky) has 4m vectors of the half plane and starts at index 2m (m - 1): first
    the side ky = m, then kx = m, then kx = -m. On the axis ky = 0 the pair ±kx has one index.
    """
    m = np.maximum(abs(kx), ky)
    on_x = np.where((kx > 0) | (ky == 0), 2 * m + 1 + ky, 3 * m + ky)
    return np.maximum(2 * m * (m - 1) + np.where(ky == m, kx + m, on_x), 0)
