"""What compiled, fused loops would save: the default's passes over its arrays, numpy beside numba.

    python tests/benchmarks/contact_fused.py [--sizes 512 1024]     (needs numba)

Timed are the passes of one iteration of the free-set conjugate gradients without the FFTs, as they
are (numpy, block by block) and as loops that numba compiles, in milliseconds of CPU time, the
least of 30; and for comparison the iteration's FFTs.
"""

import argparse
import time
from collections.abc import Callable

import numba
import numpy as np

from fem_seal.contact.free_set_cg import _Search
from fem_seal.contact.interface import Interface
from fem_seal.contact.problem import Problem
from fem_seal.surface import Spectrum, self_affine


@numba.njit
def look(pressure: np.ndarray, gap: np.ndarray, wall: np.ndarray) -> tuple[float, float]:
    """Subtract the wall; work and lowest gap."""
    work, lowest = 0.0, np.inf
    for i in range(gap.shape[0]):
        for j in range(gap.shape[1]):
            gap[i, j] -= wall[i, j]
            work += pressure[i, j] * gap[i, j]
            lowest = min(lowest, gap[i, j])
    return work, lowest


@numba.njit
def free_residual(
    pressure: np.ndarray, gap: np.ndarray, offset: float, free: np.ndarray, residual: np.ndarray
) -> None:
    """Mask of the free set, and the gap on it less its mean."""
    total, number = 0.0, 0
    for i in range(gap.shape[0]):
        for j in range(gap.shape[1]):
            is_free = pressure[i, j] > 0 or gap[i, j] < offset
            free[i, j] = is_free
            residual[i, j] = gap[i, j] - offset if is_free else 0.0
            total += residual[i, j]
            number += is_free
    mean = total / number
    for i in range(gap.shape[0]):
        for j in range(gap.shape[1]):
            residual[i, j] -= mean * free[i, j]


@numba.njit
def around(values: np.ndarray, i: int, j: int) -> float:
    """Sum of the four periodic neighbours."""
    nx, ny = values.shape
    return (
        values[i - 1, j]
        + values[i + 1 if i + 1 < nx else 0, j]
        + values[i, j - 1]
        + values[i, j + 1 if j + 1 < ny else 0]
    )


@numba.njit
def extend(free: np.ndarray, residual: np.ndarray, scratch: np.ndarray, out: np.ndarray) -> None:
    """E residual."""
    nx, ny = free.shape
    for i in range(nx):
        for j in range(ny):
            scratch[i, j] = residual[i, j] + (1 - free[i, j]) / 4 * around(residual, i, j)
    for i in range(nx):
        for j in range(ny):
            out[i, j] = residual[i, j] + (1 - free[i, j]) / 4 * around(scratch, i, j)


@numba.njit
def gather(free: np.ndarray, values: np.ndarray, scratch: np.ndarray) -> None:
    """Eᵀ values."""
    nx, ny = free.shape
    for _ in range(2):
        for i in range(nx):
            for j in range(ny):
                scratch[i, j] = (1 - free[i, j]) / 4 * values[i, j]
        for i in range(nx):
            for j in range(ny):
                values[i, j] = values[i, j] * free[i, j] + around(scratch, i, j)


def least(run: Callable[[], object]) -> float:
    """CPU time of one run [ms], the least of 30."""
    run()
    times = []
    for _ in range(30):
        begun = time.process_time()
        run()
        times.append(time.process_time() - begun)
    return 1e3 * min(times)


def compare(n: int) -> None:
    """Print the passes of one iteration on n x n samples."""
    heights = self_affine(Spectrum(0.8, n / 8, 1), (n, n), (n, n), rms_slope=1, seed=1)
    interface = Interface.prepared(heights, 1.0)
    half_space = interface.half_space
    pressure = np.maximum(heights.values - heights.values.std(), 0)
    search = _Search(Problem(interface.heights, half_space, mean_pressure=0.1), pressure)
    gap, residual, steer = search.gap, search.residual, search.steer
    extension, free = search.extension, search.free
    displaced = least(half_space.displace)

    def extended() -> None:
        extension.update()
        extension.extend(residual, steer)
        extension.gather(steer)

    def extended_numba() -> None:
        extend(free, residual, extension.scratch, steer)
        gather(free, steer, extension.scratch)

    looks = least(search.look) - displaced, least(lambda: look(pressure, gap, search.wall))
    rows = {
        "look": looks,
        "free residual": (
            least(search.free_residual),
            least(lambda: free_residual(pressure, gap, 0.0, free, residual)),
        ),
        "extension": (least(extended), least(extended_numba)),
    }
    for name, times in rows.items():
        print(f"{n:5d} {name:<16}", *(f"{each:8.2f}" for each in times))
    steer[...] = 0
    steered = least(half_space.precondition) + least(half_space.curvature)
    print(f"{n:5d} {'FFTs, 2.5 pairs':<16} {displaced + steered:8.2f}", flush=True)


def main(sizes: list[int]) -> None:
    """Print a table."""
    print(f"{'n':>5} {'pass':<16} {'numpy':>8} {'numba':>8}")
    for n in sizes:
        compare(n)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[512])
    main(parser.parse_args().sizes)
