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
        state = press(
            heights,
            ElasticSolid(1.0),
            Load("pressure", load),
            ContactStopping(solver),
            Arithmetic(precision=precision),
        )
        return state.pressure.values, time.process_time() - begun, state.fft_pairs

    return run


def theirs(heights: GridField, load: float, code: str) -> tuple[np.ndarray, float, float]:
    """Another code: pressure, CPU seconds without its imports; its FFT pairs are not counted."""
    return (*contact(code, heights, load), np.nan)


def main(sizes: list[int], loads: list[float], peers: list[str], seeds: list[int]) -> None:
    """Print one line a case, and the medians over surfaces and seeds."""
    codes = {
        "free-set-cg": ours("free-set-cg", "mixed"),
        "polonsky-keer": ours("polonsky-keer", "double"),
    }
    codes |= {name: partial(theirs, code=name) for name in peers}
    print(f"{'n':>5} {'H':>4} {'λs':>3} {'A/A0':>6}", *(f"{name:>26}" for name in codes))
    print(" " * 21, *(f"{'CPU s   pairs  cert':>26}" for _ in codes), "  CPU ratios to the first")
    ratios = defaultdict(list)
    for n in sizes:
        for seed in seeds:
            for hurst, short in SURFACES:
                spectrum = Spectrum(hurst, n / 8, short)
                heights = self_affine(spectrum, (n, n), (n, n), rms_slope=1, seed=seed)
                for load in loads:
                    name = f"{n:5d} {hurst:4} {short:3}"
                    ratios[n, load].append(one_case(name, heights, load, codes))
    print("medians, and least and largest")
    for (n, load), rows in ratios.items():
        columns = zip(np.median(rows, 0), np.min(rows, 0), np.max(rows, 0), strict=True)
        cells = ("{:6.1f} ({:.1f} to {:.1f})".format(*column) for column in columns)
        print(f"{n:5d} p = {load:<6}", *cells)


def one_case(name: str, heights: GridField, load: float, codes: dict[str, Code]) -> list[float]:
    """Run every code once on one surface and load, print, and return the ratios."""
    cells, seconds = [], []
    for code in codes.values():
        pressure, cpu, pairs = code(heights, load)
        seconds.append(cpu)
        _, reached = gap_of(pressure, heights, load)
        cells.append(f"{seconds[-1]:10.2f} {pairs:7.1f} {reached:.0e}")
        if len(cells) == 1:
            area = np.mean(pressure > 0)
    ratios = [second / seconds[0] for second in seconds[1:]]
    print(
        f"{name} {area:6.3f}",
        *(f"{cell:>26}" for cell in cells),
        " ".join(f"{ratio:6.1f}" for ratio in ratios),
        flush=True,
    )
    return ratios


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[512])
    parser.add_argument("--loads", type=float, nargs="+", default=LOADS)
    parser.add_argument("--peers", nargs="+", choices=CONTACT, default=[])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    arguments = parser.parse_args()
    main(arguments.sizes, arguments.loads, arguments.peers, arguments.seeds)
