"""Elastic contact beside its peers: CPU seconds and FFT pairs to one certificate, interleaved.

    python tests/benchmarks/contact_peers.py [--sizes 512 1024] [--seeds 1 2 3] [--peers tamaas]

All solvers get the same surface and load and one thread; each result's certificate is recomputed
here from the pressure it returned. Peers, if wanted: the Tamaas wheel (L. Frérot et al., J. Open
Source Softw. 5, 2121 (2020); `pip install tamaas`), which is serial, with FFTW built without
SIMD, so that our own Polonsky-Keer is the fairer measure of the algorithm; and the constrained
conjugate gradients of ContactMechanics (`pip install ContactMechanics`).
"""

import argparse
import time
from collections import defaultdict
from collections.abc import Callable

import numpy as np

from fem_seal.contact import solve
from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, self_affine

# (Hurst exponent, short cut-off in samples)
SURFACES = [(0.8, 1), (0.8, 4), (0.4, 1)]
# p / (E* h'rms) for contact areas of about 0.01, 0.05, 0.2, 0.42 and 0.6.
LOADS = [0.004, 0.02, 0.085, 0.205, 0.33]
TOLERANCE = 1e-6
Pressure = np.ndarray


def certificate(pressure: Pressure, heights: GridField, load: float) -> float:
    """Duality gap of any code's pressure (E* = 1), Σ p (g - min g) / (h_rms Σ p)."""
    pressure = np.maximum(pressure, 0)
    pressure = pressure * (load / pressure.mean())
    (nx, ny), (dx, dy) = heights.shape, heights.spacing
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(nx, dx)[:, None], np.fft.rfftfreq(ny, dy)[None, :])
    q[0, 0] = np.inf
    gap = np.fft.irfft2(2 / q * np.fft.rfft2(pressure), s=heights.shape) - heights.values
    return float(np.vdot(pressure, gap - gap.min()) / (pressure.sum() * heights.values.std()))


def tamaas(heights: GridField, load: float) -> tuple[Pressure, float]:
    """Polonsky-Keer-Rey of the Tamaas wheel; its tolerance 1e-6 gives certificates near 1e-6."""
    import tamaas as tm

    tm.set_log_level(tm.LogLevel.error)
    model = tm.Model(tm.model_type.basic_2d, list(heights.size), list(heights.shape))
    model.E, model.nu = 1.0, 0.0
    solver = tm.PolonskyKeerRey(model, np.array(heights.values), TOLERANCE)
    solver.max_iter = 20000
    solver.solve(load)
    return np.array(model.traction), np.nan


def contact_mechanics(heights: GridField, load: float) -> tuple[Pressure, float]:
    """Constrained conjugate gradients; it stops by penetration, here at 1e-6 of the rms height."""
    from ContactMechanics import PeriodicFFTElasticHalfSpace
    from ContactMechanics.Optimization import constrained_conjugate_gradients
    from SurfaceTopography import Topography

    substrate = PeriodicFFTElasticHalfSpace(heights.shape, 1.0, heights.size)
    topography = Topography(np.array(heights.values), heights.size, periodic=True)
    found = constrained_conjugate_gradients(
        substrate,
        topography,
        external_force=load * heights.size[0] * heights.size[1],
        pentol=TOLERANCE * heights.values.std(),
    )
    if not found.success:
        raise RuntimeError(found.message)
    return np.array(found.jac), np.nan


def ours(solver: str, precision: str) -> Callable[[GridField, float], tuple[Pressure, float]]:
    """One of our own methods."""

    def run(heights: GridField, load: float) -> tuple[Pressure, float]:
        state = solve(heights, 1.0, pressure=load, solver=solver, precision=precision)
        return state.pressure.values, state.fft_pairs

    return run


PEERS = {"tamaas": tamaas, "contact-mechanics": contact_mechanics}


def main(sizes: list[int], loads: list[float], peers: list[str], seeds: list[int]) -> None:
    """Print one line a case, and the medians over surfaces and seeds."""
    codes = {
        "free-set-cg": ours("free-set-cg", "mixed"),
        "polonsky-keer": ours("polonsky-keer", "double"),
    }
    codes |= {name: PEERS[name] for name in peers}
    print(f"{'n':>5} {'H':>4} {'λs':>3} {'A/A0':>6}", *(f"{name:>26}" for name in codes))
    print(" " * 21, *(f"{'CPU s   pairs  cert':>26}" for _ in codes), "  CPU ratios to the first")
    bumps = self_affine(Spectrum(0.8, 8, 2), (32, 32), (32, 32), rms_slope=1, seed=0)
    for code in codes.values():
        code(bumps, 0.1)  # imports
    ratios = defaultdict(list)
    for n in sizes:
        for seed in seeds:
            for hurst, short in SURFACES:
                spectrum = Spectrum(hurst, n / 8, short)
                heights = self_affine(spectrum, (n, n), (n, n), rms_slope=1, seed=seed)
                # Plans the transforms, also of the coarser grids that start a light contact:
                # FFTW's wisdom is kept.
                solve(heights, 1.0, pressure=min(loads))
                for load in loads:
                    name = f"{n:5d} {hurst:4} {short:3}"
                    ratios[n, load].append(one_case(name, heights, load, codes))
    print("medians, and least and largest")
    for (n, load), rows in ratios.items():
        columns = zip(np.median(rows, 0), np.min(rows, 0), np.max(rows, 0), strict=True)
        cells = ("{:6.1f} ({:.1f} to {:.1f})".format(*column) for column in columns)
        print(f"{n:5d} p = {load:<6}", *cells)


def one_case(name: str, heights: GridField, load: float, codes: dict[str, Callable]) -> list[float]:
    """Run every code once on one surface and load, print, and return the ratios."""
    cells, seconds = [], []
    for code in codes.values():
        begun = time.process_time()
        pressure, pairs = code(heights, load)
        seconds.append(time.process_time() - begun)
        reached = certificate(pressure, heights, load)
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
    parser.add_argument("--peers", nargs="+", choices=PEERS, default=[])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    arguments = parser.parse_args()
    main(arguments.sizes, arguments.loads, arguments.peers, arguments.seeds)
