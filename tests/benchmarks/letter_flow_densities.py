"""How much less flows through elastic contact than through a cut of the same area, as numbers.

    python tests/benchmarks/letter_flow_densities.py 256:0.125 512:0.125 512:0.5 1024:0.5

Each argument is n:λ_l/L. A/A0 = 0.2, λ_s = 1 sample, H = 0.8, seed 1, brackets 20 % wide: log10 of
bearing over elastic mean flow density (the leak rate over the width), 99.9 % quantile, peak, and of
the parts of the cell that carry the flow; the mean also with the bearing contact at the corrected
area of the elastic one. The last column is CPU seconds.

    python tests/benchmarks/letter_flow_densities.py --seeds 4 512:0.125 512:0.5

prints the leak rates' log10 alone, of seeds 1 to 4, with mean and spread.
"""

import argparse
from time import process_time

import numpy as np

from fem_seal.letter.flow_points import certified
from fem_seal.letter.pictures import FLOW_AREA, SEED, FlowMeasures, decades, flow_picture_data
from fem_seal.letter.surfaces import MODELS, PITCH, RoughCase, at_area

RTOL = 0.2
MEASURES = ("total", "body", "peak", "participation", "half")


def densities(case: RoughCase) -> None:
    """Print all measures of the first seed."""
    start = process_time()
    flows = {m: FlowMeasures.of(flow_picture_data(case, m, RTOL)) for m in MODELS}
    cut = at_area(case.surface(SEED), "bearing", flows["elastic"].area_corrected)
    corrected = certified(cut.gap, RTOL).value / (case.n * PITCH) / flows["elastic"].total
    numbers = [decades(flows, name) for name in MEASURES] + [np.log10(corrected)]
    parts = [f"{flows[m].participation:.2g}/{flows[m].half:.2g}" for m in MODELS]
    seconds = process_time() - start
    print(case.name, *(f"{x:.2f}" for x in numbers), *parts, f"{seconds:.0f}", flush=True)


def total(case: RoughCase, seed: int) -> float:
    """log10 of bearing over elastic leak rate at `FLOW_AREA`."""
    surface = case.surface(seed)
    rates = {m: certified(at_area(surface, m, FLOW_AREA).gap, RTOL).value for m in MODELS}
    return float(np.log10(rates["bearing"] / rates["elastic"]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int)
    parser.add_argument("cases", nargs="*", default=["256:0.125", "512:0.125"])
    options = parser.parse_args()
    if options.seeds is None:
        print("case", *MEASURES, "total at equal corrected area", "seconds", sep=" | ")
    for argument in options.cases:
        n, long = argument.split(":")
        case = RoughCase(int(n), long=float(long))
        if options.seeds is None:
            densities(case)
            continue
        totals = [total(case, seed) for seed in range(1, options.seeds + 1)]
        print(
            case.name,
            *(f"{x:.2f}" for x in totals),
            f"mean {np.mean(totals):.2f}, spread {np.std(totals, ddof=1):.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
