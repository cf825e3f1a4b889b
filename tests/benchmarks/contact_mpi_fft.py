"""What a transform of mpi4py-fft costs beside the contact's own, and whether it is right.

mpirun -n 2 python tests/benchmarks/contact_mpi_fft.py [--size 1024]     (needs mpi4py-fft)
"""

import argparse
import time

import numpy as np
from mpi4py import MPI
from mpi4py_fft import PFFT, newDistArray

REPEATS = 5


def main(size: int) -> None:
    """Print the error of forward and backward, and CPU time per pair of the first rank."""
    world = MPI.COMM_WORLD
    transform = PFFT(world, (size, size), axes=(0, 1), dtype=float)
    values = newDistArray(transform, False)
    values[...] = np.random.default_rng(world.rank).random(values.shape)
    given = values.copy()
    transform.forward(values)
    begun = time.process_time()
    for _ in range(REPEATS):
        transform.backward(transform.forward(values), values)
    milliseconds = 1e3 * (time.process_time() - begun) / REPEATS
    error = world.reduce(float(np.abs(values - given).max()), MPI.MAX)
    if world.rank == 0:
        print(f"{world.size} ranks: error {error:.1e}, {milliseconds:.1f} ms of CPU a pair")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=1024)
    main(parser.parse_args().size)
