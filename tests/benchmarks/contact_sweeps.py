"""What a load path costs: FFT pairs of 20 warm-started loads over those of 20 cold solves.

    python tests/benchmarks/contact_sweeps.py [--sizes 256 512]

FFT pairs do not depend on the machine or on what else runs on it. All states have a certificate of
1e-6 (the area search included where areas are prescribed).
"""

import argparse

import numpy as np

from fem_seal.contact import ElasticSolid, Load, load_path, press
from fem_seal.surface import Spectrum, self_affine

# (Hurst exponent, short cut-off in samples)
SURFACES = [(0.8, 1), (0.4, 1), (0.4, 4)]
# p / (E* h'rms), or A/A0
PATHS = {
    "pressure": {
        "0.0125 to 0.025, equal steps": np.linspace(0.0125, 0.025, 20),
        "0.2 to 0.4, equal steps": np.linspace(0.2, 0.4, 20),
        "0.02 to 0.4, equal steps": np.linspace(0.02, 0.4, 20),
        "0.004 to 0.4, equal ratios": np.geomspace(0.004, 0.4, 20),
    },
    "area_fraction": {
        "0.03 to 0.06, equal steps": np.linspace(0.03, 0.06, 20),
        "0.4 to 0.6, equal steps": np.linspace(0.4, 0.6, 20),
        "0.05 to 0.6, equal steps": np.linspace(0.05, 0.6, 20),
    },
}


def main(sizes: list[int], kinds: list[str], seed: int) -> None:
    """Print one line a path."""
    print(f"{'n':>5} {'H':>4} {'λs':>3}  path {'cold pairs':>42} {'warm / cold':>12}")
    for n in sizes:
        for hurst, short in SURFACES:
            spectrum = Spectrum(hurst, n / 8, short)
            heights = self_affine(spectrum, (n, n), (n, n), rms_slope=1, seed=seed)
            for kind in kinds:
                for name, loads in PATHS[kind].items():
                    cold = sum(press(heights, 1.0, **{kind: load}).fft_pairs for load in loads)
                    path = load_path(heights, ElasticSolid(1.0), [Load(kind, x) for x in loads])
                    warm = sum(state.fft_pairs for state in path)
                    cells = f"{cold / len(loads):10.1f} {warm / cold:12.2f}"
                    print(f"{n:5d} {hurst:4} {short:3}  {kind} {name:<32} {cells}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[256])
    parser.add_argument("--kinds", nargs="+", choices=PATHS, default=list(PATHS))
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    main(arguments.sizes, arguments.kinds, arguments.seed)
