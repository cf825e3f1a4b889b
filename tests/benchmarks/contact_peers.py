"""Elastic contact beside its peers: CPU seconds and FFT pairs to one certificate, interleaved.

    make peers
    .venv/bin/python tests/benchmarks/contact_peers.py [--sizes 512 1024] [--seeds 1 2 3] \
        [--peers tamaas contact-mechanics]

All solvers get the same surface and load and one thread; each result's certificate is recomputed
here from the pressure it returned. Our own Polonsky-Keer, on the same FFT, is the fairer measure of
the algorithm than the wheel of Tamaas (`peer_codes.py`), whose FFTW has no SIMD.
"""

import argparse
import time
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from itertools import product

import numpy as np
from peer_codes import CONTACT, contact, gap_of

from fem_seal.contact import Arithmetic, ContactStopping, ElasticSolid, Load, press
from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, self_affine

# (Hurst exponent, short cut-off in samples)
SURFACES = [(0.8, 1), (0.8, 4), (0.4, 1)]
# p / (E* h'rms) for contact areas of about 0.01, 0.05, 0.2, 0.42 and 0.6.
LOADS = [0.004, 0.02, 0.085, 0.205, 0.33]
Code = Callable[[GridField, float], tuple[np.ndarray, float, float]]


def ours(solver: str, precision: str) -> Code:
    """One of our own methods: pressure, CPU seconds, FFT pairs."""

    def run(heights: GridField, load: float) -> tuple[np.ndarray, float, float]:
        begun = time.process_time()
        settings = ContactStopping(solver), Arithmetic(precision=precision)
        state = press(heights, ElasticSolid(1.0), Load("pressure", load), *settings)
        return state.pressure.values, time.process_time() - begun, state.fft_pairs

    return run


def theirs(heights: GridField, load: float, code: str) -> tuple[np.ndarray, float, float]:
    """Another code: pressure, CPU seconds without its imports; its FFT pairs are not counted."""
    return (*contact(code, heights, load), np.nan)


def main(sizes: list[int], loads: list[float], peers: list[str], seeds: list[int]) -> None:
    """Print one line a case and code, and the medians over surfaces and seeds."""
    codes = {
        "free-set-cg": ours("free-set-cg", "mixed"),
        "polonsky-keer": ours("polonsky-keer", "double"),
    }
    codes |= {name: partial(theirs, code=name) for name in peers}
    ratios = defaultdict(list)
    for n, seed, (hurst, short), load in product(sizes, seeds, SURFACES, loads):
        heights = self_affine(Spectrum(hurst, n / 8, short), (n, n), (n, n), rms_slope=1, seed=seed)
        first = None
        for name, code in codes.items():
            pressure, cpu, pairs = code(heights, load)
            first = first or cpu
            ratios[n, load, name].append(cpu / first)
            _, reached = gap_of(pressure, heights, load)
            print(
                f"n {n} H {hurst} λs {short} A/A0 {np.mean(pressure > 0):.3f} {name:18} "
                f"{cpu:8.2f} s {pairs:7.1f} pairs, certificate {reached:.0e}",
                flush=True,
            )
    print("CPU over that of the first code: median, least and largest")
    for (n, load, name), times in ratios.items():
        middle, least, largest = np.median(times), min(times), max(times)
        print(f"n {n} p = {load:<6} {name:18} {middle:6.1f} ({least:.1f} to {largest:.1f})")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[512])
    parser.add_argument("--loads", type=float, nargs="+", default=LOADS)
    parser.add_argument("--peers", nargs="+", choices=CONTACT, default=[])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    arguments = parser.parse_args()
    main(arguments.sizes, arguments.loads, arguments.peers, arguments.seeds)
