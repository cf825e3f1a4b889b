"""What each number of the adaptive refinement costs: unknowns and seconds to ±1 % over 13 gaps.

python tests/benchmarks/adaptive_parameters.py [--rtol 0.02] [--max-unknowns 400000]
"""

import argparse
from dataclasses import replace

import numpy as np
from rough_gaps import FLUID, VARIETY, cost_of

from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, Limits, Tuning, leak_rate

OTHERS = {
    "chi": (0.01, 0.3),
    "theta": (0.5, 0.8, 0.95),
    "theta_blocked": (0.5, 0.85, 0.0),
    "theta_residual": (0.0, 0.9),
    "ahead": (0, 1, 4),
    "cut": (1e-1, 1e-3),
    "floor": (1e-2,),
    "ceiling": (20.0, np.inf),
    "tolerance": (1e-6, 1e-10),
    "coarsest": (16, 64),
}
CHOICES = {"as shipped": Tuning()} | {
    f"{name} {value:g}": replace(Tuning(), **{name: value})
    for name, values in OTHERS.items()
    for value in values
}


def main() -> None:
    """Print unknowns and CPU seconds of every choice relative to the shipped one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rtol", type=float, default=0.02)
    parser.add_argument("--max-unknowns", type=int, default=400_000)
    parser.add_argument("--only", nargs="*", default=list(CHOICES), choices=list(CHOICES))
    arguments = parser.parse_args()
    ratios: dict[str, list[tuple[float, float]]] = {name: [] for name in arguments.only}
    for case in VARIETY:
        film, shipped = GridFilm(case.gap(), sides="periodic"), None
        limits = Limits(unknowns=arguments.max_unknowns)
        settings = FlowSettings(rtol=arguments.rtol, limits=limits, **FLUID)
        # All choices on one gap, then the next: a machine that is slower for a while is so for all.
        for name in arguments.only:
            tuning = CHOICES[name]
            leak, seconds, _ = cost_of(lambda: leak_rate(film, settings, tuning=tuning))  # noqa: B023
            if leak.state == "sealed":
                print(f"{case} is sealed")
                break
            most = max(i for level in leak.levels for i in level.iterations.values())
            shipped = shipped or (leak.unknowns, seconds)
            ratios[name].append((leak.unknowns / shipped[0], seconds / shipped[1]))
            print(
                f"{case!s:44s} {name:24s} {leak.unknowns:8d} unknowns "
                f"±{100 * leak.levels[-1].half_width:.2f} % {len(leak.levels):3d} levels "
                f"{seconds:6.1f} s, CG ≤ {most} {'' if leak.converged else leak.reason}",
                flush=True,
            )
    for name, of_cases in ratios.items():
        unknowns, seconds = np.exp(np.mean(np.log(of_cases), axis=0))
        print(f"{name:24s} unknowns × {unknowns:.2f}, seconds × {seconds:.2f}")


if __name__ == "__main__":
    main()
