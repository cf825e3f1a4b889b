"""Pairs of transforms of contacts by area and on paths of loads, for docs/measurements/contact.md.

    python tests/benchmarks/contact_costs.py areas [--sizes 512 1024]
    python tests/benchmarks/contact_costs.py pressure area_fraction [--sizes 256 512]

Rough surfaces, λ_l = L/8. By area: over the pairs of the contact by the same pressure, λ_s of four
samples. Paths: 20 warm-started loads over 20 cold solves. FFT pairs do not depend on the machine or
on what else runs on it. All states have a certificate of 1e-6.
"""

import argparse
from itertools import product

import numpy as np
from rough_gaps import Case

from fem_seal.contact import ElasticSolid, Load, press
from fem_seal.contact.predictor import extrapolated

AREAS = (0.01, 0.05, 0.18, 0.4, 0.7)
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
SOLID = ElasticSolid(10.0)  # so that E* h'rms = 1


def areas(sizes: list[int]) -> None:
    """Print a row for each surface and area."""
    print("samples  H    A/A0  pairs by area, by pressure  ratio")
    for n, hurst in product(sizes, (0.4, 0.8)):
        heights = Case(n, hurst, 4, 0, 1).heights()
        for area in AREAS:
            found = press(heights, SOLID, Load("area_fraction", area))
            again = press(heights, SOLID, Load("pressure", found.mean_pressure))
            ratio = found.fft_pairs / again.fft_pairs
            print(
                f"{n:7} {hurst:4} {area:5} {found.fft_pairs:10} {again.fft_pairs:15} {ratio:10.2f}",
                flush=True,
            )


def paths(sizes: list[int], kind: str) -> None:
    """Print one line a path."""
    print(f"{'n':>5} {'H':>4} {'λs':>3}  path {'cold pairs':>42} {'warm / cold':>12}")
    for n in sizes:
        for hurst, short in SURFACES:
            heights = Case(n, hurst, short, 0, 1).heights()
            for name, loads in PATHS[kind].items():
                states, cold, warm = [], 0.0, 0.0
                for load in (Load(kind, x) for x in loads):
                    cold += press(heights, SOLID, load).fft_pairs
                    state = press(heights, SOLID, load, start=extrapolated(load.value, states))
                    states.append((load.value, state))
                    warm += state.fft_pairs
                cells = f"{cold / len(loads):10.1f} {warm / cold:12.2f}"
                print(f"{n:5d} {hurst:4} {short:3}  {kind} {name:<32} {cells}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="+", choices=("areas", *PATHS))
    parser.add_argument("--sizes", type=int, nargs="+", default=[256])
    options = parser.parse_args()
    for part in options.parts:
        areas(options.sizes) if part == "areas" else paths(options.sizes, part)
