"""Unknowns, CPU seconds and memory of certified leak rates, one row for each gap.

    python tests/benchmarks/adaptive_budgets.py        # the rows of docs/measurements/bounds.md
    python tests/benchmarks/adaptive_budgets.py --n 1024 --area 0.37 --rtol 0.02 --seed 7

Elastic contacts, side walls, H = 0.8, long cut-off n/8, shortest wavelength four samples. Each row
is a process of its own; seconds and memory are those of the flow, the latter with the libraries.
"""

import argparse
import multiprocessing
import time

from rough_gaps import Case

ROWS = [
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


def press(case: Case, connection) -> None:
    """Solve the contact in a process of its own, so that its memory is not the flow's."""
    connection.send(case.gap())


def measure(case: Case, rtol: float, connection) -> None:
    """Print one row for the gap that `connection` holds."""
    from fem_seal.film import GridFilm
    from fem_seal.flow import FlowSettings, leak_rate
    from fem_seal.memory import peak_memory

    gap = connection.recv()
    started = time.process_time()
    leak = leak_rate(GridFilm(gap), FlowSettings(viscosity=1e-3, pressure_drop=1e5, rtol=rtol))
    cpu = time.process_time() - started
    seconds = [sum(level.seconds.values()) for level in leak.levels]
    last = leak.levels[-1].seconds
    both = (last["primal"] + last["dual"]) / last["primal"]
    iterations = max(i for level in leak.levels for i in level.iterations.values())
    print(
        f"| {case.n} | {case.area:.2f} | ±{100 * leak.levels[-1].half_width:.2f} % "
        f"| {leak.unknowns} | {len(leak.levels)} | {iterations} | {cpu:.1f} "
        f"| {sum(seconds) / seconds[-1]:.1f} | {both:.1f} | {peak_memory() / 1e9:.2f} |",
        flush=True,
    )


def main() -> None:
    """Print the rows asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int)
    parser.add_argument("--area", type=float, default=0.4)
    parser.add_argument("--rtol", type=float, default=0.05)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rows = [(options.n, options.area, options.rtol)] if options.n else ROWS
    head = "n, A/A0, half-width, unknowns, levels, CG, CPU s, all levels / last, both solves / one"
    print("| " + head.replace(", ", " | ") + " | GB |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    fresh = multiprocessing.get_context("spawn")
    for n, area, rtol in rows:
        case = Case(n, 0.8, 4, area, options.seed)
        out, into = fresh.Pipe(duplex=False)
        contact = fresh.Process(target=press, args=(case, into))
        flow = fresh.Process(target=measure, args=(case, rtol, out))
        contact.start()
        flow.start()
        contact.join()
        flow.join()


if __name__ == "__main__":
    main()
