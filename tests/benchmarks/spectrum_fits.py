"""Hurst exponents fitted to surfaces made with a known one, for docs/measurements/surfaces.md.

    python tests/benchmarks/spectrum_fits.py [n ...]

H = 0.8, short cut-off four samples, sixteen surfaces each: periodic cells of n² samples with a long
cut-off of n/4, and pieces of n² cut out of cells twice as long, whose long cut-off is their side.
"""

import sys

import numpy as np

from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, fit_spectrum, self_affine

HURST, SHORT, SURFACES = 0.8, 4.0, 16


def made(n: int, long: float, seed: int) -> GridField:
    """Periodic cell of n² samples."""
    return self_affine(Spectrum(HURST, long, SHORT), (n, n), (n, n), rms_slope=0.1, seed=seed)


def piece(n: int, seed: int) -> GridField:
    """Map of n² samples that does not repeat."""
    large = made(2 * n, 2 * n, seed)
    return GridField(large.values[:n, :n], large.spacing)


def main() -> None:
    """Print a line for cells and one for pieces of each size."""
    for n in [int(word) for word in sys.argv[1:]] or [128, 256, 512]:
        for kind in ("cell", "piece"):
            fits = []
            for seed in range(SURFACES):
                field = made(n, n / 4, seed) if kind == "cell" else piece(n, seed)
                fits.append(fit_spectrum(field))
            hurst, error = np.transpose([(fit.hurst, fit.hurst_error) for fit in fits])
            short = [fit.short_wavelength or np.nan for fit in fits]
            print(
                f"{n}² {kind:5}: H = {hurst.mean():.3f}, spread {hurst.std():.3f}, "
                f"claimed {error.mean():.3f}, short cut-off {min(short):.2f} to {max(short):.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
