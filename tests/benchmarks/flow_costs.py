"""What bounds of leak rates cost: the first table of docs/measurements/bounds.md.

    python tests/benchmarks/flow_costs.py [--n 1024 --area 0.37 --rtol 0.02]

Elastic contacts between side walls, H = 0.8, long cut-off n/8, shortest wavelength four samples,
seed 1. The memory is that of the process with the libraries.
"""

import argparse

from rough_gaps import FLUID, Case, cost_of

from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, leak_rate

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


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, nargs="+", default=[])
    parser.add_argument("--area", type=float, default=0.4, help="of the gaps of --n")
    parser.add_argument("--rtol", type=float, default=0.05, help="the same")
    options = parser.parse_args()
    budgets([(n, options.area, options.rtol) for n in options.n] or BUDGETS)
