"""What a contact by its area costs: transforms over those of the contact by the same pressure.

    python tests/benchmarks/contact_by_area.py [SAMPLES ...]     # 512 1024 if left out

Rough surfaces with λ_l = L/8 and λ_s of four samples, in contact on 1 to 70 % of their samples.
"""

import sys

from fem_seal.contact import press
from fem_seal.surface import Spectrum, self_affine

AREAS = (0.01, 0.05, 0.18, 0.4, 0.7)
E_STAR = 1e7  # Pa


def main(samples: list[int]) -> None:
    """Print a row for each surface and area."""
    print("samples  H    A/A0  pairs by area, by pressure  ratio")
    for n in samples:
        for hurst in (0.4, 0.8):
            spectrum = Spectrum(hurst, n / 8, 4)
            heights = self_affine(spectrum, (n, n), (n, n), rms_slope=0.1, seed=1)
            for area in AREAS:
                found = press(heights, E_STAR, area_fraction=area)
                again = press(heights, E_STAR, pressure=found.mean_pressure)
                print(
                    f"{n:7} {hurst:4} {area:5} {found.fft_pairs:10} {again.fft_pairs:15} "
                    f"{found.fft_pairs / again.fft_pairs:10.2f}",
                    flush=True,
                )


if __name__ == "__main__":
    main([int(n) for n in sys.argv[1:]] or [512, 1024])
