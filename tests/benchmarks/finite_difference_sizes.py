"""CPU time of the elimination over the size of the grid, and how fast the BLAS beneath it is.

Elastic contact of A/A0 = 0.2, λ_s = 1 sample. The work grows like n² log n in the tiles and n³ in
the separators, both in products of dense matrices: a reference BLAS takes twice the time of an
optimised one (on Debian: libopenblas0-serial in place of libblas3).

    python tests/benchmarks/finite_difference_sizes.py [n ...]
"""

import sys
from time import process_time

import numpy as np
from rough_gaps import Case

from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences
from fem_seal.memory import peak_memory

PRODUCT = 512


def product_rate() -> float:
    """Multiplications and additions of a dense matrix product, in 1e9 per CPU second."""
    a = np.random.default_rng(0).random((PRODUCT, PRODUCT))
    start = process_time()
    repeats = 0
    while process_time() - start < 0.5:
        a @ a
        repeats += 1
    return 2e-9 * PRODUCT**3 * repeats / (process_time() - start)


def main() -> None:
    sizes = [int(word) for word in sys.argv[1:]] or [128, 256, 512]
    print(f"matrix product: {product_rate():.1f} GFlop/s")
    last = None
    for n in sizes:
        gap = Case(n, 0.8, 1, 0.2, 1).gap()
        start = process_time()
        leak = by_differences(GridFilm(gap, sides="periodic"), viscosity=1e-3, pressure_drop=1e5)
        seconds = process_time() - start
        growth = "" if last is None else f", {seconds / last:.1f} times the last"
        last = seconds
        print(
            f"n = {n}: {leak.unknowns} unknowns, {seconds:.2f} s{growth}, "
            f"{peak_memory() / 1e9:.2f} GB so far"
        )


if __name__ == "__main__":
    main()
