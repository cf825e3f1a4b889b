"""What flows cost in unknowns, CPU seconds and memory: tables of docs/measurements.

    python tests/benchmarks/flow_costs.py budgets [--n 1024 --area 0.37 --rtol 0.02]
    python tests/benchmarks/flow_costs.py tensor [--n 256]

Elastic contacts, H = 0.8, long cut-off n/8, shortest wavelength four samples, seed 1. Budgets are
of certified leak rates between side walls; the memory is that of the process with the libraries. A
tensor stands beside the leak rate with periodic sides at the same tolerance.
"""

import argparse

from rough_gaps import FLUID, Case, cost_of

from fem_seal.film import GridFilm
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


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("part", choices=("budgets", "tensor"))
    parser.add_argument("--n", type=int, nargs="+", default=[])
    parser.add_argument("--area", type=float, default=0.4, help="of budgets for --n")
    parser.add_argument("--rtol", type=float, default=0.05, help="the same")
    options = parser.parse_args()
    if options.part == "budgets":
        budgets([(n, options.area, options.rtol) for n in options.n] or BUDGETS)
    else:
        tensor(*options.n or [256])
