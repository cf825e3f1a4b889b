"""What flows cost in unknowns, CPU seconds and memory: tables of docs/measurements.

    python tests/benchmarks/flow_costs.py budgets [--n 1024 --area 0.37 --rtol 0.02]
    python tests/benchmarks/flow_costs.py tensor [--n 256]
    python tests/benchmarks/flow_costs.py differences [--n 128 256 512]

Elastic contacts, H = 0.8, long cut-off n/8, shortest wavelength four samples (finite differences:
one), seed 1. Budgets are of certified leak rates between side walls; the memory is that of the
process with the libraries. A tensor stands beside the leak rate with periodic sides at the same
tolerance. The elimination of finite differences spends its time in products of dense matrices: a
reference BLAS takes twice the time of an optimised one (on Debian: libopenblas0-serial in place of
libblas3).
"""

import argparse
from time import process_time

import numpy as np
from rough_gaps import FLUID, Case, cost_of

from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences
from fem_seal.flow import FlowSettings, leak_rate
from fem_seal.flow.cell_tensor import conductivity_tensor

BUDGETS = [
    (256, 0.41, 0.05),
    (256, 0.41, 0.02),
    (256, 0.23, 0.03),
    (512, 0.40, 0.03),
    (512, 0.22, 0.02),
    (1024, 0.37, 0.02),
    (2048, 0.37, 0.02),
    (4096, 0.20, 0.06),
    (4096, 0.37, 0.06),
]
PRODUCT = 512  # side of the matrices whose product is timed


def budgets(rows: list[tuple[int, float, float]]) -> None:
    """Print a row for each gap."""
    head = "n, A/A0, half-width, unknowns, levels, CG, CPU s, all levels / last, both solves / one"
    print("| " + head.replace(", ", " | ") + " | GB |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for n, area, rtol in rows:
        film, settings = GridFilm(Case(n, 0.8, 4, area, 1).gap()), FlowSettings(rtol=rtol, **FLUID)
        leak, cpu, memory = cost_of(lambda: leak_rate(film, settings))  # noqa: B023
        seconds = [sum(level.seconds.values()) for level in leak.levels]
        last = leak.levels[-1].seconds
        both = (last["primal"] + last["dual"]) / last["primal"]
        iterations = max(i for level in leak.levels for i in level.iterations.values())
        print(
            f"| {n} | {area:.2f} | ±{100 * leak.levels[-1].half_width:.2f} % "
            f"| {leak.unknowns} | {len(leak.levels)} | {iterations} | {cpu:.1f} "
            f"| {sum(seconds) / seconds[-1]:.1f} | {both:.1f} | {memory / 1e9:.2f} |",
            flush=True,
        )


def tensor(n: int) -> None:
    """Print the rows, and how much more leaks between straight ends."""
    for area in (0.20, 0.38):
        gap = Case(n, 0.8, 4, area, 1).gap()
        film = GridFilm(gap, sides="periodic")
        for rtol in (0.1, 0.03):
            of_cell, seconds, _ = cost_of(
                lambda: conductivity_tensor(gap, viscosity=FLUID["viscosity"], rtol=rtol)  # noqa: B023
            )
            leak, of_leak, _ = cost_of(lambda: leak_rate(film, FlowSettings(rtol=rtol, **FLUID)))  # noqa: B023
            print(
                f"| {area:.2f} | {rtol:g} | {of_cell.unknowns / 1e3:.1f}k | {seconds:.1f} "
                f"| {leak.unknowns / 1e3:.1f}k | {of_leak:.1f} |",
                flush=True,
            )
        mean = (of_cell.lower[0, 0] * of_cell.upper[0, 0]) ** 0.5 * FLUID["pressure_drop"]
        print(f"leak rate between straight ends: {leak.value / mean:.2f} of K*_xx Δp Ly/Lx")


def product_rate() -> float:
    """Multiplications and additions of a dense matrix product, in 1e9 per CPU second."""
    a = np.random.default_rng(0).random((PRODUCT, PRODUCT))
    start = process_time()
    repeats = 0
    while process_time() - start < 0.5:
        a @ a
        repeats += 1
    return 2e-9 * PRODUCT**3 * repeats / (process_time() - start)


def differences(sizes: list[int]) -> None:
    """Print a line for each size; elastic contact of A/A0 = 0.2, λ_s = 1 sample, periodic sides."""
    print(f"matrix product: {product_rate():.1f} GFlop/s")
    last = None
    for n in sizes:
        film = GridFilm(Case(n, 0.8, 1, 0.2, 1).gap(), sides="periodic")
        leak, seconds, memory = cost_of(lambda: by_differences(film, FlowSettings(**FLUID)))  # noqa: B023
        growth = "" if last is None else f", {seconds / last:.1f} times the last"
        last = seconds
        print(f"n = {n}: {leak.unknowns} unknowns, {seconds:.2f} s{growth}, {memory / 1e9:.2f} GB")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("part", choices=("budgets", "tensor", "differences"))
    parser.add_argument("--n", type=int, nargs="+", default=[])
    parser.add_argument("--area", type=float, default=0.4, help="of budgets for --n")
    parser.add_argument("--rtol", type=float, default=0.05, help="the same")
    options = parser.parse_args()
    if options.part == "budgets":
        budgets([(n, options.area, options.rtol) for n in options.n] or BUDGETS)
    elif options.part == "tensor":
        tensor(*options.n or [256])
    else:
        differences(options.n or [128, 256, 512])
