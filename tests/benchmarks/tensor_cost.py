"""What a conductivity tensor costs beside the leak rate, for docs/measurements/bounds.md.

    python tests/benchmarks/tensor_cost.py [--n 256]

Elastic contacts, H = 0.8, long cut-off n/8, shortest wavelength four samples, seed 1; the leak rate
with periodic sides at the same tolerance; CPU seconds of all levels.
"""

import argparse
import time

from rough_gaps import Case

from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, leak_rate
from fem_seal.flow.cell_tensor import conductivity_tensor

VISCOSITY, PRESSURE_DROP = 1e-3, 1e5


def main(n: int) -> None:
    """Print the rows, and how much more leaks between straight ends."""
    for area in (0.20, 0.38):
        gap = Case(n, 0.8, 4, area, 1).gap()
        for rtol in (0.1, 0.03):
            started = time.process_time()
            tensor = conductivity_tensor(gap, viscosity=VISCOSITY, rtol=rtol)
            between = time.process_time()
            leak = leak_rate(
                GridFilm(gap, sides="periodic"),
                FlowSettings(viscosity=VISCOSITY, pressure_drop=PRESSURE_DROP, rtol=rtol),
            )
            ended = time.process_time()
            print(
                f"| {area:.2f} | {rtol:g} | {tensor.unknowns / 1e3:.1f}k | {between - started:.1f} "
                f"| {leak.unknowns / 1e3:.1f}k | {ended - between:.1f} |",
                flush=True,
            )
        mean = (tensor.lower[0, 0] * tensor.upper[0, 0]) ** 0.5 * PRESSURE_DROP
        print(f"leak rate between straight ends: {leak.value / mean:.2f} of K*_xx Δp Ly/Lx")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, default=256)
    main(parser.parse_args().n)
