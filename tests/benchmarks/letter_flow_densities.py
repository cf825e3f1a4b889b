"""How much less flows through elastic contact than through a cut of the same area, as numbers.

    python tests/benchmarks/letter_flow_densities.py 256:0.125 512:0.125 512:0.5 1024:0.5

Each argument is n:λ_l/L. A/A0 = 0.2, λ_s = 1 sample, H = 0.8, seed 1, brackets 20 % wide: log10 of
bearing over elastic mean flow density (the leak rate over the width), 99.9 % quantile, peak, and of
the parts of the cell that carry the flow; the mean also for the bearing contact whose area is the
corrected one of the elastic contact. CPU seconds last.
"""

import sys
from time import process_time

import numpy as np

from fem_seal.letter.flow_points import certified
from fem_seal.letter.pictures import SEED, FlowMeasures, decades, flow_picture_data
from fem_seal.letter.surfaces import MODELS, PITCH, RoughCase, at_area

MEASURES = ("total", "body", "peak", "participation", "half")


def main():
    print("n λ_l/L", *MEASURES, "total at equal corrected area", "seconds", sep=" | ")
    for argument in sys.argv[1:] or ["256:0.125", "512:0.125"]:
        n, long = argument.split(":")
        case, start = RoughCase(int(n), long=float(long)), process_time()
        flows = {m: FlowMeasures.of(flow_picture_data(case, m, 0.2)) for m in MODELS}
        cut = at_area(case.surface(SEED), "bearing", flows["elastic"].area_corrected)
        corrected = certified(cut.gap, 0.2).value / (case.n * PITCH) / flows["elastic"].total
        numbers = [decades(flows, name) for name in MEASURES] + [np.log10(corrected)]
        parts = [f"{flows[m].participation:.2g}/{flows[m].half:.2g}" for m in MODELS]
        seconds = process_time() - start
        print(n, long, *(f"{x:.2f}" for x in numbers), *parts, f"{seconds:.0f}", flush=True)


if __name__ == "__main__":
    main()
