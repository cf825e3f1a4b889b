"""How much narrower the bubbles of `flow/hierarchical.py` make the bracket, step by step of their
CG.

python tests/benchmarks/correction_steps.py
"""

import time

from rough_gaps import VARIETY

from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, Limits, hierarchical, leak_rate
from fem_seal.flow.level import LevelProblem

STEPS = (0, 1, 2, 3, 4, 8)


def main() -> None:
    """Print the width of the bracket of the last mesh relative to that without bubbles."""
    print(f"{'':44s} unknowns  " + "  ".join(f"{k} steps" for k in STEPS) + "  CPU s of 4")
    as_it_is = LevelProblem.corrected
    for case in VARIETY[::2]:
        last = {}

        def corrected(problem, pressure, stream, last=last):
            usual = hierarchical.STEPS
            for steps in STEPS:
                started, hierarchical.STEPS = time.process_time(), steps
                lower, upper = as_it_is(problem, pressure, stream).numbers
                last[steps] = (upper / lower - 1, time.process_time() - started)
            hierarchical.STEPS = usual
            return as_it_is(problem, pressure, stream)

        LevelProblem.corrected = corrected
        limits = Limits(unknowns=200_000)
        leak = leak_rate(
            GridFilm(case.gap()),
            FlowSettings(viscosity=1e-3, pressure_drop=1e5, rtol=0.04, limits=limits),
        )
        if not last:
            continue
        widths = "  ".join(f"{last[k][0] / last[0][0]:7.3f}" for k in STEPS)
        print(f"{case!s:44s} {leak.unknowns:8d}  {widths}  {last[4][1]:.2f}", flush=True)


if __name__ == "__main__":
    main()
